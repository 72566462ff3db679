"""What a calibration is asked for, checked before anything runs."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InputMissingError, InvalidInputError, Problem, ScenarioError
from blocksim.scenario import Document, Scenario, Sweep, scenario_hash
from blocksim.scenario.keys import parse_key
from blocksim.scenario.models.variation import Uniform
from blocksim.scenario.reach import said_by_hand
from blocksim.simulation.atomic import sha256_of
from blocksim.simulation.provenance import code_hash
from blocksim.study.calibrate.prior import Prior, prior_of
from blocksim.study.calibrate.scatter import Scatter
from blocksim.study.single import check_experiment
from blocksim.study.targets import Range, ranges_of
from blocksim.study.variation import Variations, varied

FIT, SCATTER = "--fit", "--scatter"
MODE = "sobol"
TABLE = "experiment.table"
NO_FIT = "nothing to fit: give --fit KEY=FROM:TO"
NO_SCATTER = (
    "no input scatter: give --scatter KEY=MEAN+-SD (or KEY=FROM:TO), or a [sweep] table with distributions; "
    "--members 1 fits a single run, whose agreement may be luck"
)


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
        """Return all that decides a trial, to return whether trials in a journal belong to this plan."""
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
    scattered = _scattered(document, scatter)
    bare = replace(document, data={key: value for key, value in document.data.items() if key != "sweep"})
    base = bare.build()
    if base.experiment is None:
        message = f"{document.source.where}: the scenario names no experiment; give a table with --experiment"
        raise InputMissingError(message)
    check_experiment(base)
    _refuse_unfit(fits, scattered, fit, scatter)
    if scattered is None and members > 1:
        raise InvalidInputError(NO_SCATTER)
    priors = tuple(_prior(key, values, fit) for key, values in fits.vary.items())
    return Plan(document, bare, base, priors, Scatter(scattered), load_table(base.experiment.table), members, seed)


def _prior(key: str, values: object, fit: Variations) -> Prior:
    assert isinstance(values, Uniform)  # noqa: S101 - all others have been refused
    table = fit.tables[key]
    return prior_of(key, values, table["from"] if isinstance(table, Mapping) else None)


def _scattered(document: Document, scatter: Variations | None) -> Sweep | None:
    if scatter is not None and scatter.tables:
        return varied(document, scatter, SCATTER, MODE)
    own = document.build().sweep
    return own if own is not None and own.is_sampled else None


def _refuse_unfit(fits: Sweep, scattered: Sweep | None, fit: Variations, scatter: Variations | None) -> None:
    """Refuse priors that are no ranges, keys inside one another, and scatter that cannot be moved to a fitted value."""
    problems = [
        Problem(f"{FIT} {fit.texts[key]}", "a prior is a range: write KEY=FROM:TO")
        for key, values in fits.vary.items()
        if not isinstance(values, Uniform)
    ]
    problems += [_inside(key, other, fit) for key, other in _nested(fits.vary, fits.vary)]
    if scattered is not None:
        texts = scatter.texts if scatter is not None and scatter.tables else {}
        problems += _unfit_scatter(fits, scattered, texts)
    if problems:
        raise ScenarioError(list(dict.fromkeys(problems)))


def _unfit_scatter(fits: Sweep, scattered: Sweep, texts: Mapping[str, str]) -> Iterable[Problem]:
    parsed = {parse_key(key): key for key in fits.vary}
    for key, values in scattered.vary.items():
        where = f"{SCATTER} {texts[key]}" if key in texts else f"[sweep] {key}"
        fitted = fits.vary.get(parsed.get(parse_key(key), ""))
        if fitted is not None and isinstance(values, tuple):
            yield Problem(where, "this key is fitted; its scatter has to be a distribution, not a list")
        elif isinstance(fitted, Uniform) and not isinstance(values, tuple) and fitted.angle != values.angle:
            yield Problem(where, "this key is fitted within a prior of another unit; write both in the same unit")
    for key, other in _nested(scattered.vary, fits.vary):
        where = f"{SCATTER} {texts[key]}" if key in texts else f"[sweep] {key}"
        yield Problem(where, f"this lies inside or around {other}, which is fitted; scatter {other} itself")


def _nested(keys: Iterable[str], others: Sequence[str] | Mapping[str, object]) -> list[tuple[str, str]]:
    """Return pairs of which one is a table that the other is a part of."""
    pairs = [(key, other, parse_key(key), parse_key(other)) for key in keys for other in others]
    return [
        (key, other)
        for key, other, one, two in pairs
        if len(one) != len(two) and one[: min(len(one), len(two))] == two[: min(len(one), len(two))]
    ]


def _inside(key: str, other: str, fit: Variations) -> Problem:
    return Problem(f"{FIT} {fit.texts[key]}", f"this lies inside or around {other}, which is fitted too")
