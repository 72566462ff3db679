"""How far blocks have moved, in what way, and which of them first.

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
where some block, as fast as it is then, would be farther than that hundredth away within another tenth of the time. The
first mover is the block that has moved in the first frame in which any has (the farthest of several); members of
ensembles keep no frames, but are looked at when those would be recorded, until one block has moved.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from blocksim.scenario import PlacedBody
from blocksim.simulation.moving_support import AT_REST, MovingSupport
from blocksim.simulation.table import MILLI, Columns

ROUND_OFF = 1e-9  # between two ways to compute a distance
MOVED_SHARE = 0.01  # of the shortest side
FURTHER = 0.1  # of the simulated time
FALLEN_TURN = np.radians(45.0)
FALLEN_SHARE = 0.5  # of the shortest side, downwards
Floats = NDArray[np.float64]
Way = tuple[float, float]  # m, along x and y
RESTED: Way = (0.0, 0.0)


class Manner(StrEnum):
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


class EndSpeed(NamedTuple):
    """The fastest block at the end, its speed (m/s), whether any block moves on, and whether any turns on."""

    block: str
    speed: float
    moves_on: bool
    turns_on: bool = False


class Movement(BaseModel, frozen=True):
    """The entries of run.json about movement, in frames and at the end; blocks by name."""

    outcome: Manner
    largest_displacement_mm: float  # of the centre of a block that can move, from its start, relative to the support
    displaced_block: str
    largest_rotation_deg: float
    rotated_block: str
    first_mover: str | None = None
    first_moved_s: float | None = None  # time of the first frame in which it had moved
    fastest_block: str | None = None  # at the end; None in runs of earlier versions
    fastest_m_s: float | None = None  # its speed relative to the support, or that of its corners by its spin
    moves_on: bool | None = None
    turns_on: bool | None = None

    @property
    def first_move(self) -> FirstMove | None:
        """Both entries together."""
        if self.first_mover is None or self.first_moved_s is None:
            return None
        return FirstMove(self.first_mover, self.first_moved_s)

    @property
    def end_speed(self) -> EndSpeed | None:
        """The three entries about the end together."""
        if self.fastest_block is None or self.fastest_m_s is None or self.moves_on is None:
            return None
        return EndSpeed(self.fastest_block, self.fastest_m_s, self.moves_on, bool(self.turns_on))


class _Shapes(NamedTuple):
    """Lengths of b blocks (m), and which can move; of m scenes (m, b)."""

    shortest: Floats
    reach: Floats  # half a diagonal
    is_free: NDArray[np.bool_]

    def split(self, count: int) -> "_Shapes":
        """Return those of so many scenes, which are here one after the other."""
        shape = (count, -1)
        return _Shapes(self.shortest.reshape(shape), self.reach.reshape(shape), self.is_free.reshape(shape))

    def chosen(self, scenes: list[int]) -> "_Shapes":
        """Return those of some scenes."""
        return _Shapes(self.shortest[scenes], self.reach[scenes], self.is_free[scenes])


def _shapes_of(placed: Sequence[PlacedBody]) -> _Shapes:
    sides = np.array([(body.size_x, body.size_y) for body in placed], dtype=np.float64).reshape(-1, 2)
    is_free = np.array([not body.fixed or body.freed for body in placed], dtype=np.bool_)
    shortest, reach = sides.min(axis=1), 0.5 * np.hypot(*sides.T)
    for number, body in enumerate(placed):
        if body.outline:
            shortest[number], reach[number] = body.least_width, body.radius
    return _Shapes(shortest, reach, is_free)


def _shares(shapes: _Shapes, way: Floats, turn: Floats) -> Floats:
    """Return how far blocks, (b,) or (m, b), are from their start, in units of the threshold: above 1 is moved."""
    shares = np.fmax(way, turn * shapes.reach) / (MOVED_SHARE * shapes.shortest)
    shares[np.isnan(shares)] = np.inf
    return np.where(shapes.is_free, shares, 0.0)


def _manner(shapes: _Shapes, way: Floats, drop: Floats, turn: Floats) -> Manner:
    fallen = shapes.is_free & ((turn > FALLEN_TURN) | (drop > FALLEN_SHARE * shapes.shortest))
    if fallen.any():
        return Manner.FELL
    return Manner.SLID if (_shares(shapes, way, turn) > 1.0).any() else Manner.STANDS


def end_speeds(
    placed: Sequence[Sequence[PlacedBody]], motion: Floats, support: Floats, seconds: Sequence[float]
) -> list[EndSpeed]:
    """Return which blocks are fastest at the ends of m scenes with b blocks each.

    `motion` is (m, 6, b) as MOTION, `support` (m, 2) the velocities of ground and walls (m/s), `seconds` how long each
    was simulated.
    """
    shapes = _shapes_of([body for bodies in placed for body in bodies]).split(len(placed))
    velocity = np.hypot(motion[:, 3] - support[:, :1], motion[:, 4] - support[:, 1:])
    turning = np.where(shapes.is_free, np.abs(motion[:, 5]) * shapes.reach, 0.0)
    speed = np.where(shapes.is_free, np.fmax(velocity, turning), 0.0)
    later, threshold = FURTHER * np.asarray(seconds)[:, None], MOVED_SHARE * shapes.shortest
    moves_on = np.any(later * speed > threshold, axis=1).tolist()
    turns_on = np.any(later * turning > threshold, axis=1).tolist()
    fastest = np.nanargmax(np.where(np.isnan(speed), -1.0, speed), axis=1).tolist()
    return [
        EndSpeed(bodies[block].name, float(speed[m, block]), moves_on[m], turns_on[m])
        for m, (bodies, block) in enumerate(zip(placed, fastest, strict=True))
    ]


def from_start_to_end(
    placed: Sequence[PlacedBody],
    final: Columns,
    first: FirstMove | None,
    carried: Way = RESTED,
    start: Floats | None = None,
    *,
    turns_on: bool = False,
) -> tuple[Manner, float, float]:
    """Return manner, largest displacement of a centre (mm) and largest rotation (degrees), of a final table.

    `first` is the first move on the way, if there was any: it distinguishes what rocked back from what stands.
    `carried` is the way (m) of the support; of blocks that were removed on the way it is not known, and taken as none.
    `start` is where blocks have settled before time zero, (3, b) as x, y (m), angle (rad); without it they began as
    placed. `turns_on` says whether some block turns on at the end.
    """
    shapes = _shapes_of(placed)
    is_there = ~np.isnan(np.array(final["vx_mm_s"], dtype=np.float64))
    drawn = np.array([(body.x, body.y, body.angle) for body in placed], dtype=np.float64).reshape(-1, 3).T
    x, y, angle = drawn if start is None else start
    dx = np.array(final["x_mm"]) / MILLI - x - carried[0] * is_there
    dy = np.array(final["y_mm"]) / MILLI - y - carried[1] * is_there
    turn = np.abs(np.array(final["rotation_deg"]) - np.degrees(angle - drawn[2]))
    way = np.hypot(dx, dy)
    manner = _with_way_there(_manner(shapes, way, -dy, np.radians(turn)), first, turns_on=turns_on)
    return manner, float(MILLI * (way * shapes.is_free).max()), float((turn * shapes.is_free).max())


def _with_way_there(manner: Manner, first: FirstMove | None, *, turns_on: bool) -> Manner:
    """Return the manner of an end, given what moved before it, and whether some block turns on."""
    if manner is Manner.SLID and turns_on:
        return Manner.ROCKING
    return Manner.ROCKED if manner is Manner.STANDS and first is not None else manner


class FirstMoves:
    """The first moves in m scenes with the same number b of blocks, advanced together."""

    def __init__(
        self, placed: Sequence[Sequence[PlacedBody]], start: Floats, supports: Sequence[MovingSupport] = ()
    ) -> None:
        """Take the blocks of every scene, where they begin, (m, 3, b): x, y (m), angle (rad), and their supports."""
        self.placed, self.start = placed, start
        self.supports = supports or [AT_REST] * len(placed)
        self.shapes = _shapes_of([body for bodies in placed for body in bodies]).split(len(placed))
        self.found: list[FirstMove | None] = [None] * len(placed)

    @property
    def thresholds(self) -> Floats:
        """Distance (m) of every block, (m, b), beyond which it has moved; infinite for fixed ones."""
        return np.where(self.shapes.is_free, MOVED_SHARE * self.shapes.shortest, np.inf)

    def take(self, steps: NDArray[np.int64], places: Floats, time_steps: Sequence[float]) -> None:
        """Take what compiled code has found: steps (m,), zero for none, places then (m, 3, b); steps in s."""
        which = np.flatnonzero(steps).tolist()
        times = [int(steps[m]) * time_steps[m] for m in which]
        self.see(which, places[which], times, threshold=1.0 - ROUND_OFF)

    def see(self, scenes: list[int], position: Floats, times: list[float], *, threshold: float = 1.0) -> None:
        """Examine some scenes, at positions (k, 3, b) and times (s); those that have moved before stay as they are."""
        carried = np.array([self.supports[m].way(time) for m, time in zip(scenes, times, strict=True)]).reshape(-1, 2)
        dx, dy, angle = (position - self.start[scenes]).swapaxes(0, 1)
        dx, dy = dx - carried[:, :1], dy - carried[:, 1:]
        shares = _shares(self.shapes.chosen(scenes), np.hypot(dx, dy), np.abs(angle))
        for m, block, share, time in zip(scenes, shares.argmax(axis=1), shares.max(axis=1), times, strict=True):
            if share > threshold and self.found[m] is None:
                self.found[m] = FirstMove(self.placed[m][block].name, time)


class Watch:
    """Follows the frames of a run; it examines nothing else, and is the same wherever a run was resumed."""

    def __init__(self, placed: Sequence[PlacedBody], support: MovingSupport = AT_REST) -> None:
        """Take the blocks and their support; the first frame that is seen says where they begin."""
        self.placed, self.shapes, self.support = placed, _shapes_of(placed), support
        self.carried = np.zeros((2, len(placed)))  # m: way of the support, as long as a block was there
        self.start: Floats | None = None
        self.way, self.turn = np.zeros(len(placed)), np.zeros(len(placed))  # largest so far: m, rad
        self.first: FirstMove | None = None
        self.manner = Manner.STANDS  # in the last frame
        self.last: tuple[Floats, float] | None = None  # motion and time of it

    def see(self, motion: Floats, time: float) -> None:
        """Look at a frame: (6, b) as MOTION, at a time (s)."""
        self.last = motion, time
        if self.start is None:
            self.start = motion[:3].copy()
        if self.support.moves:
            is_there = ~np.isnan(motion[3])
            self.carried[:, is_there] = np.array(self.support.way(time))[:, None]
        dx, dy, angle = motion[:3] - self.start
        dx, dy = dx - self.carried[0], dy - self.carried[1]
        way, turn = np.hypot(dx, dy), np.abs(angle)
        self.way, self.turn = np.fmax(self.way, way), np.fmax(self.turn, turn)
        self.manner = _manner(self.shapes, way, -dy, turn)
        if self.first is None and self.placed:
            shares = _shares(self.shapes, way, turn)
            most = int(np.argmax(shares))
            self.first = FirstMove(self.placed[most].name, time) if shares[most] > 1.0 else None

    def found(self, support: tuple[float, float] = (0.0, 0.0)) -> Movement:
        """Return what was seen of the blocks, one at least, given the velocity (m/s) of ground and walls at the end."""
        assert self.last is not None  # noqa: S101 - the start is a frame
        motion, time = self.last
        (end,) = end_speeds([self.placed], motion[None], np.array([support]), [time])
        far, turned = (int(np.argmax(most * self.shapes.is_free)) for most in (self.way, self.turn))
        return Movement(
            outcome=_with_way_there(self.manner, self.first, turns_on=end.turns_on),
            largest_displacement_mm=float(MILLI * self.way[far] * self.shapes.is_free[far]),
            displaced_block=self.placed[far].name,
            largest_rotation_deg=float(np.degrees(self.turn[turned] * self.shapes.is_free[turned])),
            rotated_block=self.placed[turned].name,
            first_mover=None if self.first is None else self.first.block,
            first_moved_s=None if self.first is None else self.first.time,
            fastest_block=end.block,
            fastest_m_s=end.speed,
            moves_on=end.moves_on,
            turns_on=end.turns_on,
        )
