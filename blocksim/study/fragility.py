"""The probability of collapse over an intensity: members drawn at every intensity, counts, and a lognormal curve.

Members run as the cases of a sweep do, on its executors and in shards; what has ended is in the manifests, so a study
that is called again, after a kill too, does only what is missing. What counts as failure is asked of the rows: another
criterion, or fewer members, runs nothing again.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from blocksim.analysis.lognormal import PURPOSE, Counts, Curve, NoCurve, fit, inflation_of
from blocksim.extras import loaded
from blocksim.scenario import Source, document_of
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.movement import MOVES_ON
from blocksim.study.criterion import falls_before_zero
from blocksim.study.executors import Execution
from blocksim.study.fragility_counts import Point
from blocksim.study.fragility_plan import COLLAPSE, FragilityPlan, read_fragility
from blocksim.study.plan import Values
from blocksim.study.progress import MANIFEST, WHOLE, CaseIndex, Manifest, Shard, Timings
from blocksim.study.rows import FINISHED, Row, check_experiment
from blocksim.study.sweep import TIMINGS, SweepRun, refuse_loss
from blocksim.study.sweep_folder import FRAGILITY, INTENSITY, prepare, write_answer
from blocksim.study.sweep_table import SweepTable

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

MEMBERS_TABLE, TABLE = "members.csv", "fragility.csv"
COLUMNS = ("members", "failures", "share", "low", "high", "curve", "curve_low", "curve_high", "moving_on", "no_result")
OnRow = Callable[[int, int, Row], None]


@dataclass(frozen=True)
class FragilityResult:
    """Counts at every intensity, and the curve through them."""

    plan: FragilityPlan = field(repr=False)
    folder: Path
    points: tuple[Point, ...]
    curve: Curve | NoCurve
    run: int  # members of this call; the others were known
    left: int = 0  # members that have not run: those of other shards
    inflation: float | None = None  # of the curve's variance, as intensities share their records

    @property
    def failed(self) -> int:
        """How many runs did not finish."""
        return sum(point.no_result for point in self.points)

    @property
    def is_extrapolated(self) -> bool:
        """Return True if the median lies beyond all intensities that have been run."""
        x = [point.intensity for point in self.points if point.members]
        return isinstance(self.curve, Curve) and not min(x) <= self.curve.median <= max(x)

    @property
    def table(self) -> "pd.DataFrame":
        """The counts as fragility.csv has them."""
        import pandas as pd

        return pd.DataFrame(list(_records(self)), columns=[_head(self.plan), *COLUMNS])

    def probability(self, intensity: "NDArray[np.float64]") -> "NDArray[np.float64] | None":
        """Return the curve at intensities in the unit of the study, None where there is no curve."""
        return self.curve.probability(intensity) if isinstance(self.curve, Curve) else None

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON; ends of intervals that are open are null."""
        plan = self.plan
        return {
            "key": plan.head.key,
            "unit": plan.head.unit,
            "fails": plan.failure,
            "members": plan.members,
            "seed": plan.seed,
            "scatter": plan.described(),
            "records": plan.records,
            "points": [dict(zip((INTENSITY, *COLUMNS), map(_finite, row), strict=True)) for row in _records(self)],
            "missing": self.left,
            "curve": {**_curve(self.curve), "median_extrapolated": self.is_extrapolated},
            "inflation": self.inflation,
        }

    def __repr__(self) -> str:
        """Return a line: key, median and dispersion, folder."""
        return f"<FragilityResult {self.plan.head.key}: {self.summary}; {self.folder}>"

    @property
    def summary(self) -> str:
        """The curve in words."""
        if isinstance(self.curve, NoCurve):
            return f"no curve, {self.curve.reason}"
        return f"median {self.plan.shown(self.curve.median)}, dispersion {self.curve.dispersion:.4g}"


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _curve(found: Curve | NoCurve) -> dict[str, object]:
    if isinstance(found, NoCurve):
        return {"reason": found.reason, "median_interval": [found.low or None, _finite(found.high)]}
    return {
        "median": found.median,
        "median_interval": [found.median_interval[0] or None, _finite(found.median_interval[1])],
        "dispersion": found.dispersion,
        "dispersion_interval": [found.dispersion_interval[0] or None, _finite(found.dispersion_interval[1])],
        "confidence": found.confidence,
        "deviance": found.deviance,
        "degrees_of_freedom": found.freedom,
        "fits": _finite(found.fits),
    }


def fragility(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    intensity: Mapping[str, Values],
    scatter: Mapping[str, Values] | None = None,
    *,
    stripes: Mapping[str, Values] | None = None,
    members: int | None = None,
    fails: str | Sequence[str] = COLLAPSE,
    seed: int = 0,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    shard: Shard = WHOLE,
    out: Path | str | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    on_row: OnRow = silent,
) -> FragilityResult:
    """Return how probable failure is at each intensity, and the lognormal curve that is most likely.

    `intensity` has one key and its values, {"motion.scale": [0.5, 1.0, 1.5]} or {"from": a, "to": b, "count": n};
    `scatter` the quantities drawn for each sample by itself: {"mean": m, "sd": s}, {"from": a, "to": b} or a list of
    equally likely values, such as records (default: the distributions of [sweep]). `fails` says what counts as failure
    (see `blocksim.study.criterion`), any of several. Samples are drawn independently at every intensity, so that limits
    and intervals hold. `stripes` are records, {"motion.table": ["a.csv", "b.csv"]}, of which every intensity has each
    equally often, by default once; several keys go together. The curve's intervals are then those of common records.

    Runs are kept in `out` (default: results/NAME/fragility-HASH); the same call, also one with more samples, does only
    what is missing. `executor`, `jobs`, `scheduler`, `shard` and `retry_failed` are those of `sweep`; after all shards
    the call without one makes the curve. Raises ScenarioError, InvalidInputError, OutputExistsError where the
    folder is not free, UnavailableError without scipy (extra `study`), StoppedEarlyError on Ctrl-C.
    """
    plan = read_fragility(
        document_of(scenario), intensity, scatter, stripes=stripes, members=members, fails=fails, seed=seed
    )
    return run_fragility(
        plan,
        Execution(executor=executor, jobs=jobs, scheduler=scheduler),
        shard,
        out=out,
        overwrite=overwrite,
        retry_failed=retry_failed,
        on_row=on_row,
    )


def run_fragility(
    plan: FragilityPlan,
    execution: Execution,
    shard: Shard = WHOLE,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    on_row: OnRow = silent,
) -> FragilityResult:
    """Run what is planned; see `fragility`."""
    loaded("scipy.special", PURPOSE)
    refuse_loss(shard, overwrite=overwrite)
    run, setting = execution.ready()
    base = plan.document.build()
    check_experiment(base)
    cases = plan.cases
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"fragility-{plan.name}"
    prepare(folder, base, plan.name, overwrite=overwrite, kind=FRAGILITY)
    compile_kernels(kernels_of(base))
    with closing(Manifest(folder / shard.file(MANIFEST), "fragility study")) as kept:
        done = CaseIndex(folder, len(cases))
        if retry_failed:
            done.forget_failed(shard)
        before = sum(done.holds(number, settings) for number, settings in enumerate(cases.design))
        table = SweepTable(folder / shard.file(MEMBERS_TABLE), cases, done, None, shard, FRAGILITY)
        timings = Timings(folder / shard.file(TIMINGS), execution.name)
        SweepRun(cases, shard, kept, done, table, timings, on_row).run(run, setting, fail_fast=False)
        rows = _rows(plan, done)
        points = tuple(_points(plan, rows))
        counts = Counts.of(*zip(*((one.intensity, one.failures, one.members) for one in points), strict=True))
        inflation = inflation_of(counts, *_by_record(plan, rows)) if plan.records else None
        curve, missing = fit(counts, inflation=inflation), len(cases) - done.count()
        result = FragilityResult(plan, folder, points, curve, done.count() - before, missing, inflation)
        if shard == WHOLE:
            _write(result)
    return result


def _rows(plan: FragilityPlan, done: CaseIndex) -> dict[float, dict[int, Row]]:
    """Return the rows that there are, by intensity and number of the member."""
    rows: dict[float, dict[int, Row]] = {number: {} for number in plan.levels}
    numbers = list(plan.levels)
    with done.reader() as entry_of:
        for case, settings in enumerate(plan.cases.design):
            entry = entry_of(case) if done.holds(case, settings) else None
            if entry is not None:
                rows[numbers[case % len(numbers)]][case // len(numbers)] = entry.row
    return rows


def _points(plan: FragilityPlan, rows: Mapping[float, Mapping[int, Row]]) -> Iterator[Point]:
    """Count the members of every intensity that have a row."""
    for number, found in rows.items():
        ended = [row for row in found.values() if _has_ended(row)]
        failures = [_has_failed(plan, row) for row in ended]
        moving = sum(bool(row.get(MOVES_ON)) for row, fails in zip(ended, failures, strict=True) if not fails)
        yield Point(number, len(ended), sum(failures), moving, len(found) - len(ended))


def _has_ended(row: Row) -> bool:
    return row["status"] == FINISHED or falls_before_zero(row)


def _has_failed(plan: FragilityPlan, row: Row) -> bool:
    return falls_before_zero(row) or plan.has_failed(row)


def _by_record(
    plan: FragilityPlan, rows: Mapping[float, Mapping[int, Row]]
) -> tuple["NDArray[np.float64]", "NDArray[np.float64]"]:
    """Return failures and members by record, shape (records, intensities that have any)."""
    import numpy as np  # noqa: PLC0415 - as pandas

    ended = [{member: row for member, row in found.items() if _has_ended(row)} for found in rows.values()]
    kept = [found for found in ended if found]
    failed, members = np.zeros((plan.records, len(kept))), np.zeros((plan.records, len(kept)))
    for place, found in enumerate(kept):
        for member, row in found.items():
            members[member % plan.records, place] += 1.0
            failed[member % plan.records, place] += _has_failed(plan, row)
    return failed, members


def _head(plan: FragilityPlan) -> str:
    return f"{INTENSITY} [{plan.head.unit}]" if plan.head.unit else INTENSITY


def _records(result: FragilityResult) -> Iterator[list[Any]]:
    """Yield the rows of fragility.csv."""
    import numpy as np  # noqa: PLC0415 - as pandas

    x = np.array([point.intensity for point in result.points])
    at, low, high = [np.full(len(x), np.nan)] * 3
    if isinstance(result.curve, Curve):
        at, (low, high) = result.curve.probability(x), result.curve.band(x)
    for i, one in enumerate(result.points):
        curve = [float(values[i]) for values in (at, low, high)]
        yield [one.intensity, one.members, one.failures, one.share, *one.limits, *curve, one.moving_on, one.no_result]


def _write(result: FragilityResult) -> None:
    """Write fragility.csv, and the answer into fragility.json."""
    rows = [["" if _finite(cell) is None else cell for cell in row] for row in _records(result)]
    write_answer(result.folder / TABLE, FRAGILITY, [[_head(result.plan), *COLUMNS], *rows], result.to_dict())
