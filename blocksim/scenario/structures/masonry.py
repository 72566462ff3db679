"""Structures of equal blocks: stacks, staircases, walls, pyramids, dominoes and grids.

Courses of walls may have closed ends, and openings with lintels: which pieces of blocks lie in each course.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator

from blocksim.scenario import units as q
from blocksim.scenario.models import base, geometry
from blocksim.scenario.models.base import setting
from blocksim.scenario.structures.base import Count, Courses, Pose, Seed, Structure, UnfitError, draws, poses_at

LEAST = 0.2  # of a block: a shorter piece beside a cut becomes part of its neighbour
SAME = 1e-9  # of a block: lengths that differ by no more are the same


class Opening(base.Table):
    """A rectangle without blocks, which are cut at its sides. A lintel lies in the course above it, in the middle."""

    left: q.NonNegativeLength = setting("its left side, from the left end of the wall")
    bottom: q.NonNegativeLength = setting("its lower side above the foot of the wall, whole courses", 0.0)
    width: q.PositiveLength = setting("its width")
    height: q.PositiveLength = setting("its height, whole courses")
    lintel: q.PositiveLength | None = setting("length of the block that lies over it; none if it is not given", None)

    def _check(self) -> None:
        if self.lintel is not None and self.lintel <= self.width:
            message = f"a lintel of {1e3 * self.lintel:g} mm does not reach over {1e3 * self.width:g} mm"
            raise q.invalid(message, "lintel")


class Piece(NamedTuple):
    """A block, whole or cut, from `left` to `right` (m from the end of the wall) in a course from 0."""

    course: int
    left: float
    right: float


class _Cut(NamedTuple):
    """What is taken out of a course, and the lintel that lies there instead."""

    left: float
    right: float
    lintel: Piece | None = None


def closed_course(course: int, columns: int, width: float, gap: float, *, is_shifted: bool) -> list[Piece]:
    """Return a course of a wall with straight ends; one that is shifted by half a block has a half at both ends."""
    pitch = width + gap
    if not is_shifted:
        return [Piece(course, k * pitch, k * pitch + width) for k in range(columns)]
    half = 0.5 * (width - gap)
    inner = [Piece(course, (k + 0.5) * pitch, (k + 0.5) * pitch + width) for k in range(columns - 1)]
    end = columns * pitch - gap
    return [Piece(course, 0.0, half), *inner, Piece(course, end - half, end)]


def cut_courses(
    courses: Sequence[list[Piece]], openings: Sequence[Opening], width: float, height: float, gap: float
) -> list[Piece]:
    """Return the pieces of all courses (blocks of a width and height, m), course by course, each from left to right.

    Raises UnfitError for openings that end within a course, reach out of the wall or into each other.
    """
    end = max(piece.right for course in courses for piece in course)
    wall = f"the wall, which is {end:g} m long and {len(courses) * height:g} m high"
    cuts: list[list[_Cut]] = [[] for _ in courses]
    for number, one in enumerate(openings):
        first, last = (_whole(one, key, height) for key in ("bottom", "height"))
        last += first
        if last > len(courses) or one.left + one.width > end * (1.0 + SAME):
            raise UnfitError("openings", f"opening {number + 1} reaches out of {wall}")
        for course in range(first, last):
            cuts[course].append(_Cut(one.left, one.left + one.width))
        if one.lintel is not None:
            left = one.left + 0.5 * (one.width - one.lintel)
            if last == len(courses) or left < -SAME * end or left + one.lintel > end * (1.0 + SAME):
                raise UnfitError("openings", f"the lintel of opening {number + 1} reaches out of {wall}")
            lintel = Piece(last, left, left + one.lintel)
            cuts[last].append(_Cut(left - gap, lintel.right + gap, lintel))
    found: list[Piece] = []
    for pieces, some in zip(courses, cuts, strict=True):
        own = sorted(some, key=attrgetter("left"))
        if any(one.right > other.left for one, other in pairwise(own)):
            raise UnfitError("openings", "openings or lintels reach into each other")
        lintels = [cut.lintel for cut in own if cut.lintel is not None]
        found += sorted([*_left_over(pieces, own, width, gap), *lintels])
    if not found:
        raise UnfitError("openings", f"nothing is left of {wall}; make an opening smaller")
    return found


def _whole(opening: Opening, key: str, height: float) -> int:
    """Return a length of an opening in courses."""
    value: float = getattr(opening, key)
    courses = round(value / height)
    if abs(value - courses * height) > SAME * height * max(1, courses):
        message = f"{key} = {1e3 * value:g} mm ends within a course; courses are {1e3 * height:g} mm high"
        raise UnfitError("openings", message)
    return courses


def _left_over(course: Sequence[Piece], cuts: Sequence[_Cut], width: float, gap: float) -> list[Piece]:
    """Return what is left of a course beside its cuts; short pieces become part of their neighbours."""
    parts = list(course)
    for cut in cuts:
        sides = ((one.course, *ends) for one in parts for ends in _outside(one, cut))
        parts = [Piece(*side) for side in sides if side[2] - side[1] > SAME * width]
    joined: list[Piece] = []
    for part in parts:
        before = joined[-1] if joined else None
        is_short = before is not None and min(before.right - before.left, part.right - part.left) < LEAST * width
        if before is not None and is_short and part.left - before.right <= gap + SAME * width:
            joined[-1] = before._replace(right=part.right)
        else:
            joined.append(part)
    return joined


def _outside(piece: Piece, cut: _Cut) -> list[tuple[float, float]]:
    """Return the parts of a piece on both sides of a cut."""
    if cut.right <= piece.left or cut.left >= piece.right:
        return [(piece.left, piece.right)]
    return [(piece.left, min(piece.right, cut.left)), (max(piece.left, cut.right), piece.right)]


class Stack(Structure):
    """Block i (from 0) has its left edge at left + i offset and its lower edge at bottom + i size_y."""

    kind: Literal["stack"] = setting("kind of structure")
    count: Count = setting("number of blocks")
    offset: q.Length = setting("shift of each block relative to the one below", 0.0)

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses from the ground up."""
        return _pile(self, block, self.count, self.offset)


def _pile(structure: Structure, block: geometry.Block, count: int, step: float) -> Sequence[Pose]:
    """Return the poses of blocks on one another, from the ground up, each a step (m) farther along x."""
    first = structure.left + block.size_x / 2
    return [Pose(first + i * step, structure.bottom + (i + 0.5) * block.size_y) for i in range(count)]


class Staircase(Structure):
    """Block i (from 0) has its left edge at left + i (size_x - overlap) and its lower edge at bottom + i size_y."""

    kind: Literal["staircase"] = setting("kind of structure")
    count: Count = setting("number of blocks")
    overlap: q.PositiveLength = setting("length over which a block lies on the one below")

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses from the ground up."""
        if self.overlap > block.size_x:
            message = f"{self.overlap * 1e3:g} mm is more than the block's {block.size_x * 1e3:g} mm along x"
            raise UnfitError("overlap", message)
        return _pile(self, block, self.count, block.size_x - self.overlap)


Bond = Annotated[Literal["running", "stack"], base.OneOf(("running", "stack"))]
Ends = Annotated[Literal["toothed", "flush"], base.OneOf(("toothed", "flush"))]


def _hole(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise q.invalid(f"{q.toml(value)} is not a hole; write [row, column], counted from 1 at the lower left")
    return value


Hole = Annotated[tuple[Count, Count], BeforeValidator(_hole)]


class BlockWall(Courses):
    """Block j of course i (both from 0) begins at x = left + j (size_x + gap) and y = bottom + i size_y.

    In running bond every second course is shifted to the right by half of that distance; all courses have whole blocks
    and the same number of them, so that the ends are toothed; flush ends are closed by halves. A missing block does not
    support the ones above, which fall into the hole as far as their neighbours allow. Blocks are cut at openings.
    """

    kind: Literal["wall"] = setting("kind of structure")
    columns: Count = setting("number of blocks in a course")
    bond: Bond = setting("running: every second course is shifted by half a block; stack: none is", "running")
    gap: q.NonNegativeLength = setting("gap between neighbours in a course", 0.0)
    ends: Ends = setting("toothed: whole blocks only; flush: halves close every second course", "toothed")
    openings: tuple[Opening, ...] = setting("openings, at which blocks are cut, with lintels", ())
    holes: tuple[Hole, ...] = setting("blocks to leave out, [row, column] from 1, the lowest and leftmost first", ())
    missing: q.Share = setting("share of the other blocks to leave out at random", 0.0)
    offset: q.NonNegativeLength = setting(
        "largest random shift of a block along x, to either side; at most half of the gap", 0.0
    )
    seed: Seed = setting("random seed of shifts and blocks left out", 0)

    def _check(self) -> None:
        super()._check()
        seen = set()
        for number, (row, column) in enumerate(self.holes):
            if row > self.rows or column > self.columns:
                message = f"[{row}, {column}] is outside a wall of {self.rows} rows and {self.columns} columns"
                raise q.invalid(message, "holes", number)
            if (row, column) in seen:
                raise q.invalid(f"[{row}, {column}] is left out twice", "holes", number)
            seen.add((row, column))
        cut = "openings" if self.openings else "ends" if self.ends == "flush" else ""
        random = next((key for key in ("holes", "missing", "offset") if getattr(self, key)), "")
        if cut and random:
            raise q.invalid(f"this is for walls of whole blocks; leave it or {cut} out", random)
        if self.size == 0:
            message = "this wall has no block left"
            raise q.invalid(message, "holes" if len(self.holes) == self.rows * self.columns else "missing")
        if self.offset > 0.5 * self.gap:
            message = (
                f"two neighbours shifted by {self.offset * 1e3:g} mm could overlap; "
                f"at most half of the gap, {0.5e3 * self.gap:g} mm, is allowed"
            )
            raise q.invalid(message, "offset")

    @property
    def size(self) -> int:
        """Number of blocks that are not left out; where blocks are cut at most so many."""
        if self.is_cut:
            return (self.rows + 1) * (self.columns + 2 + 2 * len(self.openings))
        others = self.rows * self.columns - len(self.holes)
        return others - round(self.missing * others)

    @property
    def is_cut(self) -> bool:
        """Whether some blocks are not whole."""
        return bool(self.openings) or self.ends == "flush"

    def _cut(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses of a wall with blocks that are cut."""
        width, height = block.size_x, block.size_y
        if block.polygon:
            raise UnfitError("block", "only rectangular blocks can be cut; give width, height and length")
        courses = []
        for row in range(self.rows):
            is_shifted = self.bond == "running" and row % 2 == 1
            course = closed_course(row, self.columns, width, self.gap, is_shifted=is_shifted and self.ends == "flush")
            shift = 0.5 * (width + self.gap) if is_shifted and self.ends != "flush" else 0.0
            courses.append([Piece(row, piece.left + shift, piece.right + shift) for piece in course])
        pieces = cut_courses(courses, self.openings, width, height, self.gap)
        return [
            Pose(self.left + 0.5 * (one.left + one.right), self.bottom + (one.course + 0.5) * height,
                 width=one.right - one.left)
            for one in pieces
        ]  # fmt: skip

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses course by course, each from left to right."""
        if self.is_cut:
            return self._cut(block)
        random = draws(self.seed, 2, self.rows, self.columns)
        pitch = block.size_x + self.gap
        row, column = np.indices((self.rows, self.columns))
        shift = np.where(row % 2 == 1, 0.5 * pitch, 0.0) if self.bond == "running" else np.zeros(row.shape)
        x = self.left + 0.5 * block.size_x + column * pitch + shift + self.offset * (2.0 * random[0] - 1.0)
        y = self.bottom + (row.astype(np.float64) + 0.5) * block.size_y
        kept = np.ones(row.shape, dtype=np.bool_)
        for hole_row, hole_column in self.holes:
            kept[hole_row - 1, hole_column - 1] = False
        others = np.flatnonzero(kept)
        lowest = np.argsort(random[1].ravel()[others], kind="stable")[: round(self.missing * others.size)]
        kept.ravel()[others[lowest]] = False
        return poses_at(x[kept], y[kept])


class Pyramid(Courses):
    """Course i (from 0) has rows - i blocks, each in the middle above two of the course below."""

    kind: Literal["pyramid"] = setting("kind of structure")
    gap: q.NonNegativeLength = setting("gap between neighbours in a course", 0.0)

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.rows * (self.rows + 1) // 2

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses course by course, each from left to right."""
        row = np.repeat(np.arange(self.rows), np.arange(self.rows, 0, -1))
        column = np.concatenate([np.arange(count) for count in range(self.rows, 0, -1)])
        pitch = block.size_x + self.gap
        x = self.left + 0.5 * block.size_x + (column + 0.5 * row) * pitch
        y = self.bottom + (row.astype(np.float64) + 0.5) * block.size_y
        return poses_at(x, y)


class Dominoes(Structure):
    """Block i (from 0) has its left edge at left + i (size_x + spacing).

    A push turns the first domino about its lower edge on the side that it falls to, without slip: its centre moves
    along x at the speed of the push and rises at push size_x / size_y, its spin is 2 push / size_y.
    """

    stacked_by = None
    kind: Literal["dominoes"] = setting("kind of structure")
    count: Count = setting("number of blocks")
    spacing: q.PositiveLength = setting("clear distance between neighbours")
    push: q.Speed = setting("speed along x of the centre of the first domino, which turns about its lower edge", 0.0)

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses from left to right."""
        pitch, y = block.size_x + self.spacing, self.bottom + 0.5 * block.size_y
        rise, spin = abs(self.push) * block.size_x / block.size_y, -2.0 * self.push / block.size_y
        first = Pose(self.left + 0.5 * block.size_x, y, vx=self.push, vy=rise, spin=spin)
        return [first, *(Pose(first.x + i * pitch, y) for i in range(1, self.count))]


class Grid(Courses):
    """Place j of row i (both from 0) begins at x = left + j (size_x + gap_x) and y = bottom + i (size_y + gap_y).

    Each block is shifted along x and along y and turned by random amounts of up to `offset` and `turn`, to either side.
    """

    counted_by = ("rows", "columns")
    kind: Literal["grid"] = setting("kind of structure")
    columns: Count = setting("number of blocks in a row")
    gap_x: q.NonNegativeLength = setting("gap between neighbours along x, before they are shifted and turned")
    gap_y: q.NonNegativeLength = setting("gap between neighbours along y, before they are shifted and turned")
    offset: q.NonNegativeLength = setting("largest random shift of a block along x and along y, to either side", 0.0)
    turn: q.HalfTurn = setting("largest random angle of a block, to either side", 0.0)
    seed: Seed = setting("random seed of shifts and angles", 0)

    def height(self, block: geometry.Block) -> float:
        """All rows, before blocks are shifted and turned."""
        return self.rows * block.size_y + (self.rows - 1) * self.gap_y

    def place(self, block: geometry.Block) -> Sequence[Pose]:
        """Return the poses row by row, each from left to right."""
        needs = {  # gaps in which two neighbours, shifted and turned towards each other, cannot overlap
            "gap_x": (self.columns, self.gap_x, _growth(block.size_x, block.size_y, self.turn)),
            "gap_y": (self.rows, self.gap_y, _growth(block.size_y, block.size_x, self.turn)),
        }
        for key, (count, gap, growth) in needs.items():
            least = 2.0 * self.offset + growth
            if count > 1 and gap < least:
                message = f"{gap * 1e3:g} mm is too small for such random shifts and angles"
                raise UnfitError(key, f"{message}; at least {least * 1e3:g} mm is needed")
        shift_x, shift_y, turn = 2.0 * draws(self.seed, 3, self.rows, self.columns) - 1.0
        row, column = np.indices((self.rows, self.columns))
        x = self.left + 0.5 * block.size_x + column * (block.size_x + self.gap_x) + self.offset * shift_x
        y = self.bottom + 0.5 * block.size_y + row * (block.size_y + self.gap_y) + self.offset * shift_y
        return poses_at(x, y, self.turn * turn)


def _growth(side: float, other: float, turn: float) -> float:
    """Return the largest growth (m) of a rectangle along a side when it is turned by up to `turn` (rad)."""
    widest = min(turn, math.atan2(other, side))
    return side * math.cos(widest) + other * math.sin(widest) - side
