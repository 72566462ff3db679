"""Loads of blocks at rest: every block passes its weight, and that of the blocks on it, to its supports.

A block stands on blocks whose upper faces are as high as its lower one, or else on the ground. Blocks are taken from
above downwards, so that all loads on a block are known before it passes its own on. Of more than one support
the two outermost share the load by the lever; each touches along an interval whose two ends share its part by the lever
too. Turned blocks count as their bounding boxes.
"""

import math
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from blocksim.scenario import PlacedBody
from blocksim.scenario.outlines import box_of as corners_box
from blocksim.scenario.placement import smallest_width

TOUCHING = 1e-3  # of the smallest side: faces that near to each other touch


class Box(NamedTuple):
    """A block from outside (m)."""

    left: float
    right: float
    bottom: float
    top: float


class Load(NamedTuple):
    """Load of one end of an interval of contact: `lower` is None for the ground."""

    upper: int
    lower: int | None
    x: float  # m
    force: float  # N


class _Carried:
    """Force (N) and moment (N m) about x = 0 that have come down upon a block, its own weight first."""

    def __init__(self, weight: float, x: float) -> None:
        self.force, self.moment = weight, weight * x

    def add(self, force: float, x: float) -> None:
        self.force += force
        self.moment += force * x

    @property
    def x(self) -> float:
        return self.moment / self.force if self.force > 0.0 else 0.0


def box_of(body: PlacedBody) -> Box:
    """Return the bounding box of a block."""
    if body.outline:
        return _box_of_outline(body)
    c, s = abs(math.cos(body.angle)), abs(math.sin(body.angle))
    half_x, half_y = 0.5 * (c * body.size_x + s * body.size_y), 0.5 * (s * body.size_x + c * body.size_y)
    return Box(body.x - half_x, body.x + half_x, body.y - half_y, body.y + half_y)


def _box_of_outline(body: PlacedBody) -> Box:
    c, s = math.cos(body.angle), math.sin(body.angle)
    (left, bottom), (right, top) = corners_box([(c * x - s * y, s * x + c * y) for x, y in body.outline])
    return Box(body.x + left, body.x + right, body.y + bottom, body.y + top)


def loads_at_rest(placed: Sequence[PlacedBody], gravity: float) -> Iterator[Load]:
    """Yield what the ends of all contacts below free blocks carry, from above downwards."""
    boxes = [box_of(body) for body in placed]
    below = _Below(boxes, TOUCHING * smallest_width(placed))
    carried = [_Carried(body.mass * gravity, body.x) for body in placed]
    for upper in sorted(range(len(placed)), key=lambda i: -boxes[i].bottom):
        if not placed[upper].fixed:
            for load in _handed_on(upper, boxes, below.supports(upper), carried[upper]):
                yield load
                if load.lower is not None:
                    carried[load.lower].add(load.force, load.x)


def _handed_on(upper: int, boxes: Sequence[Box], supports: Sequence[int], carried: _Carried) -> Iterator[Load]:
    box = boxes[upper]
    if not supports:
        yield from _ends(upper, None, (box.left, box.right), carried.force, carried.x)
        return
    spans = sorted((max(box.left, boxes[i].left), min(box.right, boxes[i].right), i) for i in supports)
    if len(spans) == 1:
        yield from _ends(upper, spans[0][2], spans[0][:2], carried.force, carried.x)
        return
    first, last = spans[0], spans[-1]
    one, two = 0.5 * (first[0] + first[1]), 0.5 * (last[0] + last[1])
    share = _lever(one, two, carried.x)
    yield from _ends(upper, first[2], first[:2], (1.0 - share) * carried.force, one)
    yield from _ends(upper, last[2], last[:2], share * carried.force, two)


def _ends(upper: int, lower: int | None, span: tuple[float, float], force: float, x: float) -> Iterator[Load]:
    share = _lever(*span, x)
    yield Load(upper, lower, span[0], (1.0 - share) * force)
    yield Load(upper, lower, span[1], share * force)


def _lever(one: float, two: float, x: float) -> float:
    """Return the share of a load at x that comes upon `two`."""
    return min(1.0, max(0.0, (x - one) / (two - one)))


class _Below:
    """Blocks by the heights of their upper faces."""

    def __init__(self, boxes: Sequence[Box], near: float) -> None:
        self.boxes, self.near = boxes, near
        self.courses: dict[int, list[tuple[float, int]]] = defaultdict(list)
        for i, box in enumerate(boxes):
            self.courses[math.floor(box.top / near)].append((box.right, i))
        for course in self.courses.values():
            course.sort()

    def supports(self, upper: int) -> list[int]:
        """Return the blocks that a block stands on."""
        box = self.boxes[upper]
        level = math.floor(box.bottom / self.near)
        return [i for course in (level - 1, level, level + 1) for i in self._under(box, self.courses.get(course, []))]

    def _under(self, box: Box, course: Sequence[tuple[float, int]]) -> Iterator[int]:
        """Yield those of a course, sorted by their right ends, that reach under a box; one course does not overlap."""
        for right, i in course[bisect_left(course, (box.left + self.near, -1)) :]:
            if self.boxes[i].left >= box.right - self.near:
                return
            if abs(self.boxes[i].top - box.bottom) <= self.near and right > box.left:
                yield i
