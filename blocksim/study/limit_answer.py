"""What a search for a limit has come to, and a curve of limits: JSON, tables, text and pictures.

limit.csv has all runs of a search, limit.json its brackets; limits.csv the brackets of a curve over another key,
limits.json the answers of all its searches.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Self

from pydantic import BaseModel, Field, InstanceOf, model_serializer, model_validator

from blocksim.errors import ExitCode, InvalidInputError, Problem
from blocksim.scenario.input_files import raise_problems, read_table
from blocksim.simulation.observables import PEAK, Response, table_columns
from blocksim.study.answer import Answer, Overview, with_unit
from blocksim.study.criterion import Stability
from blocksim.study.limit_plan import MOST_SCANNED, NAMES, Change, LimitPlan, Number, moves_supports
from blocksim.study.rows import Head, Row, as_cell
from blocksim.study.run_folder import read_run
from blocksim.study.sweep_folder import CASES, FolderKind, case_folder
from blocksim.view import mechanism, run_data, studies, style

UNIT = r"(?: \[[^\[\]]*\])?"
STEP = "time.step"
HEADS = ("verdict", "outcome", "first to move", "at s", "moved mm", "turned °")
GIVE = 5e-3  # share of a limit that is warned of
LEAST_SAID = 1e-5  # share of a limit
LIMIT = {Stability.STANDS, Stability.FALLS}


class Side(BaseModel, frozen=True, extra="allow"):
    """One side of a bracket: the value that was run, and what it came to, as it was seen."""

    value: float
    verdict: Stability
    outcome: str | None = None
    first_mover: str | int | None = None
    first_moved_s: float | None = None
    displacement_mm: float | None = None
    turn_deg: float | None = None
    end_speed_mm_s: float | None = None
    moves_on: bool | str | None = None
    peak_deg: float | None = None
    status: str | None = None
    reason: str | None = None
    case: str | None = None  # its folder in `cases`, with frames

    @classmethod
    def of(cls, value: Number, verdict: Stability, row: Row) -> Self:
        """Take what a row says."""
        names = (*table_columns(), PEAK, "status", "reason")
        cells: dict[str, Any] = {name: row.get(name) for name in names}
        return cls(value=value, verdict=verdict, **cells, case=None)

    def cells(self) -> list[str | float]:
        """Return its row of a table for people."""
        value, nothing = f"{self.value:.8g}", [""] * 4
        if self.verdict is Stability.FAILED:
            return [value, self.verdict.value, str(self.reason).splitlines()[0], *nothing]
        if self.outcome is None:
            return [value, self.verdict.value, "does not settle", *nothing]
        amplitude = f" ±{self.peak_deg:.2g}°" if self.outcome == Response.ROCKING and self.peak_deg is not None else ""
        first = "" if self.first_mover is None else f"block {self.first_mover}"
        at = "" if self.first_moved_s is None else f"{self.first_moved_s:.3f}"
        moved = (self.displacement_mm or 0.0, self.turn_deg or 0.0)
        return [value, self.verdict.value, f"{self.outcome}{amplitude}", first, at, *moved]


class StiffnessLevel(BaseModel, frozen=True):
    """The bracket of a limit at one stiffness scale."""

    stiffness_scale: float
    low: float
    high: float

    @property
    def middle(self) -> float:
        """The middle of the bracket."""
        return 0.5 * (self.low + self.high)


class Margin(BaseModel, frozen=True):
    """Shares of a limit by which it may lie beyond its bracket."""

    rest: float  # on the standing side
    springs: float  # on the falling side


class Give(NamedTuple):
    """How far contacts have given way where a structure still stands."""

    value: float  # of the key, in its unit
    turn: float  # deg, the largest of all blocks
    share: float  # of the limit, by which it is off


class HalfStep(BaseModel, frozen=True):
    """The bracket of a limit with half the time step (s), or why there is none."""

    step: float
    low: float
    high: float
    problem: str = ""


class Bracket(BaseModel, frozen=True):
    """Between which values what happens changes; its sides are those that were run with the scenario as given."""

    low: float
    high: float
    below: Side
    above: Side
    extrapolated: bool = False  # to stiff contacts, from springs of several stiffnesses
    levels: tuple[StiffnessLevel, ...] = ()
    problem: str = ""
    half_step: HalfStep | None = None
    undecided: Margin | None = None
    give: Give | None = Field(default=None, exclude=True)
    stiff: tuple[float, float] | None = Field(default=None, exclude=True)  # as extrapolated

    @property
    def given(self) -> Change[Stability]:
        """Both values that were run."""
        return Change(self.below.value, self.above.value, self.below.verdict, self.above.verdict)

    @property
    def verdicts(self) -> set[Stability]:
        """What both sides came to."""
        return {self.below.verdict, self.above.verdict}

    def lines(self, unit: str) -> list[str]:
        """Return the answer in words, after what it is made from."""
        lines, half = [], self.half_step
        low, high = self.below.value, self.above.value
        if half is not None and (half.low, half.high) != (low, high):
            moved = (half.low + half.high) / (low + high) - 1.0
            halved = f"{with_unit(half.low, unit)} to {with_unit(half.high, unit)} with half of it ({moved:+.2%})"
            given = f"{with_unit(low, unit)} to {with_unit(high, unit)} with the step as given"
            lines.append(f"{given}, {halved}: give a shorter {STEP}")
        elif half is not None and half.problem:
            lines.append(f"warning: {half.problem}")
        if self.extrapolated:
            stiff = 0.5 * sum(self.stiff or (self.low, self.high))
            lines += [
                f"stiffness scale {one.stiffness_scale:g}: {with_unit(one.low, unit)} to {with_unit(one.high, unit)} "
                f"({one.middle / stiff - 1.0:+.2%})"
                for one in self.levels
            ]
            lines.append("stiff contacts, extrapolated with 1/stiffness:")
        width = (self.high - self.low) / max(abs(self.low), abs(self.high))
        below = f"{self.below.verdict.value} up to {with_unit(self.low, unit)}"
        lines.append(f"{below}, {self.above.verdict.value} from {with_unit(self.high, unit)} (bracket {width:.2%})")
        margin = self.undecided or Margin(rest=0.0, springs=0.0)
        parts = {"rest speed": margin.rest, "stiffness": margin.springs}
        said = [f"{100 * share:.2g} % that {name} cannot decide" for name, share in parts.items() if share > LEAST_SAID]
        return [*lines, f"in the bracket: {' and '.join(said)}"] if said else lines

    def warnings(self, unit: str, *, is_as_given: bool) -> Iterator[str]:
        """Yield what springs do to it, where it is not that of stiff contacts."""
        if self.problem:
            last = self.levels[-1]
            near = f"limit near {with_unit(last.middle, unit)}"
            yield f"warning: {near}, stiffness scale {last.stiffness_scale:g}: {self.problem}"
        if self.verdicts == LIMIT and self.give is not None and self.give.share > GIVE and not self.extrapolated:
            turned = f"blocks have turned by {self.give.turn:.2g}° at {with_unit(self.give.value, unit)}"
            hint = "leave --as-given out" if is_as_given else "see --stiffer"
            yield f"warning: {turned}, as springs give way; the limit is off by some {self.give.share:.1%}; {hint}"


class RangeAnswer(Answer, frozen=True):
    """What was found along a key, and where it was searched."""

    key: str
    unit: str
    low: float = Field(alias="from")
    high: float = Field(alias="to")
    count: int
    is_log: bool
    is_whole: bool

    @staticmethod
    def fields_of(plan: LimitPlan) -> dict[str, object]:
        """Return these fields by their names in JSON, and the tolerance."""
        span = plan.span
        ends = {"from": span.low, "to": span.high, "count": span.count}
        kinds = {"is_log": span.is_log, "is_whole": span.is_whole, "tolerance": plan.tolerance}
        return {"key": plan.key, "unit": plan.unit, **ends, **kinds}

    @property
    def unseen(self) -> str:
        """What a scan may miss, in words."""
        spacing = with_unit((self.high - self.low) / (self.count - 1), self.unit)
        spacing = f"a {self.count - 1}th of the range" if self.is_log else spacing
        return f"islands narrower than {spacing}, between values of the scan, may be missed: --scan N for more values"

    @property
    def vary(self) -> dict[str, dict[str, object]]:
        """The key and its range, as they are given to a search."""
        ends: dict[str, object] = {"from": self.low, "to": self.high}
        if self.is_whole:
            ends = {"from": int(self.low), "to": int(self.high)}
        elif self.unit:
            ends = {name: f"{value:.12g} {self.unit}" for name, value in ends.items()}
        return {self.key: {**ends, "count": self.count, **({"scale": "log"} if self.is_log else {})}}


class LimitAnswer(RangeAnswer, frozen=True):
    """The brackets of a search, from the smallest value up; none where nothing changes."""

    files: ClassVar[FolderKind] = FolderKind("limit", "a limit", "limit", {r"limit\.csv": rf"value{UNIT},verdict,.*"})
    picture: ClassVar[str] = "mechanism"
    caption: ClassVar[str] = "Both sides of every bracket"
    stands: str
    tolerance: float
    scheme: str
    stiffness_scale: float | None
    static_bound: float | None = None  # beyond it no equilibrium exists; the search began there
    static_side: Literal["above", "below"] | None = None  # where that is
    most_runs: int = MOST_SCANNED  # at which the search stops
    is_cut: bool = False  # stopped there
    runs: int
    brackets: tuple[Bracket, ...] = Field(alias="changes")
    is_as_given: bool = Field(default=False, exclude=True)  # neither stiffness nor step was corrected
    plan: InstanceOf[LimitPlan] | None = Field(default=None, exclude=True, repr=False)
    rows: Mapping[float, Row] = Field(default={}, exclude=True, repr=False)  # of the scenario as given, by value

    @classmethod
    def of(
        cls,
        plan: LimitPlan,
        folder: Path,
        rows: Mapping[Number, Row],
        brackets: list[Bracket],
        stiffer: Mapping[float, Mapping[Number, Row]],
        finer: Mapping[float, Mapping[Number, Row]],
        *,
        run: int,
        is_as_given: bool,
        statics: Mapping[str, object] | None = None,
    ) -> Self:
        """Make the answer of a search; `stiffer` has rows by stiffness scale, `finer` by time step (s)."""
        scenario = plan.model.scenario
        scale = scenario.contact.stiffness_scale if scenario.time.has_springs else None
        columns = [*table_columns(), PEAK, "status", "reason", "seconds"]
        searches = [
            (scale, None, rows),
            *((stiff, None, more) for stiff, more in stiffer.items()),
            *((scale, step, more) for step, more in finer.items()),
        ]
        cells = [
            [value, plan.criterion.verdict(row).value, *(as_cell(row.get(name)) for name in columns), stiff, step]
            for stiff, step, more in searches
            for value, row in sorted(more.items())
        ]
        return cls.model_validate(
            {
                **cls.fields_of(plan),
                "stands": plan.criterion.text,
                "scheme": scenario.time.scheme,
                "stiffness_scale": scale,
                **(statics or {}),
                "most_runs": plan.most_runs,
                "runs": len(cells),
                "changes": brackets,
                "folder": folder,
                "run": run,
                "is_as_given": is_as_given,
                "heads": (str(Head("value", plan.unit)), "verdict", *columns, "stiffness_scale", "half_step_s"),
                "cells": cells,
                "plan": plan,
                "rows": rows,
            }
        )

    @property
    def changes(self) -> list[Change[Stability]]:
        """The brackets: of stiff contacts where springs of several stiffnesses were searched."""
        return [Change(one.low, one.high, one.below.verdict, one.above.verdict) for one in self.brackets]

    @property
    def limits(self) -> list[Change[Stability]]:
        """Those between standing and falling."""
        return [one for one in self.changes if {one.below, one.above} == LIMIT]

    @property
    def limits_as_given(self) -> list[Change[Stability]]:
        """The same for the springs and the time step of the scenario, as they were run."""
        return [one.given for one in self.brackets if one.verdicts == LIMIT]

    @property
    def falls(self) -> list[Bracket]:
        """The brackets on one side of which the structure falls; on the other it stands, or moves on at the end."""
        others = {Stability.STANDS, Stability.FALLS, Stability.UNDECIDED}
        return [one for one in self.brackets if others >= one.verdicts > {Stability.FALLS}]

    @property
    def case_folders(self) -> dict[float, str]:
        """Folders in `cases` of runs with frames, by value."""
        sides = (side for one in self.brackets for side in (one.below, one.above))
        return {side.value: side.case for side in sides if side.case is not None}

    def overview(self) -> Overview:
        """Return both sides of every change, where there is none both ends of the range; brackets below them.

        The notes say what is undecided, what springs shift, what is not seen, and where the runs are.
        """
        plan, notes = self.plan, []
        sides = [side for one in self.brackets for side in (one.below, one.above)]
        if not sides and plan is not None:
            verdicts = list(plan.verdicts(self.rows).items())
            sides = [Side.of(value, verdict, self.rows[value]) for value, verdict in (verdicts[0], verdicts[-1])]
        unique = {(side.value, side.verdict): side for side in sides}
        if plan is not None and Stability.UNDECIDED in plan.verdicts(self.rows).values():
            notes.append("undecided: blocks were still moving at the end; increase time.end to decide")
        notes += self.warnings()
        if plan is not None and not self.is_whole and (plan.model.scenario.motion is not None or not self.brackets):
            notes.append(self.unseen)
        notes.append(f"{self.runs} runs, {self.run} of them now: {self.folder / 'limit.csv'}")
        if any({one.below.value, one.above.value} <= self.case_folders.keys() for one in self.falls):
            notes.append(f"picture of the mechanism: blocksim plot {self.folder}")
        contacts, lines = NAMES.get(self.scheme, self.scheme), []
        for one in self.brackets:
            lines += one.lines(self.unit)
        if not lines:
            answer = "" if plan is None else f": {sides[0].verdict.value} at all {len(self.rows)} values"
            lines = [f"no change from {with_unit(self.low, self.unit)} to {with_unit(self.high, self.unit)}{answer}"]
        lines += self._statics()
        about = {"key": self.key, "stands means": self.stands, "contacts": contacts, "runs": str(self.runs)}
        found = lines if self.brackets else ["nothing changes within the range"]
        return Overview(
            f'{self.key}, {contacts}: stands means "{self.stands}"',
            (f"value {self.unit}".rstrip(), *HEADS),
            [side.cells() for side in unique.values()],
            left=4,
            lines=lines,
            notes=notes,
            summary=[*about.items(), *(("limit", line) for line in found)],
            code=self.code,
        )

    @property
    def code(self) -> ExitCode:
        """Success where something changes; failures where these are all that is known besides one verdict."""
        has_failed = any(row[1] == Stability.FAILED for row in self.cells)
        if has_failed and not self.falls:
            return ExitCode.SWEEP_HAS_FAILURES
        return ExitCode.SUCCESS if self.brackets else ExitCode.OUTSIDE

    def _statics(self) -> Iterator[str]:
        """Yield the bound by statics, where the search began there, and whether runs stand beyond it."""
        bound = self.static_bound
        if bound is None or self.static_side is None:
            return
        yield f"no equilibrium {self.static_side} {with_unit(bound, self.unit)} (statics)"
        for one in self.limits:
            stands = one.low if one.above is Stability.FALLS else one.high
            beyond = stands - bound if self.static_side == "above" else bound - stands
            if beyond > self.tolerance * abs(bound):
                yield f"warning: runs stand beyond what statics can carry, by {beyond / abs(bound):.2%}"

    def warnings(self) -> list[str]:
        """Return what springs do to limits that are not those of stiff contacts, and that the search was cut short."""
        found = [text for one in self.brackets for text in one.warnings(self.unit, is_as_given=self.is_as_given)]
        plan = self.plan
        is_open = plan is not None and moves_supports(plan.model) and plan.model.scenario.time.has_springs
        if is_open and self.falls and not (self.is_as_given or any(one.levels for one in self.brackets)):
            found.append("with moving supports the effect of contact stiffness is not estimated; --stiffer computes it")
        if self.is_cut:
            found.append(f"warning: stopped after {self.runs} runs; --most-runs above {self.most_runs} continues")
        return found

    def draw(self, path: Path, title: str, paper: style.Paper) -> None:
        """Draw both sides of the brackets whose runs were kept, what stands on the left."""
        brackets = []
        for one in self.brackets:
            sides = [side for side in (one.below, one.above) if side.case and case_folder(self.folder, side.case)]
            if len(sides) == 2:
                first, second = sorted(sides, key=lambda side: side.verdict is not Stability.STANDS)
                brackets.append((self._picture_of(first), self._picture_of(second)))
        if not brackets:
            empty = "it holds no runs of both sides of a bracket"
            why = empty if self.brackets else "nothing changes within its range"
            raise InvalidInputError(f"{self.folder}: {why}; nothing to draw")
        mechanism.draw_mechanisms(brackets, path, title, paper)

    def _picture_of(self, side: Side) -> mechanism.BracketRun:
        """Return a side whose run was kept, as it is drawn."""
        run = read_run(self.folder / CASES / Path(str(side.case)).name)
        first = None if side.first_mover is None else str(side.first_mover)
        head = f"{side.verdict.value} at {self.key} = {with_unit(side.value, self.unit)}"
        came = side.outcome or ""
        if first is not None:
            came = f"{came}; first to move: block {first} at {side.first_moved_s or 0.0:.3g} s"
        support, is_mechanism = run_data.support_of(run.model, run.events), side.verdict is not Stability.STANDS
        picture = mechanism.BracketRun(run.frames, support, first, head, is_mechanism=is_mechanism)
        return replace(picture, caption=f"{head}\n{came} (drawn at {float(run.frames.time[picture.frame]):.3g} s)")


class CurvePoint(BaseModel, frozen=True):
    """The search at one value of the other key."""

    over: float
    search: LimitAnswer

    @model_validator(mode="before")
    @classmethod
    def _nested(cls, data: Any) -> Any:
        """Take the fields of the answer, which stand beside the value."""
        is_flat = isinstance(data, dict) and "search" not in data
        return {"over": data.get("over"), "search": data} if is_flat else data

    def rows(self) -> Iterator[tuple[float, float | None, float | None, str, str]]:
        """Yield the value, ends and verdicts of every bracket; without ends where nothing changes."""
        for one in self.search.changes:
            yield self.over, one.low, one.high, one.below.value, one.above.value
        if not self.search.brackets:
            verdict = next((str(row[1]) for row in self.search.cells), "no change")
            yield self.over, None, None, verdict, verdict

    @model_serializer
    def _flat(self) -> dict[str, object]:
        return {"over": self.over, **self.search.to_dict()}


class CurveAnswer(Answer, frozen=True):
    """The limits at the values of another key, from the smallest up."""

    files: ClassVar[FolderKind] = FolderKind(
        "limits", "a curve of limits", "limit", {r"limits\.csv": rf"over{UNIT},low.*,high.*"}
    )
    picture: ClassVar[str] = "limits"
    caption: ClassVar[str] = "Limits"
    takes_table: ClassVar[bool] = True
    key: str
    unit: str
    over: str
    over_unit: str
    stands: str
    points: tuple[CurvePoint, ...]

    @classmethod
    def of(cls, over: Head, folder: Path, searches: Mapping[float, LimitAnswer]) -> Self:
        """Make the answer from those of the searches."""
        one = next(iter(searches.values()))
        points = tuple(CurvePoint(over=value, search=search) for value, search in searches.items())
        ends = (str(Head("low", one.unit)), str(Head("high", one.unit)))
        return cls(
            key=one.key,
            unit=one.unit,
            over=over.key,
            over_unit=over.unit,
            stands=one.stands,
            points=points,
            folder=folder,
            run=sum(search.run for search in searches.values()),
            heads=(str(Head("over", over.unit)), *ends, "below", "above"),
            cells=[row for point in points for row in point.rows()],
        )

    def places(self) -> dict[float, Path]:
        """Return the folders of the searches by the value of the other key."""
        return {point.over: self.folder / place_of(point.over, self.over_unit) for point in self.points}

    @property
    def searches(self) -> dict[float, LimitAnswer]:
        """The answers of the searches by the value of the other key."""
        return {point.over: point.search for point in self.points}

    def overview(self) -> Overview:
        """Return a row for every bracket, and one for a value at which nothing changes; notes on what springs shift."""
        rows: list[list[str | float]] = []
        for over, low, high, *verdicts in (row for point in self.points for row in point.rows()):
            ends = ("–" if end is None else f"{end:.7g}" for end in (low, high))
            rows.append([with_unit(over, self.over_unit, 6), *ends, *map(str, verdicts)])
        warnings = [text for point in self.points for text in point.search.warnings()]
        return Overview(
            f'{self.key} over {self.over}: stands means "{self.stands}"',
            (self.over, f"from {self.unit}".rstrip(), f"to {self.unit}".rstrip(), "below", "above"),
            rows,
            notes=[*warnings, f"limits: {self.folder / 'limits.csv'}; picture: blocksim plot {self.folder}"],
            summary=[("key", self.key), ("over", self.over), ("stands means", self.stands)],
            code=max(point.search.code for point in self.points),
        )

    def draw(self, path: Path, title: str, paper: style.Paper) -> None:
        """Draw limits over the other key, with a table of published or measured ones beside them."""
        points = [
            (point.over, [studies.LimitRange(one.low, one.high, one.below.value, one.above.value)
                          for one in point.search.changes])
            for point in self.points
        ]  # fmt: skip
        none = [f"{value:.6g}" for value, brackets in points if not brackets]
        if len(none) == len(points):
            raise InvalidInputError(f"{self.folder}: nothing changes within its range; nothing to draw")
        notes = [f"Stands means: {self.stands}.", *([f"Nothing changes at {', '.join(none)}."] if none else [])]
        axes = [
            f"{key} ({unit})" if unit else key for key, unit in ((self.over, self.over_unit), (self.key, self.unit))
        ]
        published = () if self.beside is None else read_limits(self.beside, self.over_unit, self.unit)
        curve = studies.LimitCurve(axes[0], axes[1], points, tuple(notes), published)
        studies.draw_limit_curve(curve, path, title, paper)


def place_of(number: float, unit: str) -> str:
    """Return the name of the folder of a value of the other key, one that needs no quotes in a shell."""
    return re.sub(r"[^A-Za-z0-9.+-]+", "-", with_unit(number, unit, 6))


def read_limits(path: Path, over_unit: str, unit: str) -> tuple[studies.OtherLimits, ...]:
    """Return the series of a table in the order of their first rows: value of the other key, limit, and name.

    Its columns are `over`, `limit` and `series`, the first two with the units of the search in brackets where there
    are any: `limit [m]`. Raises InputMissingError, and InvalidInputError with the place of every mistake.
    """
    over, limit = str(Head("over", over_unit)), str(Head("limit", unit))
    table = read_table(path, (over, limit, "series"))
    problems = list(table.problems)
    series: dict[str, list[tuple[float, float]]] = {}
    for row in table.rows:
        place: list[float] = []
        for cell in (row[over], row[limit]):
            try:
                place.append(cell.number())
            except ValueError as error:
                problems.append(cell.problem(str(error)))
        if len(place) == 2:
            series.setdefault(row["series"].text, []).append((place[0], place[1]))
    if not problems and not series:
        problems.append(Problem(str(path), "the table has no rows"))
    if problems:
        raise_problems(problems)
    return tuple(studies.OtherLimits(name, tuple(points)) for name, points in series.items())
