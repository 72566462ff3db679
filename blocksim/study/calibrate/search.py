"""The search for the best values: trials kept in a journal, so that a search that was stopped continues.

Trials come one after the other. The first ones are points of a scrambled Sobol sequence over the priors, the others are
suggested by a tree-structured Parzen estimator (J. Bergstra et al., NIPS 24 (2011) 2546-2554; optuna's, multivariate)
from all trials before. A trial depends on the seed, its number and the results before it, on nothing else: so a search
that was stopped and resumed goes the same way as one that was not, and a longer one begins as a shorter one.
"""

import logging
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from blocksim.errors import InvalidInputError, OutputError, OutputExistsError
from blocksim.extras import loaded
from blocksim.scenario.limited import read_head
from blocksim.study.calibrate.objective import Score
from blocksim.study.calibrate.prior import Prior

if TYPE_CHECKING:
    from optuna import Study

PURPOSE = "calibrate"
FIRST = 16  # trials before the estimator: a power of two, as a Sobol sequence wants it
STUDY = "calibrate"
PLAN = "plan"
BEGINNING = b'{"op_code":0,'  # of a journal of optuna: a study is created
VALUES = "values"
SCORE = "score"
Evaluate = Callable[[Mapping[str, object]], Score]


@dataclass(frozen=True)
class Trial:
    """One set of values that was tried, as a scenario takes them, and what it came to; numbers count from 1."""

    number: int
    values: dict[str, object]
    score: Score


def search(priors: Sequence[Prior], evaluate: Evaluate, study: "Study", *, trials: int, seed: int) -> Iterator[Trial]:
    """Yield every trial up to `trials`, first those that the study has already."""
    done = finished_trials(study)
    yield from done
    for number in range(len(done), trials):
        yield _next_trial(priors, evaluate, study, number, seed)


def _next_trial(priors: Sequence[Prior], evaluate: Evaluate, study: "Study", number: int, seed: int) -> Trial:
    """Make one trial; it is in the journal when this returns."""
    optuna = loaded("optuna", PURPOSE)
    with _quiet():
        study.sampler = optuna.samplers.TPESampler(
            n_startup_trials=0, multivariate=True, seed=int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
        )
    spread = {prior.key: _distribution(optuna, prior) for prior in priors}
    if number < FIRST:
        asked, params = None, _first_point(priors, number, seed)
    else:
        asked = study.ask(spread)
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
    return Trial(number + 1, values, score)


def _distribution(optuna: Any, prior: Prior) -> Any:
    return optuna.distributions.FloatDistribution(prior.low, prior.high, log=prior.log)


def _first_point(priors: Sequence[Prior], number: int, seed: int) -> dict[str, float]:
    """Return a point of the Sobol sequence: numbers in the units of the priors."""
    qmc = loaded("scipy.stats.qmc", PURPOSE)
    point = qmc.Sobol(len(priors), rng=np.random.default_rng(seed)).random(FIRST)[number]
    return {prior.key: prior.at(float(share)) for prior, share in zip(priors, point, strict=True)}


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
            _take(file, journal)
            _drop_torn_line(journal)
            study = _study_in(journal)
            _refuse_other_plan(study, plan, journal)
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


def _take(file: Any, journal: Path) -> None:
    """Lock a file until it is closed; raises OutputExistsError where somebody else has it."""
    try:
        import fcntl  # noqa: PLC0415 - not on every system; there two at once are the user's affair
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        message = f"{journal}: another calibration is writing here; wait for its end, or choose another file with --out"
        raise OutputExistsError(message) from None


def refuse_other_file(journal: Path) -> None:
    """Raise InvalidInputError for a file that is no journal; one that is empty, or torn, may be."""
    content = read_head(journal, len(BEGINNING))
    if not BEGINNING.startswith(content):
        message = f"{journal}: not the journal of a calibration; choose another file with --out"
        raise InvalidInputError(message)


def _drop_torn_line(journal: Path) -> None:
    """Cut off a last line that has no end: what was written when the power failed. Leaves other files alone."""
    refuse_other_file(journal)
    content = journal.read_bytes()
    whole = content.rfind(b"\n") + 1
    if whole < len(content):
        with journal.open("r+b") as file:
            file.truncate(whole)


def _refuse_other_plan(study: "Study", plan: Mapping[str, object], journal: Path) -> None:
    known = study.user_attrs.get(PLAN)
    if known is None:
        study.set_user_attr(PLAN, dict(plan))
        return
    differing = [name for name, value in plan.items() if known.get(name) != value]
    if differing:
        message = (
            f"{journal}: holds trials of another calibration ({', '.join(differing)} differ); "
            "--overwrite starts again, --out FILE writes elsewhere"
        )
        raise OutputExistsError(message)


@contextmanager
def _quiet() -> Iterator[None]:
    """Let optuna's remark pass that multivariate sampling may change in later versions."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
