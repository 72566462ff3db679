"""What a calibration is asked for, checked before anything runs, and the search for the best values."""

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, field
from math import ceil, exp, isfinite, log, log10, nan, sqrt
from operator import eq
from pathlib import Path
from statistics import median
from threading import RLock
from typing import TYPE_CHECKING, Annotated

import numpy as np

from blocksim.analysis.compare import interval
from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InputMissingError, InvalidInputError, OutputError, OutputExistsError, Problem, ScenarioError
from blocksim.extras import load_module
from blocksim.options import Option, silent
from blocksim.scenario import Document, Model, Scenario, Sweep, input_files, overrides, units
from blocksim.scenario.models.study import Normal, Uniform, toml_number
from blocksim.simulation import files, provenance
from blocksim.study import compare, plan as plans
from blocksim.study.executors.ensemble import Member
from blocksim.study.rows import Range, check_experiment, ranges_of, si_number, values_at

if TYPE_CHECKING:
    from optuna import Study


STEPS = 1000  # as fine as this part of the prior are the values that are tried
AT_BOUND = 0.01  # of the prior's width: nearer to a bound, a value is reported to lie at it
SAME = "sobol"  # the same points for every trial: trials differ by their values only
FRESH = "normal"  # independent draws, from streams of their own
FIT, SCATTER = "--fit", "--scatter"
MODE = "sobol"
TABLE = "experiment.table"
NO_SCATTER = (
    "no input scatter: give --scatter KEY=MEAN+-SD (or KEY=FROM:TO), or a [sweep] table with distributions; "
    "--samples 1 fits a single run, whose agreement may be chance"
)


@dataclass(frozen=True)
class Prior:
    """Bounds of a key, in `unit` (empty: plain numbers, or SI); `log`: even in the logarithm."""

    key: str
    low: float
    high: float
    unit: str = ""
    log: bool = False

    def at(self, share: float) -> float:
        """Return the number at a share (0 to 1) of the prior."""
        if not self.log:
            return self.low + share * (self.high - self.low)
        return exp(log(self.low) + share * (log(self.high) - log(self.low)))

    def value(self, number: float) -> object:
        """Return a number as a scenario takes it, rounded to what matters and never outside the bounds."""
        width = self.high - self.low
        finest = min(width, abs(number)) if self.log and number else width
        digits = ceil(log10(STEPS / finest))
        within = min(max(round(number, digits), self.low), self.high)
        return f"{within:.12g} {self.unit}" if self.unit else within

    def number(self, value: object) -> float:
        """Return the number in a value that `value` gave."""
        return float(str(value).split(" ", maxsplit=1)[0])

    def lies_at_bound(self, value: object) -> bool:
        """Return True if a value is within a hundredth of the prior's width of one of its ends."""
        ends, number = (self.low, self.high), self.number(value)
        if self.log:
            ends, number = (log(self.low), log(self.high)), log(number)
        return min(number - ends[0], ends[1] - number) <= AT_BOUND * (ends[1] - ends[0])

    def range_of(self, low: float, high: float) -> str:
        """Write a range within the prior as a person does: "0.17 to 0.31"."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{low:g} to {high:g}{unit}"


def prior_of(key: str, table: Uniform, written: object) -> Prior:
    """Return the prior that a distribution says; `written` is its lower end as the user wrote it, for the unit."""
    unit = units.unit_in(written) if isinstance(written, str) else ""
    if not unit:
        return Prior(key, table.low, table.high, "rad" if table.angle else "", table.scale == "log")
    factor = float(units.parse_unit(unit).factor)
    low, high = (float(f"{end / factor:.12g}") for end in (table.low, table.high))
    return Prior(key, low, high, unit, table.scale == "log")


def members_of(
    scatter: Sweep | None, fitted: Mapping[str, object], count: int, seed: int, mode: str = SAME
) -> Iterator[dict[str, object]]:
    """Yield the values of the members of a trial: the same points of the unit cube for every trial.

    In mode FRESH they are drawn independently, from random numbers that no trial has seen.
    """
    if scatter is None:
        yield from (dict(fitted) for _ in range(count))
        return
    plan = scatter.model_copy(update={"mode": mode, "samples": count, "seed": seed})
    names = {overrides.parse_key(key): key for key in fitted}
    for row in plans.design_of(plan):
        values = dict(fitted)
        for key, value in row.items():
            name = names.get(overrides.parse_key(key), key)
            about = plan.vary[key] if name in fitted else ()  # levels are refused when the plan is read
            values[name] = value if isinstance(about, tuple) else centre_on_fit(about, value, fitted[name])
        yield values


def centre_on_fit(distribution: Uniform | Normal, drawn: object, fitted: object) -> object:
    """Return a drawn value moved so that the distribution lies about the fitted value.

    By the difference to its mean or middle, or by the ratio where its logarithm is evenly distributed.
    """
    number, centre = si_number(drawn), si_number(fitted)
    if isinstance(distribution, Uniform) and distribution.scale == "log":
        moved = number * centre / sqrt(distribution.low * distribution.high)
    elif isinstance(distribution, Uniform):
        moved = number - 0.5 * (distribution.low + distribution.high) + centre
    else:
        moved = number - distribution.mean + centre
    return toml_number(moved, angle=distribution.angle)


def scatter_texts(scatter: Sweep | None) -> dict[str, str]:
    """Return every key with its distribution in words, in SI, for a message or for provenance."""
    words = {}
    for key, values in scatter.vary.items() if scatter else ():
        if isinstance(values, tuple):
            words[key] = " or ".join(map(str, values))
            continue
        table = values.as_table()
        if isinstance(values, Uniform):
            words[key] = f"{table['from']} to {table['to']}" + (", log" if "scale" in table else "")
        else:
            bounds = f" in {table['from']}-{table['to']}" if {"from", "to"} <= set(table) else ""
            words[key] = f"{table['mean']} +- {table['sd']}{bounds}"
    return words


@dataclass(frozen=True)
class CalibrationPlan:
    """A scenario, what is fitted in it within which priors, the scatter that agreement has to bear, and the table."""

    document: Document  # with settings and experiment table
    bare: Document  # the same without [sweep], which no member needs
    base: Scenario
    priors: tuple[Prior, ...]
    scatter: Sweep | None  # None where nothing scatters
    table: ExperimentTable
    ranges: tuple[Range, ...]  # that members are judged by
    members: int
    seed: int

    def fingerprint(self) -> dict[str, object]:
        """Return all that decides a trial: trials in a journal belong to this plan if theirs is the same."""
        return {
            "scenario": Model(self.base).hash,
            "priors": [str((one.key, one.low, one.high, one.unit, one.log)) for one in self.priors],
            "scatter": None if self.scatter is None else str(self.scatter.as_table()),
            "experiment": files.sha256_of(Path(self.table.source)),
            "members": self.members,
            "seed": self.seed,
            "code": provenance.code_hash(),
        }


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

    @property
    def interval(self) -> tuple[float, float]:
        """95 % limits (Clopper-Pearson) of the probability behind this share, for members drawn independently."""
        return interval(self.inside, self.members)


@dataclass(frozen=True)
class Trial:
    """One set of values that was tried, as a scenario takes them, and what it came to; numbers count from 1."""

    number: int
    values: dict[str, object]
    score: Score


@dataclass(frozen=True)
class CalibrateOptions:
    """What is fitted under which scatter, how long it is searched, and where the answer goes."""

    fit: Annotated[
        Mapping[str, plans.Values],
        plans.variations_option(
            "A key to fit, and its prior. Repeatable.",
            "KEY=FROM:TO",
            'The priors by dotted key, as {"contact.restitution": {"from": 0.2, "to": 0.35}}.',
            FIT,
            plans.RANGE,
        ),
    ] = field(default_factory=dict)
    scatter: Annotated[
        Mapping[str, plans.Values] | None,
        plans.variations_option(
            "Scatter of an input (KEY=FROM:TO: uniform); of a fitted key, about its fitted value. Repeatable. "
            "Default: the distributions of [sweep].",
            "KEY=MEAN+-SD",
            "The distributions of inputs, {mean, sd} or {from, to} (default: those of [sweep]); of a fitted "
            "key, about its fitted value.",
            SCATTER,
            plans.SPREAD,
        ),
    ] = None
    _: KW_ONLY
    trials: Annotated[int, Option("Number of trials.", metavar="N", least=1)] = 100
    members: Annotated[
        int,
        Option("Samples of the scatter per trial.", flags=("--samples", "--members"), metavar="M", least=1),
    ] = 64
    fresh_members: Annotated[
        int,
        Option("Fresh samples for the final estimate of the probability.", flags=("--fresh",), metavar="M", least=1),
    ] = 512
    seed: Annotated[int, Option("Random seed.", metavar="S", least=0)] = 0
    experiment: compare.ExperimentTablePath = None
    out: Annotated[
        Path | str | None,
        Option("Scenario file to write (default: results/NAME/calibrate-HASH/scenario.toml).", metavar="FILE"),
    ] = None
    resume: Annotated[bool, Option("Resume with the existing trials.")] = False
    overwrite: Annotated[bool, Option("Replace the file and the existing trials.")] = False
    on_start: Callable[[str], None] = silent
    on_trial: Callable[[Trial, Trial, int], None] = silent


def calibration_plan(document: Document, options: CalibrateOptions) -> CalibrationPlan:
    """Check what is asked for. Without scatter, the scenario's own [sweep] table counts where it has distributions.

    Raises ScenarioError for keys, priors and distributions that do not fit, InputMissingError without a table,
    InvalidInputError where the table does not go with the blocks, nothing is fitted, or nothing scatters though there
    is more than one member.
    """
    fit, scatter = plans.Variations.of(options.fit), plans.Variations.of(options.scatter or {})
    if not fit:
        raise InvalidInputError("nothing to fit: give --fit KEY=FROM:TO")
    if options.experiment is not None:
        experiment = Path(options.experiment)
        load_table(experiment)  # so that its mistakes are reported of the option
        document = document.with_values({TABLE: input_files.user_value(TABLE, str(experiment.absolute()))})
    fits = plans.build_distributions(document, fit, FIT, MODE)
    scattered = plans.distributions_of(document, scatter, SCATTER, MODE)
    bare = document.without_sweep()
    model = Model(bare)
    base = model.scenario
    if base.experiment is None:
        how = "give a table with --experiment"
        raise InputMissingError(f"{document.source.where}: the scenario names no experiment; {how}")
    check_experiment(model)
    _refuse_unfit(fits, scattered, fit, scatter)
    if scattered is None and options.members > 1:
        raise InvalidInputError(NO_SCATTER)
    ends = {key: table["from"] if isinstance(table, Mapping) else None for key, table in fit.items()}
    priors = [prior_of(key, one, ends[key]) for key, one in fits.vary.items() if isinstance(one, Uniform)]
    table = load_table(base.experiment.table)
    return CalibrationPlan(
        document, bare, base, tuple(priors), scattered, table, ranges_of(table), options.members, options.seed
    )


def _refuse_unfit(fits: Sweep, scattered: Sweep | None, fit: plans.Variations, scatter: plans.Variations) -> None:
    """Refuse priors that are no ranges, keys inside one another, and scatter that cannot be moved to a fitted value."""
    problems = []
    for key, values in fits.vary.items():
        where = f"{FIT} {fit.texts[key]}"
        if not isinstance(values, Uniform):
            problems.append(Problem(where, "a prior is a range: write KEY=FROM:TO"))
        problems += [
            Problem(where, f"this is part of {other}, or contains it, which is fitted too")
            for other in _related(key, fits.vary)
        ]
    fitted = {overrides.parse_key(key): values for key, values in fits.vary.items()}
    for key, values in scattered.vary.items() if scattered is not None else ():
        where = f"{SCATTER} {scatter.texts[key]}" if key in scatter.texts else f"[sweep] {key}"
        prior = fitted.get(overrides.parse_key(key))
        if prior is not None and isinstance(values, tuple):
            problems.append(Problem(where, "this key is fitted; its scatter must be a distribution, not a list"))
        elif isinstance(prior, Uniform) and not isinstance(values, tuple) and prior.angle != values.angle:
            problems.append(Problem(where, "prior and scatter of this key have different units; use the same unit"))
        for other in _related(key, fits.vary):
            text = f"this is part of {other}, or contains it, which is fitted; scatter {other} itself"
            problems.append(Problem(where, text))
    if problems:
        raise ScenarioError(list(dict.fromkeys(problems)))


def _related(key: str, others: Iterable[str]) -> list[str]:
    """Return those keys that are part of one, or contain it."""
    one = overrides.parse_key(key)
    return [name for name in others if len(path := overrides.parse_key(name)) != len(one) and all(map(eq, path, one))]


FAILED = 1.0  # the miss of a member that failed
PURPOSE = "calibrate"
FIRST = 16  # trials before the estimator: a power of two, as a Sobol sequence wants it
STUDY = "calibrate"
PLAN = "plan"
BEGINNING = b'{"op_code":0,'  # of a journal of optuna: a study is created
VALUES = "values"
SCORE = "score"


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
    middles = [(0.5 * (one.lower + one.upper), 0.5 * (one.upper - one.lower)) for one in ranges]
    # distances from the middle in half-widths: at most 1 inside
    off = [abs(value - middle) / half for value, (middle, half) in zip(values, middles, strict=True)]
    if all(one.holds(value) for one, value in zip(ranges, values, strict=True)):
        return min(max(off) - 1.0, 0.0)
    # above 0 also where rounding hides by how much
    outside = [
        0.0 if one.holds(value) else max(1.0 - 1.0 / r, 1e-15)
        for one, value, r in zip(ranges, values, off, strict=True)
    ]
    return sum(outside) / len(outside)


Evaluate = Callable[[Mapping[str, object]], Score]


def search(priors: Sequence[Prior], evaluate: Evaluate, study: "Study", *, trials: int, seed: int) -> Iterator[Trial]:
    """Yield every trial up to `trials`, first those that the study has; a new one is in the journal when it comes."""
    optuna, qmc = load_module("optuna", PURPOSE), load_module("scipy.stats.qmc", PURPOSE)
    done = complete_trials(study)
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


def complete_trials(study: "Study") -> list[Trial]:
    """Return the trials of a study that came to an end, in order; one that was cut off is none."""
    state = load_module("optuna", PURPOSE).trial.TrialState.COMPLETE
    with_ends = [trial.user_attrs for trial in study.get_trials(deepcopy=False) if trial.state is state]
    return [
        Trial(number, dict(attributes[VALUES]), Score(*attributes[SCORE]))
        for number, attributes in enumerate(with_ends, start=1)
    ]


@contextmanager
def open_journal(journal: Path, plan: Mapping[str, object]) -> "Iterator[Study]":
    """Give the study of a journal, a new one where there is none, that nobody else writes to meanwhile.

    Raises OutputExistsError where the journal is of another plan or in use, InvalidInputError where the file is none,
    OutputError where it cannot be written.
    """
    if journal.exists():
        refuse_other_file(journal)  # also before a pipe is opened, which would wait
    optuna = load_module("optuna", PURPOSE)
    optuna.logging.set_verbosity(logging.ERROR)
    try:
        with journal.open("ab") as file:
            if not files.takes_lock(file.fileno()):
                where = "wait for it, or choose another file with --out"
                raise OutputExistsError(f"{journal}: another calibration is running here; {where}")
            refuse_other_file(journal)
            content = journal.read_bytes()
            file.truncate(content.rfind(b"\n") + 1)  # without a last line that was torn when the power failed
            storage = load_module("optuna.storages.journal", PURPOSE)
            backend = storage.JournalFileBackend(str(journal), lock_obj=RLock())  # the file is locked as a whole
            try:
                storage = optuna.storages.JournalStorage(backend)
                is_new = STUDY not in optuna.get_all_study_names(storage)
                study = None if is_new else optuna.load_study(study_name=STUDY, storage=storage)
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise InvalidInputError(f"{journal}: not the journal of a calibration: {error}") from None
            if study is None:
                study = optuna.create_study(study_name=STUDY, storage=storage, direction="maximize")
            known = study.user_attrs.get(PLAN)
            if known is None:
                study.set_user_attr(PLAN, dict(plan))
            differing = [name for name, value in plan.items() if known is not None and known.get(name) != value]
            if differing:
                raise OutputExistsError(
                    f"{journal}: holds trials of another calibration ({', '.join(differing)} differ); "
                    "--overwrite starts again, --out FILE writes elsewhere"
                )
            yield study
    except OSError as error:
        raise OutputError(f"{journal}: cannot be written: {error.strerror}") from error


def refuse_other_file(journal: Path) -> None:
    """Raise InvalidInputError for a file that is no journal; one that is empty, or torn, may be."""
    content = input_files.read_head(journal, len(BEGINNING))
    if not BEGINNING.startswith(content):
        raise InvalidInputError(f"{journal}: not the journal of a calibration; choose another file with --out")
