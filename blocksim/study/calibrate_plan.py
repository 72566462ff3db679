"""What a calibration is asked for, checked before anything runs: priors of what is fitted, and scatter of inputs."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil, exp, log, log10, sqrt
from operator import eq
from pathlib import Path

from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InputMissingError, InvalidInputError, Problem, ScenarioError
from blocksim.scenario import Document, Scenario, Sweep, scenario_hash
from blocksim.scenario import quantities as q
from blocksim.scenario.keys import parse_key
from blocksim.scenario.models.variation import Uniform, Variation, written
from blocksim.scenario.path_policy import said_by_hand
from blocksim.scenario.units import parse_unit
from blocksim.simulation.atomic import sha256_of
from blocksim.simulation.provenance import code_hash
from blocksim.study.plan import Variations, varied
from blocksim.study.rows import Range, check_experiment, ranges_of, si_number
from blocksim.study.sampling import design_of

STEPS = 1000  # as fine as this part of the prior are the values that are tried
AT_BOUND = 0.01  # of the prior's width: nearer to a bound, a value is reported to lie at it
SAME = "sobol"  # the same points for every trial: trials differ by their values only
FRESH = "normal"  # independent draws, from streams of their own
FIT, SCATTER = "--fit", "--scatter"
MODE = "sobol"
TABLE = "experiment.table"
NO_FIT = "nothing to fit: give --fit KEY=FROM:TO"
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

    def __str__(self) -> str:
        """Write the whole range."""
        return self.range_of(self.low, self.high)


def prior_of(key: str, table: Uniform, written: object) -> Prior:
    """Return the prior that a distribution says; `written` is its lower end as the user wrote it, for the unit."""
    unit = q.unit_in(written) if isinstance(written, str) else ""
    if not unit:
        return Prior(key, table.low, table.high, "rad" if table.angle else "", table.scale == "log")
    factor = float(parse_unit(unit).factor)
    low, high = (float(f"{end / factor:.12g}") for end in (table.low, table.high))
    return Prior(key, low, high, unit, table.scale == "log")


@dataclass(frozen=True)
class Scatter:
    """Distributions of scenario keys; `plan` is None where nothing scatters."""

    plan: Sweep | None

    def members(self, fitted: Mapping[str, object], count: int, seed: int) -> Iterator[dict[str, object]]:
        """Yield the values of the members of a trial: the same points of the unit cube for every trial."""
        return self._drawn(fitted, SAME, count, seed)

    def fresh_members(self, fitted: Mapping[str, object], count: int, seed: int) -> Iterator[dict[str, object]]:
        """Yield the values of members drawn independently, from random numbers that no trial has seen."""
        return self._drawn(fitted, FRESH, count, seed)

    def _drawn(self, fitted: Mapping[str, object], mode: str, count: int, seed: int) -> Iterator[dict[str, object]]:
        if self.plan is None:
            yield from (dict(fitted) for _ in range(count))
            return
        plan = self.plan.model_copy(update={"mode": mode, "samples": count, "seed": seed})
        names = {parse_key(key): key for key in fitted}
        for row in design_of(plan):
            values = dict(fitted)
            for key, value in row.items():
                name = names.get(parse_key(key), key)
                values[name] = about(plan.vary[key], value, fitted[name]) if name in fitted else value
            yield values

    def described(self) -> dict[str, str]:
        """Return every key with its distribution in words."""
        return {} if self.plan is None else {key: in_words(values) for key, values in self.plan.vary.items()}


def about(distribution: Variation, drawn: object, fitted: object) -> object:
    """Return a drawn value moved so that the distribution lies about the fitted value.

    By the difference to its mean or middle, or by the ratio where its logarithm is evenly distributed.
    """
    assert not isinstance(distribution, tuple)  # noqa: S101 - levels are refused when the plan is read
    number, centre = si_number(drawn), si_number(fitted)
    if isinstance(distribution, Uniform) and distribution.scale == "log":
        moved = number * centre / sqrt(distribution.low * distribution.high)
    elif isinstance(distribution, Uniform):
        moved = number - 0.5 * (distribution.low + distribution.high) + centre
    else:
        moved = number - distribution.mean + centre
    return written(moved, angle=distribution.angle)


def in_words(values: Variation) -> str:
    """Write a distribution for a message or for provenance, in SI."""
    if isinstance(values, tuple):
        return " or ".join(map(str, values))
    table = values.as_table()
    if "mean" in table:
        bounds = f" in {table['from']}-{table['to']}" if {"from", "to"} <= set(table) else ""
        return f"{table['mean']} +- {table['sd']}{bounds}"
    return f"{table['from']} to {table['to']}" + (", log" if "scale" in table else "")


@dataclass(frozen=True)
class Plan:
    """A scenario, what is fitted in it within which priors, the scatter that agreement has to bear, and the table."""

    document: Document  # with settings and experiment table
    bare: Document  # the same without [sweep], which no member needs
    base: Scenario
    priors: tuple[Prior, ...]
    scatter: Scatter
    table: ExperimentTable
    members: int
    seed: int

    @property
    def ranges(self) -> tuple[Range, ...]:
        """The limits that members are judged by."""
        return ranges_of(self.table)

    def fingerprint(self) -> dict[str, object]:
        """Return all that decides a trial: trials in a journal belong to this plan if theirs is the same."""
        return {
            "scenario": scenario_hash(self.base),
            "priors": [str((one.key, one.low, one.high, one.unit, one.log)) for one in self.priors],
            "scatter": None if self.scatter.plan is None else str(self.scatter.plan.as_table()),
            "experiment": sha256_of(Path(self.table.source)),
            "members": self.members,
            "seed": self.seed,
            "code": code_hash(),
        }

    def name(self) -> str:
        """Return a short name that no other plan has."""
        return hashlib.sha256(str(self.fingerprint()).encode()).hexdigest()[:12]


def read_plan(
    document: Document,
    fit: Variations,
    scatter: Variations | None = None,
    *,
    experiment: Path | None = None,
    members: int,
    seed: int,
) -> Plan:
    """Check what is asked for. Without `scatter`, the scenario's own [sweep] table counts where it has distributions.

    Raises ScenarioError for keys, priors and distributions that do not fit, InputMissingError without a table,
    InvalidInputError where the table does not go with the blocks, nothing is fitted, or nothing scatters though there
    is more than one member.
    """
    if not fit.tables:
        raise InvalidInputError(NO_FIT)
    if experiment is not None:
        load_table(experiment)  # so that its mistakes are reported of the option
        document = document.with_values({TABLE: said_by_hand(TABLE, str(experiment.absolute()))})
    fits = varied(document, fit, FIT, MODE)
    if scatter is not None and scatter.tables:
        scattered: Sweep | None = varied(document, scatter, SCATTER, MODE)
    else:
        own = document.build().sweep
        scattered = own if own is not None and own.is_sampled else None
    bare = document.without_sweep()
    base = bare.build()
    if base.experiment is None:
        message = f"{document.source.where}: the scenario names no experiment; give a table with --experiment"
        raise InputMissingError(message)
    check_experiment(base)
    _refuse_unfit(fits, scattered, fit, scatter)
    if scattered is None and members > 1:
        raise InvalidInputError(NO_SCATTER)
    priors = []
    for key, values in fits.vary.items():
        assert isinstance(values, Uniform)  # noqa: S101 - all others have been refused
        table = fit.tables[key]
        priors.append(prior_of(key, values, table["from"] if isinstance(table, Mapping) else None))
    return Plan(
        document, bare, base, tuple(priors), Scatter(scattered), load_table(base.experiment.table), members, seed
    )


def _refuse_unfit(fits: Sweep, scattered: Sweep | None, fit: Variations, scatter: Variations | None) -> None:
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
    fitted = {parse_key(key): values for key, values in fits.vary.items()}
    texts = scatter.texts if scatter is not None and scatter.tables else {}
    for key, values in scattered.vary.items() if scattered is not None else ():
        where = f"{SCATTER} {texts[key]}" if key in texts else f"[sweep] {key}"
        prior = fitted.get(parse_key(key))
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
    one = parse_key(key)
    paths = [(other, parse_key(other)) for other in others]
    return [name for name, path in paths if len(path) != len(one) and all(map(eq, path, one))]
