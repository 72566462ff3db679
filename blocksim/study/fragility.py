"""The probability of collapse over an intensity: members drawn at every intensity, counts, and a lognormal curve.

Members run as the cases of a sweep do, on its executors and in shards; what has ended is in the manifests, so a study
that is called again, after a kill too, does only what is missing. What counts as failure is asked of the rows: another
criterion, or fewer members, runs nothing again.
"""

import math
from collections.abc import Mapping
from contextlib import closing
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field, InstanceOf

from blocksim.analysis.compare import interval
from blocksim.analysis.lognormal import PURPOSE, Counts, Curve, NoCurve, fit, inflation_of
from blocksim.errors import ExitCode, InvalidInputError
from blocksim.extras import load_module
from blocksim.options import takes
from blocksim.scenario import Document, Source, document_of
from blocksim.simulation import observables, schemes
from blocksim.study import criterion, fragility_plan, manifest, sweep, sweep_folder
from blocksim.study.answer import Answer, Overview, Study, with_unit
from blocksim.study.executors import Execution
from blocksim.study.rows import FINISHED, Head, Row
from blocksim.study.runs import Replay, make_folder
from blocksim.view import studies as view
from blocksim.view.style import Paper

if TYPE_CHECKING:
    from numpy.typing import NDArray

MEMBERS_TABLE = "members.csv"
DIGITS = 3
DOUBTFUL = 0.05  # probability of a larger deviance below which counts and curve do not agree
HEADS = ("samples", "failures", "P", "95 % low", "high", "curve", "still moving", "no result")


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
    left: int = Field(alias="missing")  # members that have not run: those of other shards
    fitted: dict[str, Any] = Field(alias="curve")
    inflation: float | None = Field(default=None, ge=1.0, lt=1e6)  # of variance: intensities share their records
    plan: InstanceOf[fragility_plan.FragilityPlan] | None = Field(default=None, exclude=True, repr=False)

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

    def probability(self, intensity: "NDArray[np.float64]") -> "NDArray[np.float64] | None":
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
        code = ExitCode.SUCCESS if isinstance(self.curve, Curve) or self.left else ExitCode.OUTSIDE
        samples = str(sum(one.members for one in self.points))
        return Overview(
            f'{self.key}: failure means "{self.fails}"',
            [heads[i] for i in places],
            [[row[i] for i in places] for row in rows],
            left=0,
            digits=DIGITS,
            lines=self._lines(),
            notes=self._notes(),
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

    def _notes(self) -> list[str]:
        """Say what is undecided or missing, and where the runs are."""
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
        if self.left:
            notes.append(f"{self.left} samples have not run; after all shards, rerun without --shard")
        runs = sum(one.members + one.no_result for one in self.points)
        return [*notes, f"{runs} runs, {self.run} of them now: {self.folder}"]

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

    def draw(self, path: Path, title: str, paper: Paper) -> None:
        """Draw counts and curve."""
        view.draw_fragility(self.picture_of(), path, title, paper)


def _span(ends: tuple[float, float], unit: str = "") -> str:
    low, high = ends
    if not math.isfinite(high):
        return f"from {low:.5g} {unit}".rstrip() + ", open above" if low else "open: the counts do not bound it"
    return (f"{low:.5g} to {high:.5g} {unit}" if low else f"up to {high:.5g} {unit}").rstrip()


@takes(fragility_plan.FragilityOptions)
def fragility(scenario: Source, options: fragility_plan.FragilityOptions) -> FragilityAnswer:
    """Return how probable failure is at each intensity, and the lognormal curve that is most likely.

    Samples are drawn independently at every intensity, so that limits and intervals hold. Runs are kept; the same call,
    also one with more samples, does only what is missing. After all shards the call without one makes the curve.
    `on_row` is called with every row, and how many there are. Raises ScenarioError, InvalidInputError,
    OutputExistsError where the folder is not free, UnavailableError without scipy (extra `study`), StoppedEarlyError on
    Ctrl-C.
    """
    return run_fragility(fragility_plan.read_fragility(document_of(scenario), options), options)


def run_fragility(
    plan: fragility_plan.FragilityPlan, options: fragility_plan.FragilityOptions, execution: Execution | None = None
) -> FragilityAnswer:
    """Run what is planned, with the executor of the options unless there is another; see `fragility`."""
    load_module("scipy.special", PURPOSE)
    shard, execution = options.shard, execution or options
    sweep.refuse_loss(shard, overwrite=options.overwrite)
    run, setting = execution.ready()
    base = plan.document.build()
    cases, kind = plan.cases, FragilityAnswer.files
    folder = make_folder(options.out, base, kind, plan.name, overwrite=options.overwrite)
    schemes.compile_kernels(schemes.kernels_of(base))
    with closing(manifest.Manifest(folder / shard.file(manifest.MANIFEST), "fragility study")) as kept:
        share = sweep.SweepRun(cases, shard, kept, options.on_row, kind=kind, table=MEMBERS_TABLE)
        if options.retry_failed:
            share.forget_failed()
        share.run(run, setting)
        answer = _answer(plan, folder, share)
        if shard == manifest.WHOLE:
            answer.write()
    return answer


def _answer(plan: fragility_plan.FragilityPlan, folder: Path, share: sweep.SweepRun) -> FragilityAnswer:
    """Make the answer of all rows that there are."""
    numbers = list(plan.levels)
    rows: dict[float, dict[int, Row]] = {number: {} for number in numbers}  # by intensity and number of the member
    for case, _, entry in share.done.entries(share.cases):
        rows[numbers[case % len(numbers)]][case // len(numbers)] = entry.row
    failed = {  # members with a result, and whether they have failed
        number: {
            member: criterion.falls_before_zero(row) or any(one.holds(row) for one in plan.fails)
            for member, row in found.items()
            if row["status"] == FINISHED or criterion.falls_before_zero(row)
        }
        for number, found in rows.items()
    }
    counts = Counts.of(numbers, [sum(one.values()) for one in failed.values()], [len(one) for one in failed.values()])
    inflation = inflation_of(counts, *_by_record(plan.records, failed)) if plan.records else None
    curve = fit(counts, inflation=inflation)
    at, low, high = [np.full(len(numbers), np.nan)] * 3
    if isinstance(curve, Curve):
        at, (low, high) = curve.probability(np.array(numbers)), curve.band(np.array(numbers))
    points = []
    for i, (number, found) in enumerate(rows.items()):
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
            "heads": (str(Head("intensity", plan.head.unit)), *list(Point.model_fields)[1:]),
            "cells": [list(dict(point).values()) for point in points],
            "plan": plan,
        }
    )


def _by_record(
    records: int, failed: Mapping[float, Mapping[int, bool]]
) -> tuple["NDArray[np.float64]", "NDArray[np.float64]"]:
    """Return failures and members by record, shape (records, intensities that have any)."""
    kept = [found for found in failed.values() if found]
    failures, members = np.zeros((records, len(kept))), np.zeros((records, len(kept)))
    for place, found in enumerate(kept):
        for member, fails in found.items():
            members[member % records, place] += 1.0
            failures[member % records, place] += fails
    return failures, members


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


def repeat_fragility(answer: FragilityAnswer, execution: Replay, out: Path) -> FragilityAnswer:
    """Draw and count the members again."""
    spread, stripes = dict(answer.scatter), {}
    for key, values in answer.scatter.items():  # stripes come first
        if not isinstance(values, list) or len(values) != answer.records:
            break
        stripes[key] = spread.pop(key)
    intensities = [f"{one.intensity!r} {answer.unit}" if answer.unit else one.intensity for one in answer.points]
    options = fragility_plan.FragilityOptions(
        {answer.key: intensities},
        spread,
        stripes=stripes,
        members=answer.members,
        fails=answer.fails.split(" or "),
        seed=answer.seed,
        out=out,
    )
    plan = fragility_plan.read_fragility(Document.read(answer.folder / answer.files.plan, is_stored=True), options)
    return run_fragility(plan, options, execution)


FRAGILITY = Study(FragilityAnswer, repeat_fragility, is_design=True)
