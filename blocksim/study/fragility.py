"""The probability of collapse over an intensity: members drawn at every intensity, counts, and a lognormal curve.

Members run as the cases of a sweep do, on its executors and in shards; what has ended is in the manifests, so a study
that is called again, after a kill too, does only what is missing. What counts as failure is asked of the rows: another
criterion, or fewer members, runs nothing again.

The draws of one intensity are independent of those of all others, and random rather than stratified: only then are the
counts binomial, and independent of one another, as exact limits and the likelihood of a curve assume. With common
draws, or a Latin hypercube, the intervals would be too narrow or too wide. Member i at an intensity is the same
whatever the other intensities are and however many members are drawn.

Stripes are records that all intensities share, each of them equally often at each (multiple stripe analysis; Jalayer,
dissertation, Stanford 2003): member i has record i modulo their number. Curves of these have wider intervals, see
`blocksim.analysis.lognormal`.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, InstanceOf

from blocksim.analysis.compare import interval
from blocksim.analysis.lognormal import PURPOSE, Counts, Curve, NoCurve, fit, inflation_of
from blocksim.errors import ExitCode, InvalidInputError
from blocksim.extras import load_module
from blocksim.options import Option, Overwrite, silent, takes
from blocksim.scenario import Document, Model, Source, Sweep, document_of, overrides
from blocksim.scenario.models.study import Uniform, Variation
from blocksim.simulation import observables, provenance, schemes
from blocksim.study import criterion, executors, limit_plan, manifest, plan as plans, rows, sweep, sweep_folder
from blocksim.study.answer import Answer, Overview, Study, with_unit
from blocksim.view import studies as view, style

INTENSITY, SCATTER, STRIPES, FAILS = "--intensity", "--scatter", "--stripes", "--fails"
COLLAPSE = "outcome = fell"
MEMBERS = 64
MOST_SEED = 2**53
NO_SCATTER = (
    "no scatter: give --scatter KEY=MEAN+-SD (or KEY=FROM:TO, KEY=a,b,c), --stripes KEY=a,b,c, or a [sweep] table with "
    "distributions"
)
MEMBERS_TABLE = "members.csv"
DIGITS = 3
DOUBTFUL = 0.05  # probability of a larger deviance below which counts and curve do not agree
HEADS = ("samples", "failures", "P", "95 % low", "high", "curve", "still moving", "no result")


@dataclass(frozen=True)
class FragilityOptions(executors.Execution):
    """Intensities, what scatters at each of them, what counts as failure, and how members are run and kept."""

    intensity: Annotated[
        Mapping[str, plans.Values],
        plans.variations_option(
            "The key that is the intensity: KEY=a,b,c or KEY=FROM:TO:COUNT (:log at the end spaces them "
            "logarithmically).",
            "KEY=VALUES",
            'One key and its values, {"motion.scale": [0.5, 1.0, 1.5]} or {"from": a, "to": b, "count": n}.',
            INTENSITY,
            is_repeatable=False,
        ),
    ]
    scatter: Annotated[
        Mapping[str, plans.Values] | None,
        plans.variations_option(
            "Quantity to sample: KEY=MEAN+-SD, KEY=FROM:TO or equally likely values, KEY=a,b,c. Repeatable. Default: "
            "the distributions of [sweep].",
            "KEY=MEAN+-SD",
            'The quantities drawn for each sample by itself: {"mean": m, "sd": s}, {"from": a, "to": b} or a list of '
            "equally likely values, such as records (default: the distributions of [sweep]).",
            SCATTER,
        ),
    ] = None
    _: KW_ONLY
    stripes: Annotated[
        Mapping[str, plans.Values] | None,
        plans.variations_option(
            "Records that all intensities share, each once at each of them, such as motion.table=a.csv,b.csv. "
            "Repeatable: keys whose values go together.",
            "KEY=a,b,c",
            'Records, {"motion.table": ["a.csv", "b.csv"]}, of which every intensity has each equally often, by '
            "default once; several keys go together. The curve's intervals are then those of common records.",
            STRIPES,
        ),
    ] = None
    members: Annotated[
        int | None,
        Option(
            f"Samples at every intensity (default: {MEMBERS}, or one of each record of {STRIPES}).",
            ("--samples", "--members"),
            "N",
            least=1,
        ),
    ] = None
    fails: Annotated[
        str | Sequence[str],
        Option(
            'What counts as failure, such as "moved > 50 mm" or "outcome = slid | fell". Separated by '
            f'commas: all must hold; repeated: any one suffices (default: "{COLLAPSE}").',
            metavar="CONDITIONS",
            python='What counts as failure, such as "moved > 50 mm" or "outcome = slid | fell", any of several '
            "(see `blocksim.study.criterion`).",
            is_repeatable=True,
        ),
    ] = COLLAPSE
    seed: Annotated[int, Option("Random seed.", metavar="S", least=0)] = 0
    shard: Annotated[
        manifest.Shard,
        Option(
            "Run only samples I, I + N, ... (job arrays); then once without, for the curve.",
            metavar="I/N",
            read=manifest.Shard.parse,
        ),
    ] = manifest.WHOLE
    retry_failed: Annotated[bool, Option("Rerun samples that did not finish.")] = False
    out: Annotated[
        Path | str | None, Option("Folder to write (default: results/NAME/fragility-HASH).", metavar="DIR")
    ] = None
    overwrite: Overwrite = False
    on_row: sweep.OnRow = silent


@dataclass(frozen=True)
class FragilityPlan:
    """One study: intensities that increase, and what scatters at each of them."""

    document: Document  # without [sweep]
    head: rows.Head  # key and unit of the intensity
    levels: Mapping[float, object]  # value of the key by its number in that unit
    scatter: Sweep | None  # None where there are stripes alone
    members: int  # at every intensity
    seed: int
    fails: tuple[criterion.Criterion, ...]  # any of them
    stripes: Mapping[str, tuple[object, ...]]  # values of a key by record
    records: int  # that the intensities share; 0 where every draw is independent

    @property
    def spread(self) -> Mapping[str, Variation]:
        """Everything that differs between the members of an intensity, by key."""
        return {**self.stripes, **({} if self.scatter is None else self.scatter.vary)}

    @property
    def name(self) -> str:
        """A hash of all that decides a member; neither their number nor what counts as failure does."""
        levels = [self.head.key, *map(str, self.levels.values())]
        scatter = None if self.scatter is None else self.scatter.as_table()
        about = [Model(self.document).hash, levels, scatter, self.seed, provenance.code_hash()]
        if self.stripes:
            about.append({key: list(map(str, values)) for key, values in self.stripes.items()})
        tables = plans.table_digests(self.document, self.spread)
        return manifest.short_hash([*about, tables] if tables else about)

    @cached_property
    def cases(self) -> plans.Cases:
        """All members: the first of every intensity, the second of every intensity, and so on.

        More members come after those that are there. Raises ScenarioError where a distribution gave a value that its
        key cannot have, InvalidInputError where no case can be simulated.
        """
        vary = {} if self.scatter is None else self.scatter.vary
        draws = {key: self._draws(key, values) for key, values in vary.items()}
        shared = {  # all intensities of a member have the same record
            key: tuple(values[member % len(values)] for member in range(self.members) for _ in self.levels)
            for key, values in self.stripes.items()
        }
        design = plans.Design({self.head.key: tuple(self.levels.values()) * self.members, **shared, **draws})
        if self.scatter is not None:
            plans.refuse_wrong_draws(self.document, self.scatter, design)
        striped = Sweep.model_validate({"mode": "list", **design.columns})
        heads = {
            head.key: head for head in (*rows.heads_of(striped), *(rows.heads_of(self.scatter) if self.scatter else ()))
        }
        cases = plans.cases_of(self.document, striped)
        return replace(cases, heads=(self.head, *(heads[key] for key in self.spread)))

    def _draws(self, key: str, values: Variation) -> tuple[object, ...]:
        """Return the values of a key in the order of the cases."""
        is_whole = limit_plan.takes_whole(self.document, key) and not isinstance(values, tuple)
        if is_whole and isinstance(values, Uniform):
            values = replace(values, low=values.low - 0.5, high=values.high + 0.5)  # so that its ends are as likely
        by_level = []
        for number in self.levels:
            level = with_unit(number, self.head.unit, 6)
            names = (overrides.format_key(overrides.parse_key(one)) for one in (key, self.head.key))
            name = f"{' where '.join(names)} = {level}"
            places = plans.open_interval(plans.generator(self.seed, name).random(self.members))
            by_level.append(plans.draw_values(values, places))
        together = [value for member in zip(*by_level, strict=True) for value in member]
        return tuple(round(rows.si_number(value)) for value in together) if is_whole else tuple(together)


@takes(FragilityOptions)
def read_fragility(document: Document, options: FragilityOptions) -> FragilityPlan:
    """Return the plan of a study; without `scatter`, the [sweep] table of the scenario counts if it has distributions.

    `members` is their number at every intensity (default: 64, or one a record of `stripes`). Raises ScenarioError for
    keys and values that the scenario cannot have, InvalidInputError for a wrong criterion, anything but one intensity,
    nothing that scatters, stripes that are not all equally often there, and too many members.
    """
    fails, seed = options.fails, options.seed
    criteria = tuple(criterion.read_criterion(text, FAILS) for text in ([fails] if isinstance(fails, str) else fails))
    bare = document.without_sweep()
    given = plans.Variations.of(options.intensity)
    if len(given) != 1:
        message = f"one key is the intensity, not {len(given)}: give {INTENSITY} KEY=a,b,c or KEY=FROM:TO:COUNT once"
        raise InvalidInputError(message)
    head, levels = limit_plan.numeric_levels(bare, given, INTENSITY)
    wrong = [value for number, value in levels.items() if number <= 0.0]
    if wrong:
        message = f"{INTENSITY} {given.texts[head.key]}: {wrong[0]} is not above 0, as a lognormal curve needs"
        raise InvalidInputError(message)
    shared = _stripes(bare, plans.Variations.of(options.stripes or {}))
    records = len(next(iter(shared.values()), ()))
    members = (records or MEMBERS) if options.members is None else options.members
    if members < 1 or members * len(levels) > plans.MOST_CASES or not 0 <= seed <= MOST_SEED:
        raise InvalidInputError(
            f"{members} samples at {len(levels)} intensities with seed {seed}: "
            f"1 to {plans.MOST_CASES} runs are possible"
        )
    if records and members % records:
        raise InvalidInputError(
            f"{members} samples of {records} records: each must be there equally often; give a multiple of {records}"
        )
    spread = _scatter(document, plans.Variations.of(options.scatter or {}), needed=not shared)
    keys = [overrides.parse_key(key) for key in (head.key, *shared, *(spread.vary if spread is not None else ()))]
    twice = next((key for i, key in enumerate(keys) if key in keys[:i]), None)
    if twice == keys[0]:
        raise InvalidInputError(f"{head.key} is the intensity; it cannot scatter too")
    if twice is not None:
        raise InvalidInputError(f"{overrides.format_key(twice)} is given as stripes; it cannot be drawn too")
    return FragilityPlan(bare, head, levels, spread, members, seed, criteria, shared, records)


def _stripes(document: Document, given: plans.Variations) -> dict[str, tuple[object, ...]]:
    """Return the values of each key by record."""
    if not given:
        return {}
    shared = {
        key: plans.levels_of(values)
        for key, values in plans.build_distributions(document, given, STRIPES, "list").vary.items()
    }
    for key, values in shared.items():
        if len(set(map(str, values))) < len(values) or len(values) == 1:
            why = "one record does not scatter; set it with --set" if len(values) == 1 else "a record is given twice"
            raise InvalidInputError(f"{STRIPES} {given.texts[key]}: {why}")
    return shared


def _scatter(document: Document, given: plans.Variations, *, needed: bool) -> Sweep | None:
    spread = plans.distributions_of(document, given, SCATTER, "normal")
    if spread is None and needed:
        raise InvalidInputError(NO_SCATTER)
    for key, values in spread.vary.items() if spread is not None and given else ():
        if len(set(map(str, plans.levels_of(values)))) == 1:
            raise InvalidInputError(f"{SCATTER} {given.texts[key]}: one value does not scatter; set it with --set")
    return spread


class Point(BaseModel, frozen=True):
    """One intensity: members with a result, those that failed, and the curve there; None where there is none."""

    intensity: float = Field(gt=0.0, lt=1e300)
    members: int = Field(ge=0)
    failures: int = Field(ge=0)
    share: float | None  # of failures
    low: float  # 95 % limits of the probability after Clopper and Pearson, whatever other intensities came to
    high: float
    curve: float | None
    curve_low: float | None
    curve_high: float | None
    moving_on: int = Field(ge=0)  # of those that have not failed: their runs end while blocks move
    no_result: int = Field(ge=0)  # members whose runs did not finish; they count nowhere else


class FragilityAnswer(Answer, frozen=True):
    """Counts at every intensity, and the curve through them."""

    files: ClassVar[sweep_folder.FolderKind] = sweep_folder.FolderKind(
        "fragility",
        "a fragility study",
        "fragility",
        {
            rf"members{sweep_folder.SHARD}\.csv": r"case,(?:.*,)?status,reason,seconds(?:,.*)?",
            r"fragility\.csv": r"intensity(?: \[[^\[\]]*\])?,members,failures,.*",
        },
    )
    picture: ClassVar[str] = "fragility"
    caption: ClassVar[str] = "Failures over the intensity"
    key: str
    unit: str
    fails: str
    members: int
    seed: int
    scatter: dict[str, Any]
    records: int = 0  # that intensities share
    points: tuple[Point, ...]
    missing: int  # members that have not run: those of other shards
    fitted: dict[str, Any] = Field(alias="curve")
    inflation: float | None = Field(default=None, ge=1.0, lt=1e6)  # of variance: intensities share their records
    plan: InstanceOf[FragilityPlan] | None = Field(default=None, exclude=True, repr=False)

    @cached_property
    def curve(self) -> Curve | NoCurve:
        """The curve that is most likely, or why there is none."""
        points = [one for one in self.points if one.failures <= one.members]
        counts = Counts.of(*zip(*((one.intensity, one.failures, one.members) for one in points), strict=True))
        return fit(counts, inflation=self.inflation)

    @property
    def failed(self) -> int:
        """How many runs did not finish."""
        return sum(point.no_result for point in self.points)

    def probability(self, intensity: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return the curve at intensities in the unit of the study, None where there is no curve."""
        return self.curve.probability(intensity) if isinstance(self.curve, Curve) else None

    def overview(self) -> Overview:
        """Return the counts of every intensity, the curve beside and below them; columns without news are left out.

        The code is 77 where runs did not finish, 1 without a curve, unless that of a shard.
        """
        rows: list[list[str | float]] = []
        for one in self.points:
            shares = (math.nan if share is None else share for share in (one.share, one.low, one.high, one.curve))
            counts = (f"{one.intensity:.6g}", str(one.members), str(one.failures))
            rows.append([*counts, *shares, str(one.moving_on), str(one.no_result)])
        heads = (self.unit or "value", *HEADS)
        places = [i for i in range(len(heads)) if i < len(heads) - 2 or any(row[i] != "0" for row in rows)]
        code = ExitCode.SUCCESS if isinstance(self.curve, Curve) or self.missing else ExitCode.OUTSIDE
        notes, moving = [], sum(one.moving_on for one in self.points)
        if moving:
            notes.append(f"{moving} surviving samples were still moving at the end; increase time.end to decide them")
        if isinstance(self.curve, Curve) and self.fitted.get("median_extrapolated"):
            x = [one.intensity for one in self.points if one.members]
            side, end = ("above", max(x)) if self.curve.median > max(x) else ("below", min(x))
            notes.append(
                f"warning: the median lies {side} {with_unit(end, self.unit, 6)}, beyond all intensities that were run"
            )
        if self.failed:
            which = f"{self.failed} samples have no result, see {MEMBERS_TABLE}"
            notes.append(f"{which}; they count neither as failures nor as survivors")
        if self.missing:
            notes.append(f"{self.missing} samples have not run; after all shards, rerun without --shard")
        runs = sum(one.members + one.no_result for one in self.points)
        notes.append(f"{runs} runs, {self.run} of them now: {self.folder}")
        samples = str(sum(one.members for one in self.points))
        return Overview(
            f'{self.key}: failure means "{self.fails}"',
            [heads[i] for i in places],
            [[row[i] for i in places] for row in rows],
            left=0,
            digits=DIGITS,
            lines=self._lines(),
            notes=notes,
            summary=[("intensity", self.key), ("failure", self.fails), ("samples", samples)],
            code=ExitCode.SWEEP_HAS_FAILURES if self.failed else code,
        )

    def _lines(self) -> list[str]:
        """Return the curve in words, or why there is none and what the counts still say of the median."""
        curve = self.curve
        if isinstance(curve, NoCurve):
            low, high = (with_unit(end, self.unit, 6) for end in (curve.low, curve.high))
            lines = [f"no curve: {curve.reason}"]
            if curve.low > 0.0 and math.isfinite(curve.high):
                where = f"between {low} and {high}" if curve.low < curve.high else f"near {low}"
                lines.append(f"the median lies {where}; intensities there would show the curve")
            elif curve.low > 0.0:
                lines.append(f"the median lies above {low}; larger intensities would show the curve")
            elif math.isfinite(curve.high):
                lines.append(f"the median lies below {high}; smaller intensities would show the curve")
            return lines
        lines = [
            f"median      {with_unit(curve.median, self.unit, 6)}, 95 % {_span(curve.median_interval, self.unit)}",
            f"dispersion  {curve.dispersion:.4g}, 95 % {_span(curve.dispersion_interval)}",
        ]
        if curve.freedom > 0 and math.isfinite(curve.fits):
            agrees = "" if curve.fits >= DOUBTFUL else ": counts and curve do not agree"
            lines.append(
                f"deviance    {curve.deviance:.3g}, degrees of freedom {curve.freedom}, p = {curve.fits:.2g}{agrees}"
            )
        if self.inflation is not None:
            wider = f"{self.inflation**0.5:.3g} times as wide as those of independent draws"
            lines.append(f"intervals   {wider}: {self.records} records shared")
        return lines

    def picture_of(self) -> view.Fragility:
        """Return counts and curve as they are drawn. Raises InvalidInputError where there are none."""
        points = [one for one in self.points if one.members and one.failures <= one.members]
        if not points:
            raise InvalidInputError(f"{self.folder}: no sample of this study has a result; nothing to draw")
        x, share, low, high = np.array([(one.intensity, one.share, one.low, one.high) for one in points], dtype=float).T
        at, curve = view.places(x), self.curve
        note, band = f"Failure: {self.fails}", None
        if isinstance(curve, Curve):
            band = view.Band(at, curve.probability(at), *curve.band(at))
            (least, most), (narrow, wide) = curve.median_interval, curve.dispersion_interval
            unit = f" {self.unit}" if self.unit else ""
            median = f"median {curve.median:.4g}{unit} [{least:.4g}, {most:.4g}]"
            note += f"; {median}, dispersion {curve.dispersion:.3g} [{narrow:.3g}, {wide:.3g}]"
        else:
            note += f"; no curve: {curve.reason}"
        return view.Fragility(self.key, self.unit, x, share, low, high, band, notes=(f"{note}.",))

    def draw(self, path: Path, title: str, paper: style.Paper) -> None:
        """Draw counts and curve."""
        view.draw_fragility(self.picture_of(), path, title, paper)


def _span(ends: tuple[float, float], unit: str = "") -> str:
    low, high = ends
    if not math.isfinite(high):
        return f"from {low:.5g} {unit}".rstrip() + ", open above" if low else "open: the counts do not bound it"
    return (f"{low:.5g} to {high:.5g} {unit}" if low else f"up to {high:.5g} {unit}").rstrip()


@takes(FragilityOptions)
def fragility(scenario: Source, options: FragilityOptions) -> FragilityAnswer:
    """Return how probable failure is at each intensity, and the lognormal curve that is most likely.

    Samples are drawn independently at every intensity, so that limits and intervals hold. Runs are kept; the same call,
    also one with more samples, does only what is missing. After all shards the call without one makes the curve.
    `on_row` is called with every row, and how many there are. Raises ScenarioError, InvalidInputError,
    OutputExistsError where the folder is not free, UnavailableError without scipy, StoppedEarlyError on
    Ctrl-C.

    >>> scatter = {"contact.restitution.block_block": {"from": 0.1, "to": 0.3}}
    >>> blocks, levels = "scenarios/three_blocks_nonsmooth.toml", {"friction.block_block": [0.2, 0.3]}
    >>> [one.failures for one in fragility(blocks, levels, scatter, members=4, out="results/fragility").points]
    [4, 4]
    """
    return run_fragility(read_fragility(document_of(scenario), options), options)


def run_fragility(
    plan: FragilityPlan, options: FragilityOptions, execution: executors.Execution | None = None
) -> FragilityAnswer:
    """Run what is planned, with the executor of the options unless there is another; see `fragility`."""
    load_module("scipy.special", PURPOSE)
    shard, execution = options.shard, execution or options
    sweep.refuse_loss(shard, overwrite=options.overwrite)
    rounds, setting = execution.ready()
    base = Model(plan.document)
    cases, kind = plan.cases, FragilityAnswer.files
    folder = sweep.make_folder(options.out, base, kind, plan.name, overwrite=options.overwrite)
    schemes.compile_kernels(schemes.kernels_of(base.scenario))
    with closing(manifest.Manifest(folder / shard.file(manifest.MANIFEST), "fragility study")) as kept, rounds() as run:
        share = sweep.SweepRun(cases, shard, kept, options.on_row, kind=kind, table=MEMBERS_TABLE)
        share.run(run, setting, retry_failed=options.retry_failed)
        answer = _answer(plan, folder, share)
        if shard == manifest.WHOLE:
            answer.write()
    return answer


def _answer(plan: FragilityPlan, folder: Path, share: sweep.SweepRun) -> FragilityAnswer:
    """Make the answer of all rows that there are."""
    numbers = list(plan.levels)
    ends: dict[float, dict[int, rows.Row]] = {number: {} for number in numbers}  # by intensity and number of the member
    for case, _, entry in share.done.entries(share.cases):
        ends[numbers[case % len(numbers)]][case // len(numbers)] = entry.row
    failed = {  # members with a result, and whether they have failed
        number: {
            member: criterion.falls_before_zero(row) or any(one.holds(row) for one in plan.fails)
            for member, row in found.items()
            if row["status"] == rows.FINISHED or criterion.falls_before_zero(row)
        }
        for number, found in ends.items()
    }
    counts = Counts.of(numbers, [sum(one.values()) for one in failed.values()], [len(one) for one in failed.values()])
    inflation = None
    if plan.records:
        kept = [found for found in failed.values() if found]
        by_record = np.zeros((2, plan.records, len(kept)))  # failures and members at the intensities that have any
        for place, members_there in enumerate(kept):
            for member, fails in members_there.items():
                by_record[:, member % plan.records, place] += fails, 1.0
        inflation = inflation_of(counts, *by_record)
    curve = fit(counts, inflation=inflation)
    at, low, high = [np.full(len(numbers), np.nan)] * 3
    if isinstance(curve, Curve):
        at, (low, high) = curve.probability(np.array(numbers)), curve.band(np.array(numbers))
    points = []
    for i, (number, found) in enumerate(ends.items()):
        ended = failed[number]
        failures, members = sum(ended.values()), len(ended)
        limits = interval(failures, members)
        moving = sum(bool(found[member].get(observables.MOVES_ON)) for member, fails in ended.items() if not fails)
        points.append(
            Point(
                intensity=number,
                members=members,
                failures=failures,
                share=failures / members if members else None,
                low=limits[0],
                high=limits[1],
                curve=_finite(at[i]),
                curve_low=_finite(low[i]),
                curve_high=_finite(high[i]),
                moving_on=moving,
                no_result=len(found) - members,
            )
        )
    ran = [point.intensity for point in points if point.members]
    is_beyond = isinstance(curve, Curve) and not min(ran) <= curve.median <= max(ran)
    table = {} if plan.scatter is None else plan.scatter.as_table()
    return FragilityAnswer.model_validate(
        {
            "key": plan.head.key,
            "unit": plan.head.unit,
            "fails": " or ".join(one.text.strip() for one in plan.fails),
            "members": plan.members,
            "seed": plan.seed,
            "scatter": {key: list(plan.stripes[key]) if key in plan.stripes else table[key] for key in plan.spread},
            "records": plan.records,
            "points": points,
            "missing": len(plan.cases) - share.done.count(),
            "curve": {**_described(curve), "median_extrapolated": is_beyond},
            "inflation": inflation,
            "folder": folder,
            "run": share.new,
            "heads": (str(rows.Head("intensity", plan.head.unit)), *list(Point.model_fields)[1:]),
            "cells": [list(dict(point).values()) for point in points],
            "plan": plan,
        }
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _described(curve: Curve | NoCurve) -> dict[str, object]:
    """Return a curve for JSON; ends of intervals that are open are None."""
    if isinstance(curve, NoCurve):
        return {"reason": curve.reason, "median_interval": [curve.low or None, _finite(curve.high)]}
    return {
        "median": curve.median,
        "median_interval": [curve.median_interval[0] or None, _finite(curve.median_interval[1])],
        "dispersion": curve.dispersion,
        "dispersion_interval": [curve.dispersion_interval[0] or None, _finite(curve.dispersion_interval[1])],
        "confidence": curve.confidence,
        "deviance": curve.deviance,
        "degrees_of_freedom": curve.freedom,
        "fits": _finite(curve.fits),
    }


def repeat_fragility(answer: FragilityAnswer, execution: sweep.Replay, out: Path) -> FragilityAnswer:
    """Draw and count the members again."""
    spread, stripes = dict(answer.scatter), {}
    for key, values in answer.scatter.items():  # stripes come first
        if not isinstance(values, list) or len(values) != answer.records:
            break
        stripes[key] = spread.pop(key)
    intensities = [f"{one.intensity!r} {answer.unit}" if answer.unit else one.intensity for one in answer.points]
    options = FragilityOptions(
        {answer.key: intensities},
        spread,
        stripes=stripes,
        members=answer.members,
        fails=answer.fails.split(" or "),
        seed=answer.seed,
        out=out,
    )
    plan = read_fragility(Document.read(answer.folder / answer.files.plan, is_stored=True), options)
    return run_fragility(plan, options, execution)


FRAGILITY = Study(FragilityAnswer, repeat_fragility, is_design=True)
