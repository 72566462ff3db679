"""Calibration: values within their priors for which agreement with the repeats is most probable under input scatter."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from blocksim.errors import InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.extras import loaded
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_text
from blocksim.simulation.stopping import interruptible
from blocksim.study.calibrate_plan import Plan, Prior
from blocksim.study.calibrate_search import (
    PURPOSE,
    Hit,
    Score,
    Trial,
    finished_trials,
    hits_of,
    opened,
    refuse_other_file,
    score_of,
    search,
)
from blocksim.study.executors.ensemble import Values, run_members
from blocksim.study.fitted_file import NOTE, with_fitted

TRIALS = 100
MEMBERS = 64
FRESH_MEMBERS = 512
WRITTEN = "scenario.toml"
JOURNAL = ".trials.jsonl"
NEEDED = ("optuna", "scipy.stats.qmc")  # before anything is written
OnTrial = Callable[[Trial, Trial, int], None]


@dataclass(frozen=True)
class Fit:
    """What a calibration found; `score` is of fresh samples, drawn independently, that no trial has seen."""

    plan: Plan
    best: Trial
    score: Score
    trials: int
    path: Path
    hits: tuple[Hit, ...]  # of the fresh members, a quantity each
    ties: tuple[Trial, ...] = ()  # all that are as good as the best by `ties_with`, the best among them

    @property
    def found(self) -> bool:
        """Return True if a member of the best trial or a fresh one is inside all ranges; if not, it is the nearest."""
        return _is_found(self.best, self.score)

    @property
    def is_one_of_many(self) -> bool:
        """Return True if other values are as good: the measurement does not decide between them."""
        return len(self.ties) > 1

    def equally_good(self, prior: Prior) -> tuple[float, float]:
        """Return the least and the greatest of the equally good values of a key, in the unit of its prior."""
        return _span(prior, self.ties or (self.best,))

    @property
    def at_bounds(self) -> tuple[Prior, ...]:
        """Priors at an end of which the fitted value lies: a wider one might give a better fit."""
        return tuple(prior for prior in self.plan.priors if prior.lies_at_bound(self.best.values[prior.key]))


def calibrate(
    plan: Plan,
    *,
    trials: int = TRIALS,
    fresh_members: int = FRESH_MEMBERS,
    out: Path | None = None,
    resume: bool = False,
    overwrite: bool = False,
    on_trial: OnTrial = silent,
) -> Fit:
    """Find the best values in `trials` trials, measure how probable agreement is with them, write a scenario file.

    The file is `out` (default: results/NAME/calibrate-HASH/scenario.toml); beside it every trial is kept as it ends, in
    FILE.trials.jsonl. `resume` continues with trials that are there, `overwrite` replaces them and the file; a finished
    calibration that is resumed leaves its file as it is. `on_trial` is reported every new trial, the best so far, and
    how many are to be made. Raises OutputExistsError, OutputError,
    UnavailableError without the extra `study`, and StoppedEarlyError on Ctrl-C.
    """
    path = out or files.RESULTS / plan.base.name / f"calibrate-{plan.name()}" / WRITTEN
    journal = path.parent / (path.stem + JOURNAL)
    for package in NEEDED:
        loaded(package, PURPOSE)
    prepare(path, journal, resume=resume, overwrite=overwrite)
    kept = path if path.exists() and not overwrite else None
    best, ties = _searched(plan, journal, trials, on_trial, kept)
    fresh = plan.scatter.fresh_members(best.values, fresh_members if plan.scatter.plan else 1, plan.seed)
    members = list(run_members(plan.bare, fresh))
    score = score_of(members, plan.ranges)
    text = with_fitted(
        plan.document,
        best.values,
        _provenance(plan, best, score, trials, ties),
        path.parent,
        _head(plan, best, ties),
        f"one of {len(ties)} equally good, see [provenance]" if len(ties) > 1 else NOTE,
    )
    if kept is None:
        write_text(path, text)
    elif kept.read_bytes() != text.encode():
        raise OutputExistsError(_taken(kept))
    return Fit(plan, best, score, trials, path, hits_of(members, plan.ranges), ties)


def prepare(path: Path, journal: Path, *, resume: bool, overwrite: bool) -> None:
    """Make the folder, and room in it. Raises OutputExistsError for files that must not go."""
    if path.is_dir():
        raise OutputExistsError(f"{path}: this is a folder; a file name is needed")
    has_trials = journal.exists() and journal.stat().st_size > 0
    if path.exists() and not overwrite and not (resume and has_trials):
        raise OutputExistsError(_taken(path))
    if has_trials and not (resume or overwrite):
        message = f"{journal}: has trials of a calibration; --resume continues them, --overwrite starts again"
        raise OutputExistsError(message)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if overwrite and not resume and journal.exists():
            refuse_other_file(journal)
            journal.unlink()
    except OSError as error:
        raise OutputExistsError(f"{path.parent}: cannot be created: {error.strerror}") from error


def _taken(path: Path) -> str:
    return f"{path}: already exists; --overwrite replaces it, --out FILE writes elsewhere"


def _searched(
    plan: Plan, journal: Path, trials: int, on_trial: OnTrial, kept: Path | None
) -> tuple[Trial, tuple[Trial, ...]]:
    """Return the best trial, the first of equally good ones, and all that tie with it, the best among them."""
    best: Trial | None = None
    tried: list[Trial] = []

    def evaluate(values: Mapping[str, object]) -> Score:
        return _score(plan, plan.scatter.members(values, plan.members, plan.seed))

    with opened(journal, plan.fingerprint()) as study, interruptible():
        done = len(finished_trials(study))
        if kept is not None and done < trials:  # they would change the file
            raise OutputExistsError(_taken(kept))
        try:
            for trial in search(plan.priors, evaluate, study, trials=trials, seed=plan.seed):
                tried.append(trial)
                best = trial if best is None or trial.score.value > best.score.value else best
                if trial.number > done:
                    on_trial(trial, best, trials)
        except KeyboardInterrupt:
            message = f"stopped after {len(finished_trials(study))} of {trials} trials; --resume runs the rest"
            raise StoppedEarlyError(message) from None
    if best is None:
        raise InvalidInputError("at least one trial is needed")
    return best, tuple(trial for trial in tried if trial.score.ties_with(best.score))


def _span(prior: Prior, trials: Iterable[Trial]) -> tuple[float, float]:
    numbers = [prior.number(trial.values[prior.key]) for trial in trials]
    return min(numbers), max(numbers)


def _score(plan: Plan, members: Iterable[Values]) -> Score:
    return score_of(run_members(plan.bare, members), plan.ranges)


def _is_found(best: Trial, score: Score) -> bool:
    return best.score.inside + score.inside > 0


def _provenance(plan: Plan, best: Trial, score: Score, trials: int, ties: Sequence[Trial]) -> dict[str, str]:
    """Say of every fitted value where it comes from."""
    table = Path(plan.table.source).name
    if plan.scatter.plan is None:
        inside = "inside" if score.inside else "not inside"
        found = f"seed {plan.seed}, {trials} trials of one run, {inside} all ranges of {table}"
    else:
        low, high = score.interval
        scatter = ", ".join(f"{key} {words}" for key, words in plan.scatter.described().items())
        found = (
            f"seed {plan.seed}, {trials} trials of {plan.members} samples, P(inside all ranges) "
            f"{score.share_inside:.3f} [{low:.3f}, {high:.3f}] of {score.members} fresh samples, {table}, "
            f"scatter (SI): {scatter}"
        )
    verb = "calibrated" if _is_found(best, score) else "not calibrated (nothing inside all ranges, nearest values)"
    among = {prior.key: _among(prior, ties) for prior in plan.priors}
    return {prior.key: f"{verb}{among[prior.key]}, prior {prior}, {found}" for prior in plan.priors}


def _among(prior: Prior, ties: Sequence[Trial]) -> str:
    """Say among which values a value is one of several that are equally good."""
    if len(ties) <= 1:
        return ""
    return f", one of {len(ties)} equally good trials ({prior.range_of(*_span(prior, ties))})"


def _head(plan: Plan, best: Trial, ties: Sequence[Trial]) -> str:
    name = Path(plan.document.source.where).name
    which = f"one of {len(ties)} equally good trials: " if len(ties) > 1 else ""
    values = ", ".join(f"{key} = {value}" for key, value in best.values.items())
    return f"{name} calibrated by blocksim: {which}{values}"
