"""What a search for a limit has found, and its files: limit.csv with all runs, limit.json with the answer."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from blocksim.simulation.movement import PEAK, table_columns
from blocksim.study.criterion import Verdict
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_search import Change, Number, changes_in
from blocksim.study.limit_stiff import Levels
from blocksim.study.rows import Row, as_cell
from blocksim.study.sweep_folder import LIMIT, write_answer

if TYPE_CHECKING:
    import pandas as pd

TABLE = "limit.csv"
VALUE, VERDICT, SCALE, STEP = "value", "verdict", "stiffness_scale", "half_step_s"
BOTH = {Verdict.STANDS, Verdict.FALLS}
BOTH_OR_MOVING = BOTH | {Verdict.UNDECIDED}


class Margin(NamedTuple):
    """Shares of a limit by which it may lie beyond its bracket: see limit_margin.py."""

    rest: float  # on the standing side
    springs: float  # on the falling side


class Finer(NamedTuple):
    """The bracket of a limit with half the time step (s), or why there is none."""

    step: float
    low: float
    high: float
    problem: str = ""


@dataclass(frozen=True)
class LimitResult:
    """All runs of a search by value, and where the answer changes.

    `rows` are those of the scenario as given; `stiffer` those with stiffer springs, by stiffness scale.
    """

    plan: LimitPlan = field(repr=False)
    folder: Path
    rows: Mapping[Number, Row] = field(repr=False)
    run: int  # runs of this call; the others were known
    kept: Mapping[Number, str] = field(default_factory=dict, repr=False)  # folders in `cases`, with frames, by value
    released: Mapping[Number, Row] = field(default_factory=dict, repr=False)  # of those that fall before time zero
    stiffer: Mapping[float, Mapping[Number, Row]] = field(default_factory=dict, repr=False)
    levels: Mapping[Change[Verdict], Levels] = field(default_factory=dict, repr=False)  # of limits as given
    finer: Mapping[Change[Verdict], Finer] = field(default_factory=dict, repr=False)  # the same, of rigid contacts
    finer_rows: Mapping[float, Mapping[Number, Row]] = field(default_factory=dict, repr=False)  # by time step
    margins: Mapping[Change[Verdict], Margin] = field(default_factory=dict, repr=False)

    @property
    def runs(self) -> int:
        """Number of all runs."""
        return len(self.rows) + sum(map(len, (*self.stiffer.values(), *self.finer_rows.values())))

    @property
    def verdicts(self) -> dict[Number, Verdict]:
        """What each value came to in the scenario as given, from the smallest up."""
        return {value: self.plan.criterion.verdict(self.rows[value]) for value in sorted(self.rows)}

    @property
    def changes_as_given(self) -> list[Change[Verdict]]:
        """Brackets between neighbours that differ, from the smallest value up; empty where nothing changes."""
        return changes_in(self.verdicts)

    @property
    def limits_as_given(self) -> list[Change[Verdict]]:
        """Those brackets between standing and falling."""
        return [change for change in self.changes_as_given if {change.below, change.above} == BOTH]

    @property
    def falls_as_given(self) -> list[Change[Verdict]]:
        """Those on one side of which the structure falls; on the other it stands, or moves on at the end."""
        return [one for one in self.changes_as_given if BOTH_OR_MOVING >= {one.below, one.above} > {Verdict.FALLS}]

    @property
    def changes(self) -> list[Change[Verdict]]:
        """The answer: brackets of the scenario as given, of stiff contacts where springs of several were searched."""
        return [self.answer(change) for change in self.changes_as_given]

    @property
    def limits(self) -> list[Change[Verdict]]:
        """Those between standing and falling."""
        return [self.answer(change) for change in self.limits_as_given]

    def answer(self, change: Change[Verdict]) -> Change[Verdict]:
        """Return a bracket as it is with stiff contacts and short steps, as far as known, and as wide as is unknown."""
        levels, finer = self.levels.get(change), self.finer.get(change)
        low, high = change.low, change.high
        if levels is not None and levels.stiff is not None:
            low, high = levels.stiff
        if finer is not None and (finer.low, finer.high) != (low, high):
            on = max(finer.low - high, 0.0) + min(finer.high - low, 0.0)  # what lies between both
            low, high = min(low, finer.low + min(on, 0.0)), max(high, finer.high + max(on, 0.0))
        rest, springs = self.margins.get(change, Margin(0.0, 0.0))
        below, above = (rest, springs) if change.above is Verdict.FALLS else (springs, rest)
        return replace(change, low=low - below * abs(low), high=high + above * abs(high))

    def seen(self, value: Number) -> Row:
        """Return what a run came to; of one that falls before time zero, as it was released then and kept."""
        return self.released.get(value, self.rows[value])

    @property
    def is_extrapolated(self) -> bool:
        """True where any limit is that of stiff contacts."""
        return any(levels.stiff is not None for levels in self.levels.values())

    @property
    def pictured(self) -> list[Change[Verdict]]:
        """The limits of which both sides are kept as runs."""
        return [one for one in self.falls_as_given if {one.low, one.high} <= self.kept.keys()]

    @property
    def scale(self) -> float | None:
        """The stiffness scale as given; None for rigid contacts."""
        scenario = self.plan.document.build()
        return scenario.contact.stiffness_scale if scenario.time.has_springs else None

    @property
    def table(self) -> "pd.DataFrame":
        """All runs as limit.csv has them."""
        import pandas as pd

        return pd.DataFrame(list(_records(self)), columns=[_head(self.plan), *_columns()])

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        plan = self.plan
        return {
            "key": plan.key,
            "unit": plan.unit,
            "from": plan.span.low,
            "to": plan.span.high,
            "count": plan.span.count,
            "is_log": plan.span.is_log,
            "is_whole": plan.span.is_whole,
            "stands": plan.criterion.text,
            "tolerance": plan.tolerance,
            "scheme": plan.document.build().time.scheme,
            SCALE: self.scale,
            "runs": self.runs,
            "changes": [self._change(change) for change in self.changes_as_given],
        }

    def _change(self, change: Change[Verdict]) -> dict[str, object]:
        answer, levels = self.answer(change), self.levels.get(change)
        told: dict[str, object] = {
            "low": answer.low,
            "high": answer.high,
            "below": self._side(change.low, change.below),
            "above": self._side(change.high, change.above),
        }
        if levels is not None:
            told["extrapolated"] = levels.stiff is not None
            told["levels"] = [{SCALE: one.scale, "low": one.low, "high": one.high} for one in levels.found]
            told["problem"] = levels.problem
        finer, margin = self.finer.get(change), self.margins.get(change)
        if finer is not None:
            told["half_step"] = finer._asdict()
        if margin is not None:
            told["undecided"] = margin._asdict()
        return told

    def _side(self, value: Number, verdict: Verdict) -> dict[str, object]:
        row, seen = self.rows[value], self.seen(value)
        told = {name: seen.get(name) for name in (*table_columns(), PEAK)} | {
            name: row.get(name) for name in ("status", "reason")
        }
        return {VALUE: value, VERDICT: verdict.value, **told, "case": self.kept.get(value)}

    def __repr__(self) -> str:
        """Return a line: key, brackets, runs, folder."""
        shown = self.plan.shown
        found = ", ".join(f"{shown(one.low)} {one.below} / {shown(one.high)} {one.above}" for one in self.changes)
        return f"<LimitResult {self.plan.key}: {found or 'no change'}; {self.runs} runs, {self.folder}>"


def write_result(result: LimitResult) -> None:
    """Write limit.csv, and the answer into limit.json."""
    rows: list[list[object]] = [[_head(result.plan), *_columns()], *_records(result)]
    write_answer(result.folder / TABLE, LIMIT, rows, result.to_dict())


def _head(plan: LimitPlan) -> str:
    return f"{VALUE} [{plan.unit}]" if plan.unit else VALUE


def _columns() -> list[str]:
    return [VERDICT, *table_columns(), PEAK, "status", "reason", "seconds", SCALE, STEP]


def _records(result: LimitResult) -> Iterator[list[object]]:
    """Yield the rows of limit.csv: those of the scenario as given, then of stiffer springs, and of half the step."""
    given = (result.scale, None, result.rows)
    stiffer = ((scale, None, rows) for scale, rows in result.stiffer.items())
    finer = ((result.scale, step, rows) for step, rows in result.finer_rows.items())
    for scale, step, rows in (given, *stiffer, *finer):
        for value in sorted(rows):
            row = rows[value]
            cells = (as_cell(row.get(name)) for name in _columns()[1:-2])
            yield [value, result.plan.criterion.verdict(row).value, *cells, scale, step]


def fallen(verdicts: Mapping[Number, Verdict]) -> dict[Number, Verdict]:
    """Return what runs came to, those that move on at the end without having fallen among those that stand."""
    return {value: Verdict.STANDS if verdict is Verdict.UNDECIDED else verdict for value, verdict in verdicts.items()}
