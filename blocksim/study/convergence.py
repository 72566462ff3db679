"""What a study of convergence finds: levels, changes between them, observed order, verdict, and what to recommend.

The distance between two results is the largest over all blocks of |change of x| and of |change of rotation| times half
the diagonal, which is how far the turn moves a corner; both in mm. The observed order is Richardson's: with r the
factor of a refinement, a change of order p shrinks by r^p, so p = log(change before / change) / log(r), taken from the
coordinate that changes most and given only where it continues in the same direction by less.

The outcome of a block flips between two levels where it ends turned by more than 45 degrees, farther away than its
longest side, or higher or lower by more than half its shortest side (on another block, or on none). A distance between
two outcomes is no error of discretisation: it has no order, and that it shrinks means nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import inf, isfinite, log, nan

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario, place_bodies
from blocksim.study.rows import FINISHED, Row

DIGITS = 6  # of a level's value, so that the value that is reported gives the same run when it is set
ROUND_OFF_MM = 1e-6  # a smaller change says nothing about the order
SHRINKING = 0.75  # a change is at most this part of the one before it where changes shrink
MILLI = 1e3
ANOTHER_FACE_DEG = 45.0  # turned by more, a block ends on another of its sides
NO_COORDINATES = np.zeros(0)
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Refinement:
    """One setting: `value * factor` is the next finer level of a value; `coarser` levels go the other way."""

    study: str
    title: str
    key: str
    own: float
    factor: float
    coarser: int

    def value(self, level: int) -> float:
        """Return the value at a level, the scenario's own to the last bit."""
        return self.own if level == 0 else float(f"{self.own * self.factor**level:.{DIGITS}g}")

    def at(self, scenario: Scenario, level: int) -> Scenario:
        """Return the scenario at a level, everything else as it was."""
        return with_setting(scenario, self.key, self.value(level))


def with_setting(scenario: Scenario, key: str, value: float) -> Scenario:
    """Return the scenario with a key `table.name` set, of a system in all its tables."""
    table, name = key.split(".")
    if table in scenario.systems:
        tables = tuple(one.model_copy(update={name: value}) for one in scenario.systems[table])
        return scenario.model_copy(update={"systems": {**scenario.systems, table: tables}})
    changed = getattr(scenario, table).model_copy(update={name: value})
    return scenario.model_copy(update={table: changed})


class ConvergenceVerdict(StrEnum):
    """What refining has shown."""

    CONVERGED = "converged"  # two refinements in a row change less than the tolerance
    NOT_YET = "not yet converged"  # the changes shrink, but were still too large at the last level
    SCATTERED = "not converged"  # the changes do not shrink
    FLIPS = "outcome flips"  # in one of the last two refinements some block ends in another place or on another side
    FAILED = "failed"  # a level that was needed did not run to its end


@dataclass(frozen=True)
class Level:
    """One run: the refined value, how the run ended, and how far its final state is from others."""

    value: float
    is_own: bool  # the scenario's own value
    status: str
    reason: str
    seconds: float  # of solving
    x_mm: tuple[float, ...]  # final centre of each block; empty where the run did not finish
    rotation_deg: tuple[float, ...]
    change_mm: float  # distance to the level before; NaN where there is none
    order: float  # observed; NaN where there is none
    to_finest_mm: float  # distance to the finest level that finished
    flipped: tuple[str, ...] = ()  # blocks whose outcome is another one than at the level before

    @property
    def is_finished(self) -> bool:
        """Return True if the run came to its proper end."""
        return self.status == FINISHED


@dataclass(frozen=True)
class RefinementStudy:
    """One setting refined, from its coarsest level to its finest."""

    study: str
    title: str
    key: str
    factor: float
    tolerance_mm: float
    levels: tuple[Level, ...]
    verdict: ConvergenceVerdict

    @property
    def own(self) -> Level:
        """The level of the scenario as it is."""
        return next(level for level in self.levels if level.is_own)

    @property
    def recommended(self) -> Level | None:
        """The coarsest level that stays within the tolerance of the finest, with all levels between them."""
        if self.verdict is not ConvergenceVerdict.CONVERGED:
            return None
        chosen = None
        for level in reversed(self.levels):
            if not level.to_finest_mm <= self.tolerance_mm:
                break
            chosen = level
        return chosen

    @property
    def last_change_mm(self) -> float:
        """The larger of the last two changes; NaN where there are none."""
        return max((level.change_mm for level in self.levels[-2:]), default=nan)


@dataclass(frozen=True)
class Recommendation:
    """Recommended settings in one run; `to_finest_mm` is its distance to the farthest of all finest levels."""

    settings: dict[str, float]
    seconds: float
    own_seconds: float
    to_finest_mm: float


@dataclass(frozen=True)
class Convergence:
    """All studies of one scenario; `recommended` is None where there is nothing to change, or nothing to rely on."""

    name: str
    blocks: tuple[str, ...]
    tolerance_mm: float
    studies: tuple[RefinementStudy, ...]
    notes: tuple[str, ...]
    recommended: Recommendation | None

    @property
    def failed(self) -> bool:
        """Return True if the scenario does not even run as it is."""
        return not self.studies[0].own.is_finished

    @property
    def converged(self) -> bool:
        """Return True if every study has converged."""
        return all(study.verdict is ConvergenceVerdict.CONVERGED for study in self.studies)


class Coordinates:
    """Final states as points in a space whose largest coordinate difference is the distance defined above (mm)."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn names and sizes of the blocks."""
        placed = place_bodies(scenario)
        self.blocks = tuple(body.name for body in placed)
        self._reach = np.array([MILLI * body.radius for body in placed])
        sides = MILLI * np.array([(body.size_x, body.size_y) for body in placed])
        self._longest, self._shortest = sides.max(axis=1), np.array([MILLI * body.least_width for body in placed])

    def read(self, row: Row) -> tuple[Floats, Floats]:
        """Return final x (mm) and rotation (degrees) of every block, of no block where the run did not finish."""
        if row["status"] != FINISHED:
            return NO_COORDINATES, NO_COORDINATES
        return self._column(row, "x_mm"), self._column(row, "rotation_deg")

    def _column(self, row: Row, column: str) -> Floats:
        return np.array([row[f"{name}.{column}"] for name in self.blocks], dtype=float)

    def point(self, row: Row) -> Floats:
        """Return the coordinates (mm), empty where the run did not finish."""
        x, rotation = self.read(row)
        return np.concatenate([x, np.radians(rotation) * self._reach[: len(rotation)]])

    def flipped(self, before: Row, row: Row) -> tuple[str, ...]:
        """Return the blocks whose outcome differs between two runs; none where one of them did not finish."""
        if {before["status"], row["status"]} != {FINISHED}:
            return ()
        x, y, turn = (
            np.abs(self._column(row, name) - self._column(before, name)) for name in ("x_mm", "y_mm", "rotation_deg")
        )
        elsewhere = (np.hypot(x, y) > self._longest) | (y > 0.5 * self._shortest)
        return tuple(self.blocks[i] for i in np.flatnonzero(elsewhere | (turn > ANOTHER_FACE_DEG)))


def distance(one: Floats, other: Floats) -> float:
    """Return the largest difference of two points; NaN where one is missing."""
    return float(np.max(np.abs(one - other))) if one.size and other.size else nan


def observed_order(points: Sequence[Floats], factor: float) -> float:
    """Return the order from three levels, from coarse to fine, each finer by `factor`; NaN where there is none."""
    if not all(point.size for point in points):
        return nan
    coarse, middle, fine = points
    most = int(np.argmax(np.abs(fine - middle)))
    before, after = float(middle[most] - coarse[most]), float(fine[most] - middle[most])
    if abs(after) < ROUND_OFF_MM or before * after <= 0.0 or abs(after) >= abs(before):
        return nan
    return log(before / after) / abs(log(factor))


def judge(
    rows: dict[int, Row], refinement: Refinement, coordinates: Coordinates, tolerance_mm: float
) -> RefinementStudy:
    """Return what the rows of a study's levels say; `rows` is by level and complete from its first to its last."""
    order = sorted(rows)
    points = [coordinates.point(rows[level]) for level in order]
    finest = next((point for point in reversed(points) if point.size), NO_COORDINATES)
    levels = []
    for i, number in enumerate(order):
        x, rotation = coordinates.read(rows[number])
        levels.append(
            Level(
                value=refinement.value(number),
                is_own=number == 0,
                status=str(rows[number]["status"]),
                reason=str(rows[number]["reason"]),
                seconds=float(str(rows[number]["seconds"])),
                x_mm=tuple(x.tolist()),
                rotation_deg=tuple(rotation.tolist()),
                change_mm=distance(points[i - 1], points[i]) if i else nan,
                order=observed_order(points[i - 2 : i + 1], refinement.factor) if i > 1 else nan,
                to_finest_mm=distance(points[i], finest),
                flipped=coordinates.flipped(rows[order[i - 1]], rows[number]) if i else (),
            )
        )
    flips = any(level.flipped for level in levels[-2:])
    verdict = verdict_of([level.change_mm for level in levels[1:]], tolerance_mm, flips=flips)
    return RefinementStudy(
        refinement.study,
        refinement.title,
        refinement.key,
        refinement.factor,
        tolerance_mm,
        tuple(levels),
        verdict,
    )


def verdict_of(changes_mm: Sequence[float], tolerance_mm: float, *, flips: bool) -> ConvergenceVerdict:
    """Judge the changes from level to level, from coarse to fine; NaN is a change to or from a failed level.

    `flips` says that an outcome changes in one of the last two refinements.
    """
    last = changes_mm[-2:]
    if len(last) < 2 or not all(map(isfinite, last)):
        return ConvergenceVerdict.FAILED
    if flips:
        return ConvergenceVerdict.FLIPS
    if max(last) < tolerance_mm:
        return ConvergenceVerdict.CONVERGED
    before = next((change for change in reversed(changes_mm[:-2]) if isfinite(change)), inf)
    shrinks = all(after <= SHRINKING * before for before, after in pairwise([before, *last]))
    return ConvergenceVerdict.NOT_YET if shrinks else ConvergenceVerdict.SCATTERED
