"""Courses whose ends are closed, and openings in them with lintels: which pieces of blocks lie in each course."""

from collections.abc import Sequence
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

from blocksim.scenario import units as q
from blocksim.scenario.models.base import Table, setting
from blocksim.scenario.structures.base import UnfitError

LEAST = 0.2  # of a block: a shorter piece beside a cut becomes part of its neighbour
SAME = 1e-9  # of a block: lengths that differ by no more are the same


class Opening(Table):
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
