"""Observables: what a run came to, in numbers and words. A new one is one entry of `_ALL`.

It then stands in run.json (`in_runs`), in rows (`in_rows`), sweep.csv and limit.csv (`in_tables`), in criteria such as
"moved < 5 mm" (`word`), on screen, axes and in reports (`title`); not in final.csv, nor in run.h5, whose group
`observables` holds energies. All are computed from the ends of m scenes at once; a single run is a stack of one.

A block has moved where its centre, or a corner by its turn, is more than a hundredth of its shortest side away from
where it started. It has fallen where it is turned by more than 45 degrees, or its centre is lower by more than half its
shortest side. A scene

    stands       where no block has moved at the end,
    rocked back  where none has at the end, but some had in a frame on the way,
    rocking      where some block has moved, none has fallen, and some block turns on at the end,
    slid         where some block has moved, none has fallen, and none turns on,
    fell         where some block has fallen.

All of this is relative to the support: what rides on a shaking table has not moved. Fixed and driven blocks do not
count; a removed one stays where it was then. A run that `time.end` cuts short is reported as it is then; it moves on
where some block, as fast as it is then, would be farther than that hundredth away within another tenth of the time. A
run that failed has no outcome; one that an overlap has ended after the fall fell, if its energy adds up until then, and
some block is lower by that overlap in addition: blocks that are pushed into the ground have not fallen. The first mover
is the block that has moved in the first frame in which any has (the farthest of several); members of ensembles keep no
frames, but are looked at when those would be recorded, until one block has moved.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from blocksim.scenario import Model, PlacedBody, motion
from blocksim.simulation.trajectory import MILLI

ROUND_OFF = 1e-9  # between two ways to compute a distance
MOVED_SHARE = 0.01  # of the shortest side
FURTHER = 0.1  # of the simulated time
FALLEN_TURN = np.radians(45.0)
FALLEN_SHARE = 0.5  # of the shortest side, downwards
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Value = str | float | bool | None


class MovingSupport:
    """Motion of the support."""

    def __init__(self, model: Model | None) -> None:
        """Work out the pieces of its motion once; without a model, or without a motion, it rests."""
        self.times: list[float] = []
        self.coefficients: list[list[float]] = []
        self.direction = (1.0, 0.0)
        if model is not None and model.scenario.motion is not None:
            pieces = model.motion
            self.direction = motion.motion_direction(model.scenario)
            self.times, self.coefficients = pieces.times.tolist(), pieces.coefficients.tolist()

    @property
    def moves(self) -> bool:
        """Whether it does not rest all the time."""
        return bool(self.coefficients)

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return displacement (m) and velocity (m/s) along x and y at a time (s)."""
        if not self.coefficients:
            return (0.0, 0.0), (0.0, 0.0)
        piece = min(max(bisect_right(self.times, time) - 1, 0), len(self.coefficients) - 1)
        s = time - self.times[piece]
        c0, c1, c2, c3 = self.coefficients[piece]
        moved, speed = c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + 3.0 * s * c3)
        (x, y) = self.direction
        return (moved * x, moved * y), (speed * x, speed * y)

    def way(self, time: float) -> tuple[float, float]:
        """Return how far (m) it has come along x and y since the start, at a time (s)."""
        (x, y), _ = self.at(time)
        (x0, y0), _ = self.at(0.0)
        return x - x0, y - y0


AT_REST = MovingSupport(None)


class Response(StrEnum):
    """What a scene came to."""

    STANDS = "stands"
    ROCKED = "rocked back"
    ROCKING = "rocking"
    SLID = "slid"
    FELL = "fell"


class FirstMove(NamedTuple):
    """Which block moved first, and the time (s) of the first frame in which it had moved."""

    block: str
    time: float


class BlockLengths(NamedTuple):
    """Lengths of the blocks (m) of m scenes, and which of them can move: (m, b) each."""

    shortest: Floats
    reach: Floats  # half a diagonal
    is_free: Flags

    @classmethod
    def of(cls, placed: Sequence[Sequence[PlacedBody]]) -> "BlockLengths":
        """Return those of scenes with the same number of blocks."""
        bodies = [body for scene in placed for body in scene]
        is_free = np.array([not body.fixed or body.freed for body in bodies], dtype=np.bool_)
        shortest = np.array([body.least_width for body in bodies], dtype=np.float64)
        reach = np.array([body.radius for body in bodies], dtype=np.float64)
        count = len(placed)
        return cls(shortest.reshape(count, -1), reach.reshape(count, -1), is_free.reshape(count, -1))

    def shares(self, way: Floats, turn: Floats) -> Floats:
        """Return how far blocks are from their start (m, rad), in units of the threshold: above 1 is moved."""
        shares = np.fmax(way, turn * self.reach) / (MOVED_SHARE * self.shortest)
        shares[np.isnan(shares)] = np.inf
        return np.where(self.is_free, shares, 0.0)


@dataclass(frozen=True, eq=False)
class Ends:
    """How m scenes with b blocks each began and ended, and what was seen on the way; SI."""

    placed: Sequence[Sequence[PlacedBody]]
    shapes: BlockLengths
    start: Floats  # (m, 3, b) x, y, angle
    motion: Floats  # (m, 6, b) x, y, angle and their rates
    carried: Floats  # (m, 2, b) way of the support, as long as a block was there
    support: Floats  # (m, 2) velocity of ground and walls
    seconds: Floats  # (m,) simulated
    first: Sequence[FirstMove | None]
    turned: Floats | None = None  # (m, b) or (m, 1) largest rotation on the way; None where it was not followed
    moved: Floats | None = None  # (m, b) largest displacement on the way; None where it was not followed
    sunk: Floats | float = 0.0  # (m, 1) m, by how much blocks may be too low as their contacts are too deep

    @cached_property
    def shift(self) -> Floats:
        """Way of the centres, (m, 2, b), by the final table, which is in mm."""
        return np.asarray(MILLI * self.motion[:, :2] / MILLI - self.start[:, :2] - self.carried)

    @cached_property
    def way(self) -> Floats:
        """Displacement of the centres from start to end, (m, b)."""
        return np.asarray(np.hypot(self.shift[:, 0], self.shift[:, 1]))

    @cached_property
    def turn_deg(self) -> Floats:
        """Rotation from start to end in degrees, (m, b), by the final table, which counts from the angles as drawn."""
        drawn = np.array([[body.angle for body in scene] for scene in self.placed], dtype=np.float64)
        return np.asarray(np.abs(np.degrees(self.motion[:, 2] - drawn) - np.degrees(self.start[:, 2] - drawn)))

    @cached_property
    def corner_speed(self) -> Floats:
        """Speed of the corners of free blocks by their spin, (m, b)."""
        return np.where(self.shapes.is_free, np.abs(self.motion[:, 5]) * self.shapes.reach, 0.0)

    @cached_property
    def speed(self) -> Floats:
        """Speed of free blocks relative to the support, or that of their corners by their spin, (m, b)."""
        velocity = np.hypot(self.motion[:, 3] - self.support[:, :1], self.motion[:, 4] - self.support[:, 1:])
        return np.where(self.shapes.is_free, np.fmax(velocity, self.corner_speed), 0.0)

    def go_on(self, speed: Floats) -> list[bool]:
        """Return which scenes have a block that would soon have left its place, at speeds (m, b)."""
        soon = FURTHER * self.seconds[:, None] * speed
        return [bool(one) for one in np.any(soon > MOVED_SHARE * self.shapes.shortest, axis=1)]

    def largest(self, values: Floats) -> Floats:
        """Return the largest value (m, b) of a block that can move, (m,)."""
        return np.asarray((values * self.shapes.is_free).max(axis=1))

    def names(self, values: Floats) -> list[str]:
        """Return the block with the largest of the values (m, b), of each scene."""
        which = np.argmax(np.where(np.isnan(values), -1.0, values), axis=1).tolist()
        return [scene[block].name for scene, block in zip(self.placed, which, strict=True)]


def _outcomes(ends: Ends) -> list[Response]:
    turn, shapes = np.radians(ends.turn_deg), ends.shapes
    is_down = (turn > FALLEN_TURN) | (-ends.shift[:, 1] - ends.sunk > FALLEN_SHARE * shapes.shortest)
    fell = np.any(shapes.is_free & is_down, axis=1)
    moved = np.any(shapes.shares(ends.way, turn) > 1.0, axis=1)
    turns_on, is_still = ends.go_on(ends.corner_speed), [one is None for one in ends.first]
    responses = [Response.FELL, Response.ROCKING, Response.SLID, Response.STANDS]
    names = np.select([fell, moved & turns_on, moved, is_still], responses, Response.ROCKED)
    return [Response(name) for name in names.tolist()]


def _fastest(ends: Ends) -> Floats:
    which = np.argmax(np.where(np.isnan(ends.speed), -1.0, ends.speed), axis=1)
    return np.take_along_axis(ends.speed, which[:, None], axis=1)[:, 0]


@dataclass(frozen=True)
class Observable:
    """One thing that is known of the end of a run.

    `name` is that of its entry in run.json and of its column in sweep.csv; `of` gives a value (or None) for each of m
    scenes, or None for all where it was not followed. One with a `title` is told by the command line and by reports;
    `block` is the observable that names the block it is of. `word` stands for it in criteria; `choices` are the values
    of one that is no number.
    """

    name: str
    of: Callable[[Ends], "Sequence[Value] | Floats | None"]
    unit: str = ""
    title: str = ""
    block: str = ""
    word: str = ""
    choices: tuple[str, ...] = ()
    in_runs: bool = True  # in run.json
    in_rows: bool = True  # in rows of sweeps and of other studies
    in_tables: bool = True  # as a column of sweep.csv

    def text(self, value: float, number: Callable[[float], str]) -> str:
        """Return a value with its unit, for people."""
        unit = {"deg": "°", "": ""}.get(self.unit, f" {self.unit}")
        return f"{number(value)}{unit}"


OUTCOME, FIRST_MOVER, FIRST_MOVED, MOVES_ON = "outcome", "first_mover", "first_moved_s", "moves_on"
DISPLACEMENT, TURN, END_SPEED, PEAK = "displacement_mm", "turn_deg", "end_speed_mm_s", "peak_deg"
LARGEST_TURN = "largest_rotation_deg"
FIRST = "first to move"
_ALL = (
    Observable(OUTCOME, _outcomes, word="outcome", choices=tuple(Response)),
    Observable(
        "largest_displacement_mm",  # of the centre of a block, in any frame
        lambda ends: None if ends.moved is None else MILLI * ends.largest(ends.moved),
        "mm",
        "peak displacement",
        "displaced_block",
        in_rows=False,
    ),
    Observable(
        "displaced_block",
        lambda ends: None if ends.moved is None else ends.names(ends.moved * ends.shapes.is_free),
        in_rows=False,
    ),
    Observable(
        LARGEST_TURN,  # in any frame
        lambda ends: None if ends.turned is None else np.degrees(ends.largest(ends.turned)),
        "deg",
        "peak rotation",
        "rotated_block",
        in_rows=False,
    ),
    Observable(
        "rotated_block",
        lambda ends: None if ends.turned is None else ends.names(ends.turned * ends.shapes.is_free),
        in_rows=False,
    ),
    Observable(FIRST_MOVER, lambda ends: [None if one is None else one.block for one in ends.first]),
    Observable(FIRST_MOVED, lambda ends: [None if one is None else one.time for one in ends.first], "s"),
    Observable(DISPLACEMENT, lambda ends: MILLI * ends.largest(ends.way), "mm", word="moved"),  # from start to end
    Observable(TURN, lambda ends: ends.largest(ends.turn_deg), "deg", word="turned"),  # from start to end
    Observable("fastest_block", lambda ends: ends.names(ends.speed), in_rows=False),
    Observable("fastest_m_s", _fastest, "m/s", in_rows=False),
    Observable(END_SPEED, lambda ends: MILLI * _fastest(ends), "mm/s"),
    Observable(MOVES_ON, lambda ends: ends.go_on(ends.speed)),
    Observable("turns_on", lambda ends: ends.go_on(ends.corner_speed), in_rows=False),
    Observable(
        PEAK,  # as largest_rotation_deg
        lambda ends: None if ends.turned is None else np.degrees(ends.largest(ends.turned)),
        "deg",
        in_runs=False,
        in_tables=False,
    ),
)
OBSERVABLES: dict[str, Observable] = {one.name: one for one in _ALL}
"""All observables by name, in the order in which they are written."""


def table_columns() -> list[str]:
    """Return the names of those that are columns of sweep.csv, those added since this module was read too."""
    return [one.name for one in OBSERVABLES.values() if one.in_rows and one.in_tables]


def observe(ends: Ends, names: Sequence[str]) -> list[dict[str, Value]]:
    """Return some observables of every scene, by name; none where there are no blocks."""
    if not ends.motion.shape[2]:
        return [{} for _ in ends.placed]
    known = {name: values for name in names if (values := OBSERVABLES[name].of(ends)) is not None}
    columns = [values.tolist() if isinstance(values, np.ndarray) else values for values in known.values()]
    return [dict(zip(known, row, strict=True)) for row in zip(*columns, strict=True)]


class Watch:
    """Follows m scenes with the same number b of blocks, in frames; a run is one of them.

    It examines nothing but the frames, and is the same wherever a run was resumed.
    """

    def __init__(
        self,
        placed: Sequence[Sequence[PlacedBody]],
        supports: Sequence[MovingSupport] = (),
        start: Floats | None = None,
    ) -> None:
        """Take blocks and supports, and where the blocks begin, (m, 3, b) in m and rad: by default as first seen."""
        count, blocks = len(placed), len(placed[0])
        self.placed, self.start = placed, start
        self.supports = supports or [AT_REST] * count
        self.shapes = BlockLengths.of(placed)
        self.first: list[FirstMove | None] = [None] * count
        self.carried = np.zeros((count, 2, blocks))  # m: way of the support, as long as a block was there
        self.moved, self.turned = np.zeros((count, blocks)), np.zeros((count, blocks))  # largest seen so far: m, rad

    def only(self, m: int) -> "Watch":
        """Return what is known of one scene."""
        one = Watch(self.placed[m : m + 1], self.supports[m : m + 1])
        one.start = None if self.start is None else self.start[m : m + 1]
        one.first, one.carried = self.first[m : m + 1], self.carried[m : m + 1]
        return one

    def follow(self, scenes: list[int], motion: Floats, times: Sequence[float]) -> None:
        """Examine some scenes: (k, 6, b) x, y, angle and their rates (SI), at times (s)."""
        if self.start is None:
            self.start = motion[:, :3].copy()
        self._carry(scenes, motion, times)
        which = slice(None) if len(scenes) == len(self.placed) else scenes  # a view is quicker
        shift = motion[:, :3] - self.start[which]
        shift[:, :2] -= self.carried[which]
        way, turn = np.hypot(shift[:, 0], shift[:, 1]), np.abs(shift[:, 2])
        self.moved[which] = np.fmax(self.moved[which], way)
        self.turned[which] = np.fmax(self.turned[which], turn)
        self._note_first(scenes, way, turn, times)

    def take_first_moves(self, steps: NDArray[np.int64], places: Floats, time_steps: Sequence[float]) -> None:
        """Take what compiled code has found on supports at rest: steps (m,), zero for none, and places (m, 3, b)."""
        assert self.start is not None  # noqa: S101 - compiled code has it from here
        scenes = np.flatnonzero(steps).tolist()
        times = [int(steps[m]) * time_steps[m] for m in scenes]
        shift = places[scenes] - self.start[scenes]
        way, turn = np.hypot(shift[:, 0], shift[:, 1]), np.abs(shift[:, 2])
        self._note_first(scenes, way, turn, times, threshold=1.0 - ROUND_OFF)

    def _carry(self, scenes: list[int], motion: Floats, times: Sequence[float]) -> None:
        """Note how far supports that move have carried the blocks that are there."""
        if not any(self.supports[m].moves for m in scenes):
            return
        ways = np.array([self.supports[m].way(time) for m, time in zip(scenes, times, strict=True)])
        is_there = ~np.isnan(motion[:, 3:4])
        self.carried[scenes] = np.where(is_there, ways[:, :, None], self.carried[scenes])

    def _note_first(
        self, scenes: list[int], way: Floats, turn: Floats, times: Sequence[float], threshold: float = 1.0
    ) -> None:
        """Note what has moved first, where nothing had before."""
        if not way.size or all(self.first[m] for m in scenes):
            return
        shares = BlockLengths._make(one[scenes] for one in self.shapes).shares(way, turn)
        for m, block, share, time in zip(scenes, shares.argmax(axis=1), shares.max(axis=1), times, strict=True):
            if share > threshold and self.first[m] is None:
                self.first[m] = FirstMove(self.placed[m][block].name, time)

    def ends(self, motion: Floats, support: Floats, seconds: Sequence[float], turned: Floats | None = None) -> Ends:
        """Return how all scenes ended: as in `Ends`; `turned` is what was seen elsewhere of rotations on the way."""
        assert self.start is not None  # noqa: S101 - the start is a frame
        self._carry([*range(len(self.placed))], motion, seconds)
        return Ends(
            self.placed, self.shapes, self.start, motion, self.carried, support, np.array(seconds), self.first, turned
        )


class Movement(BaseModel, frozen=True, extra="allow"):
    """The observables in run.json, each an attribute."""

    __pydantic_extra__: dict[str, Value] = Field(init=False)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    @classmethod
    def of(
        cls, watch: Watch, motion: Floats, support: tuple[float, float], time: float, sunk: float = 0.0
    ) -> "Movement | None":
        """Return those of a run: last frame (6, b), velocity of the support (m/s) and time (s) then, `Ends.sunk`."""
        ends = watch.ends(motion[None], np.array([support]), [time], watch.turned)
        ends = replace(ends, moved=watch.moved, sunk=sunk)
        (values,) = observe(ends, [one.name for one in OBSERVABLES.values() if one.in_runs])
        return cls(**values) if values else None

    @model_validator(mode="after")
    def _check(self) -> Self:
        """Refuse what people are told of a run where it is not there, or is no number."""
        wrong = [name for name in (OUTCOME, FIRST_MOVER, FIRST_MOVED, "fastest_m_s") if name not in self.values]
        wrong += [one.name for one in OBSERVABLES.values() if one.unit and isinstance(self.values.get(one.name), str)]
        if wrong:
            raise PydanticCustomError("movement", "{name} is missing, or is no number", {"name": wrong[0]})
        return self

    @property
    def values(self) -> dict[str, Value]:
        """All by name."""
        return self.__pydantic_extra__

    @property
    def row(self) -> dict[str, Value]:
        """Those that stand in the row of a case."""
        values = self.values | {PEAK: self.values[LARGEST_TURN]}
        return {name: values[name] for name, one in OBSERVABLES.items() if one.in_rows and name in values}

    def lines(self, number: Callable[[float], str]) -> Iterator[tuple[str, str]]:
        """Yield titles and texts of what people want to know, with units and blocks."""
        yield OUTCOME, str(self.values[OUTCOME] or "no outcome")
        for one in OBSERVABLES.values():
            value = self.values.get(one.name)
            if one.title and value is not None:
                block = f" (block {self.values[one.block]})" if one.block else ""
                yield one.title, one.text(float(value), number) + block
        if self.values[FIRST_MOVER] is not None:
            yield FIRST, f"block {self.values[FIRST_MOVER]} at {self.values[FIRST_MOVED]:.3f} s"
