"""How far blocks have moved, in what way, and which of them first.

A block has moved where its centre, or a corner by its turn, is more than a hundredth of its shortest side away from
where it started. It has fallen where it is turned by more than 45 degrees, or its centre is lower by more than half its
shortest side. A scene

    stands       where no block has moved at the end,
    rocked back  where none has at the end, but some had in a frame on the way,
    slid         where some block has moved and none has fallen,
    fell         where some block has fallen.

Fixed blocks do not count. A run that `time.end` cuts short is reported as it is then. Ends
alone tell all but "rocked back": a sweep keeps no frames, and says "stands" there.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from blocksim.scenario import PlacedBody
from blocksim.simulation.table import MILLI, Columns

MOVED_SHARE = 0.01  # of the shortest side
FALLEN_TURN = np.radians(45.0)
FALLEN_SHARE = 0.5  # of the shortest side, downwards
Floats = NDArray[np.float64]


class Manner(StrEnum):
    """What a scene came to."""

    STANDS = "stands"
    ROCKED = "rocked back"
    SLID = "slid"
    FELL = "fell"


class Movement(BaseModel, frozen=True):
    """The entries of run.json about movement, in frames and at the end; blocks by name."""

    outcome: Manner
    largest_displacement_mm: float  # of a centre, from its start
    displaced_block: str
    largest_rotation_deg: float
    rotated_block: str
    first_mover: str | None = None
    first_moved_s: float | None = None  # time of the first frame in which it had moved


class _Shapes(NamedTuple):
    """Sides of b blocks, m; where they began, (3, b): x, y (m), angle (rad)."""

    shortest: Floats
    reach: Floats  # half a diagonal
    is_free: NDArray[np.bool_]


def _shapes_of(placed: Sequence[PlacedBody]) -> _Shapes:
    sides = np.array([(body.size_x, body.size_y) for body in placed], dtype=np.float64).reshape(-1, 2)
    is_free = np.array([not body.fixed for body in placed], dtype=np.bool_)
    return _Shapes(sides.min(axis=1), 0.5 * np.hypot(*sides.T), is_free)


def _shares(shapes: _Shapes, way: Floats, turn: Floats) -> Floats:
    """Return how far (b,) blocks are from their start, in ways that count as moved."""
    shares = np.fmax(way, turn * shapes.reach) / (MOVED_SHARE * shapes.shortest)
    return np.where(shapes.is_free, np.nan_to_num(shares, nan=np.inf), 0.0)


def _manner(shapes: _Shapes, way: Floats, drop: Floats, turn: Floats) -> Manner:
    fallen = shapes.is_free & ((turn > FALLEN_TURN) | (drop > FALLEN_SHARE * shapes.shortest))
    if fallen.any():
        return Manner.FELL
    return Manner.SLID if (_shares(shapes, way, turn) > 1.0).any() else Manner.STANDS


def from_start_to_end(placed: Sequence[PlacedBody], final: Columns) -> tuple[Manner, float, float]:
    """Return manner, largest displacement of a centre (mm) and largest rotation (degrees), of a final table alone."""
    shapes = _shapes_of(placed)
    dx = np.array(final["x_mm"]) / MILLI - [body.x for body in placed]
    dy = np.array(final["y_mm"]) / MILLI - [body.y for body in placed]
    turn = np.abs(np.array(final["rotation_deg"]))
    way = np.hypot(dx, dy)
    return _manner(shapes, way, -dy, np.radians(turn)), float(MILLI * way.max()), float(turn.max())


class Watch:
    """Follows the frames of a run; it examines nothing else, and is the same wherever a run was resumed."""

    def __init__(self, placed: Sequence[PlacedBody]) -> None:
        """Take the blocks; the first frame that is seen says where they begin."""
        self.placed, self.shapes = placed, _shapes_of(placed)
        self.start: Floats | None = None
        self.way, self.turn = np.zeros(len(placed)), np.zeros(len(placed))  # largest so far: m, rad
        self.first: tuple[str, float] | None = None
        self.manner = Manner.STANDS  # in the last frame

    def see(self, motion: Floats, time: float) -> None:
        """Look at a frame: (6, b) as MOTION, at a time (s)."""
        if self.start is None:
            self.start = motion[:3].copy()
        dx, dy, angle = motion[:3] - self.start
        way, turn = np.hypot(dx, dy), np.abs(angle)
        self.way, self.turn = np.fmax(self.way, way), np.fmax(self.turn, turn)
        self.manner = _manner(self.shapes, way, -dy, turn)
        if self.first is None:
            shares = _shares(self.shapes, way, turn)
            most = int(np.argmax(shares))
            self.first = (self.placed[most].name, time) if shares[most] > 1.0 else None

    def found(self) -> Movement:
        """Return what was seen."""
        far, turned = int(np.argmax(self.way)), int(np.argmax(self.turn))
        rocked = self.manner is Manner.STANDS and self.first is not None
        return Movement(
            outcome=Manner.ROCKED if rocked else self.manner,
            largest_displacement_mm=float(MILLI * self.way[far]),
            displaced_block=self.placed[far].name,
            largest_rotation_deg=float(np.degrees(self.turn[turned])),
            rotated_block=self.placed[turned].name,
            first_mover=None if self.first is None else self.first[0],
            first_moved_s=None if self.first is None else self.first[1],
        )
