"""The search for the best values: how an ensemble is scored, and trials kept in a journal, so that it can continue.

How well an ensemble agrees with the repeats: the probability of being inside all ranges, and a guide towards it.

Every quantity of a member is measured from the middle of its range in half-widths of the range: r <= 1 is inside. The
ranges are those of `compare` (the smallest and the largest repeat, 5 degrees either side for rotations, 0.5 mm for
repeats that are all equal). With M members, of which those with every r <= 1 are a share P, the score of an ensemble is

    score = P - mean(miss) / (2 M)

    miss = max(r) - 1           in [-1, 0]  for a member inside: how near it is to the nearest limit
         = mean(max(0, 1 - 1/r)) in (0, 1)   for a member outside: how far, over its quantities; saturates
         = 1                                for a member that failed

Where no member is inside, the probability is 0 all around and says nothing; there the miss leads on. Where all are
inside, it leads to the middle of the region. It never outweighs the probability: two ensembles whose P differ do so
by at least 1/M, and their mean misses by less than 2, so by less than 1/M in the score. Both parts of the miss are
0 at the limit, so that it grows steadily as a member moves outwards.

Trials come one after the other. The first ones are points of a scrambled Sobol sequence over the priors, the others are
suggested by a tree-structured Parzen estimator (J. Bergstra et al., NIPS 24 (2011) 2546-2554; optuna's, multivariate)
from all trials before. A trial depends on the seed, its number and the results before it, on nothing else: so a search
that was stopped and resumed goes the same way as one that was not, and a longer one begins as a shorter one.
"""

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, cast

import numpy as np

from blocksim.analysis.intervals import interval
from blocksim.errors import InvalidInputError, OutputError, OutputExistsError
from blocksim.extras import loaded
from blocksim.scenario.bounded_read import read_head
from blocksim.simulation.folder import takes_lock
from blocksim.study.calibrate_plan import Prior
from blocksim.study.executors.ensemble import Member
from blocksim.study.rows import Range, are_inside, values_at

if TYPE_CHECKING:
    from optuna import Study

FAILED = 1.0  # the miss of a member that failed
PURPOSE = "calibrate"
FIRST = 16  # trials before the estimator: a power of two, as a Sobol sequence wants it
STUDY = "calibrate"
PLAN = "plan"
BEGINNING = b'{"op_code":0,'  # of a journal of optuna: a study is created
VALUES = "values"
SCORE = "score"


@dataclass(frozen=True)
class Score:
    """What the members of one ensemble come to."""

    members: int
    inside: int
    failed: int
    miss: float  # mean over all members

    @property
    def share_inside(self) -> float:
        """Share of all members, also of failed ones, that are inside all ranges."""
        return self.inside / self.members

    @property
    def value(self) -> float:
        """The number to be maximised."""
        return self.share_inside - self.miss / (2.0 * self.members)

    def ties_with(self, best: "Score") -> bool:
        """Return True if a score is as good as the best one: as many members are inside, or none is, and as far off.

        How near the middle of their ranges members are inside only steers the search: no measurement prefers it.
        """
        return self.inside == best.inside and (best.inside > 0 or self.miss == best.miss)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % limits (Clopper-Pearson) of the probability behind this share, for members drawn independently."""
        return interval(self.inside, self.members)


@dataclass(frozen=True)
class Hit:
    """How one measured quantity agrees: where the members end (mm or degrees), and the share that is inside."""

    range: Range
    median: float  # of the finished members; NaN where there is none
    share_inside: float  # of all members


def hits_of(members: Sequence[Member], ranges: Sequence[Range]) -> tuple[Hit, ...]:
    """Return how each quantity agrees, for at least one member."""
    finals = [member.final for member in members if member.final is not None]
    values = [values_at(final, ranges) for final in finals]
    columns = [[row[i] for row in values if isfinite(row[i])] for i in range(len(ranges))]
    return tuple(
        Hit(one, median(column) if column else nan, sum(map(one.holds, column)) / len(members))
        for one, column in zip(ranges, columns, strict=True)
    )


def score_of(members: Iterable[Member], ranges: Sequence[Range]) -> Score:
    """Judge an ensemble of at least one member."""
    rows = [None if member.final is None else values_at(member.final, ranges) for member in members]
    misses = [None if row is None or not all(map(isfinite, row)) else miss_of(row, ranges) for row in rows]
    return Score(
        members=len(misses),
        inside=sum(miss is not None and miss <= 0.0 for miss in misses),
        failed=misses.count(None),
        miss=sum(FAILED if miss is None else miss for miss in misses) / len(misses),
    )


def miss_of(values: Sequence[float], ranges: Sequence[Range]) -> float:
    """Return how far a member is from being inside (above 0) or from the nearest limit (at most 0)."""
    off = [one.off_centre(value) for one, value in zip(ranges, values, strict=True)]
    if are_inside(values, ranges):
        return min(max(off) - 1.0, 0.0)
    # above 0 also where rounding hides by how much
    outside = [
        0.0 if one.holds(value) else max(1.0 - 1.0 / r, 1e-15)
        for one, value, r in zip(ranges, values, off, strict=True)
    ]
    return sum(outside) / len(outside)


Evaluate = Callable[[Mapping[str, object]], Score]


@dataclass(frozen=True)
class Trial:
    """One set of values that was tried, as a scenario takes them, and what it came to; numbers count from 1."""

    number: int
    values: dict[str, object]
    score: Score


def search(priors: Sequence[Prior], evaluate: Evaluate, study: "Study", *, trials: int, seed: int) -> Iterator[Trial]:
    """Yield every trial up to `trials`, first those that the study has; a new one is in the journal when it comes."""
    optuna, qmc = loaded("optuna", PURPOSE), loaded("scipy.stats.qmc", PURPOSE)
    done = finished_trials(study)
    yield from done
    spread = {one.key: optuna.distributions.FloatDistribution(one.low, one.high, log=one.log) for one in priors}
    for number in range(len(done), trials):
        words = np.random.SeedSequence([seed, number]).generate_state(1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that multivariate sampling may change in later versions
            study.sampler = optuna.samplers.TPESampler(n_startup_trials=0, multivariate=True, seed=int(words[0]))
        asked = study.ask(spread) if number >= FIRST else None
        if asked is None:
            point = qmc.Sobol(len(priors), rng=np.random.default_rng(seed)).random(FIRST)[number].tolist()
            params = {prior.key: prior.at(share) for prior, share in zip(priors, point, strict=True)}
        else:
            params = asked.params
        values = {prior.key: prior.value(params[prior.key]) for prior in priors}
        score = evaluate(values)
        kept = {VALUES: values, SCORE: [score.members, score.inside, score.failed, score.miss]}
        if asked is None:
            state = optuna.trial.create_trial(params=params, distributions=spread, value=score.value, user_attrs=kept)
            study.add_trial(state)
        else:
            for name, value in kept.items():
                asked.set_user_attr(name, value)
            study.tell(asked, score.value)
        yield Trial(number + 1, values, score)


def finished_trials(study: "Study") -> list[Trial]:
    """Return the trials of a study that came to an end, in order; one that was cut off is none."""
    state = loaded("optuna", PURPOSE).trial.TrialState.COMPLETE
    with_ends = [trial.user_attrs for trial in study.get_trials(deepcopy=False) if trial.state is state]
    return [
        Trial(number, dict(attributes[VALUES]), Score(*attributes[SCORE]))
        for number, attributes in enumerate(with_ends, start=1)
    ]


@contextmanager
def opened(journal: Path, plan: Mapping[str, object]) -> "Iterator[Study]":
    """Give the study of a journal, a new one where there is none, that nobody else writes to meanwhile.

    Raises OutputExistsError where the journal is of another plan or in use, InvalidInputError where the file is none,
    OutputError where it cannot be written.
    """
    if journal.exists():
        refuse_other_file(journal)  # also before a pipe is opened, which would wait
    loaded("optuna", PURPOSE).logging.set_verbosity(logging.ERROR)
    try:
        with journal.open("ab") as file:
            if not takes_lock(file.fileno()):
                where = "wait for it, or choose another file with --out"
                raise OutputExistsError(f"{journal}: another calibration is running here; {where}")
            refuse_other_file(journal)
            content = journal.read_bytes()
            file.truncate(content.rfind(b"\n") + 1)  # without a last line that was torn when the power failed
            study = _study_in(journal)
            known = study.user_attrs.get(PLAN)
            if known is None:
                study.set_user_attr(PLAN, dict(plan))
            differing = [name for name, value in plan.items() if known is not None and known.get(name) != value]
            if differing:
                message = (
                    f"{journal}: holds trials of another calibration ({', '.join(differing)} differ); "
                    "--overwrite starts again, --out FILE writes elsewhere"
                )
                raise OutputExistsError(message)
            yield study
    except OSError as error:
        message = f"{journal}: cannot be written: {error.strerror}"
        raise OutputError(message) from error


def _study_in(journal: Path) -> "Study":
    """Return the study in a journal, or a new one."""
    optuna = loaded("optuna", PURPOSE)
    backend = loaded("optuna.storages.journal", PURPOSE).JournalFileBackend(str(journal), lock_obj=_AlreadyLocked())
    try:
        storage = optuna.storages.JournalStorage(backend)
        if STUDY in optuna.get_all_study_names(storage):
            return cast("Study", optuna.load_study(study_name=STUDY, storage=storage))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        message = f"{journal}: not the journal of a calibration: {error}"
        raise InvalidInputError(message) from None
    return cast("Study", optuna.create_study(study_name=STUDY, storage=storage, direction="maximize"))


class _AlreadyLocked:
    """What optuna takes for a lock; the file is locked as a whole, and freed by the system when a process is killed."""

    def acquire(self) -> bool:
        return True

    def release(self) -> None:
        pass


def refuse_other_file(journal: Path) -> None:
    """Raise InvalidInputError for a file that is no journal; one that is empty, or torn, may be."""
    content = read_head(journal, len(BEGINNING))
    if not BEGINNING.startswith(content):
        message = f"{journal}: not the journal of a calibration; choose another file with --out"
        raise InvalidInputError(message)
