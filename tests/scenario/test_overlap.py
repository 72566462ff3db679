"""Overlap of rectangles, against polygons clipped another way, and over many bodies."""

import math
import time
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocksim.scenario.overlap import Rectangle, crossings, overlapping_pairs, penetration
from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.segments import PlacedSegment


def body(x: float, y: float, angle: float = 0.0, size_x: float = 0.04, size_y: float = 0.02) -> PlacedBody:
    return PlacedBody("b", "brick", "steel", size_x, size_y, 1.0, 1.0, x, y, angle, 0.0, 0.0, 0.0, fixed=False)


def corners(b: PlacedBody) -> list[tuple[float, float]]:
    c, s = math.cos(b.angle), math.sin(b.angle)
    signs = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    local = [(i * b.size_x / 2, j * b.size_y / 2) for i, j in signs]
    return [(b.x + c * u - s * v, b.y + s * u + c * v) for u, v in local]


def common_area(one: PlacedBody, other: PlacedBody) -> float:
    """Area of the intersection, by cutting one rectangle with every side of the other."""
    polygon = corners(one)
    cutter = corners(other)
    for (ax, ay), (bx, by) in zip(cutter, cutter[1:] + cutter[:1], strict=True):
        sides = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in polygon]
        kept: list[tuple[float, float]] = []
        for i, (p, side) in enumerate(zip(polygon, sides, strict=True)):
            before, side_before = polygon[i - 1], sides[i - 1]
            if side * side_before < 0:
                t = side_before / (side_before - side)
                kept.append((before[0] + t * (p[0] - before[0]), before[1] + t * (p[1] - before[1])))
            if side >= 0:
                kept.append(p)
        polygon = kept
    return sum(polygon[i - 1][0] * p[1] - p[0] * polygon[i - 1][1] for i, p in enumerate(polygon)) / 2


def segment(x0: float, y0: float, x1: float, y1: float) -> PlacedSegment:
    flags = {"extends_start": False, "extends_end": False, "touches_start": True, "touches_end": True}
    return PlacedSegment(x0, y0, x1, y1, material=None, **flags)


def length_inside(piece: PlacedSegment, b: PlacedBody) -> float:
    """Length of a piece inside a rectangle, by cutting it with every side of the rectangle."""
    low, high = 0.0, 1.0
    outline = corners(b)
    for (ax, ay), (bx, by) in zip(outline, outline[1:] + outline[:1], strict=True):
        start = (bx - ax) * (piece.y0 - ay) - (by - ay) * (piece.x0 - ax)
        end = (bx - ax) * (piece.y1 - ay) - (by - ay) * (piece.x1 - ax)
        if start < 0 and end < 0:
            return 0.0
        if start < 0:
            low = max(low, start / (start - end))
        elif end < 0:
            high = min(high, start / (start - end))
    return max(0.0, high - low) * piece.length


place = st.floats(-0.04, 0.04)
turn = st.floats(-math.pi, math.pi)


@given(place, place, turn, turn)
def test_rectangles_penetrate_where_they_have_an_area_in_common(x: float, y: float, a: float, b: float) -> None:
    one, other = body(0.0, 0.0, a), body(x, y, b)
    depth = penetration(Rectangle.of(one), Rectangle.of(other))
    assert (common_area(one, other) > 0) == (depth > 0) or abs(depth) < 1e-6


@given(place, place, turn, turn)
def test_penetration_does_not_depend_on_the_order(x: float, y: float, a: float, b: float) -> None:
    one, other = Rectangle.of(body(0.0, 0.0, a)), Rectangle.of(body(x, y, b))
    assert penetration(one, other) == pytest.approx(penetration(other, one), abs=1e-15)


@pytest.mark.parametrize(
    ("other", "depth"),
    [
        (body(0.039, 0.0), 0.001),
        (body(0.0, 0.0195), 0.0005),
        (body(0.0, 0.0), 0.02),
        (body(0.04, 0.0), 0.0),
        (body(0.05, 0.0), -0.01),
        (body(0.02, 0.02, math.pi / 2), 0.01),
    ],
)
def test_depth(other: PlacedBody, depth: float) -> None:
    assert penetration(Rectangle.of(body(0.0, 0.0)), Rectangle.of(other)) == pytest.approx(depth, abs=1e-15)


def test_corners_can_be_near_without_overlap() -> None:
    diamond = body(0.0395, 0.0295, math.pi / 4, 0.04, 0.04)
    flat = body(0.0, 0.0)
    assert penetration(Rectangle.of(flat), Rectangle.of(diamond)) < 0
    assert list(overlapping_pairs([flat, diamond])) == []


@pytest.mark.parametrize(("gap", "count"), [(0.0, 0), (-0.9e-9, 0), (-1.1e-9, 1), (1e-9, 0)])
def test_a_nanometre_of_overlap_is_forgiven(gap: float, count: int) -> None:
    assert len(list(overlapping_pairs([body(0.0, 0.0), body(0.04 + gap, 0.0)]))) == count


@given(st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), turn), max_size=12))
def test_the_sweep_finds_the_pairs_that_comparing_all_finds(poses: list[tuple[float, float, float]]) -> None:
    bodies = [body(*pose) for pose in poses]
    rectangles = [Rectangle.of(b) for b in bodies]
    expected = {
        (i, j) for i, j in combinations(range(len(bodies)), 2) if penetration(rectangles[i], rectangles[j]) > 1e-9
    }
    assert {(i, j) for i, j, _ in overlapping_pairs(bodies)} == expected


@pytest.mark.parametrize("layout", ["row", "stack", "wall"])
def test_a_thousand_touching_bodies_are_checked_quickly(layout: str) -> None:
    columns = {"row": 1000, "stack": 1, "wall": 32}[layout]
    bodies = [body(0.04 * (i % columns), 0.02 * (i // columns)) for i in range(1000)]
    start = time.perf_counter()
    assert list(overlapping_pairs(bodies)) == []
    assert time.perf_counter() - start < 1.0


@given(st.tuples(place, place, place, place).filter(lambda p: math.dist(p[:2], p[2:]) > 1e-4), turn)
def test_a_piece_crosses_a_body_where_a_part_of_it_is_inside(
    piece_ends: tuple[float, float, float, float], angle: float
) -> None:
    piece, block = segment(*piece_ends), body(0.0, 0.0, angle)
    found = list(crossings([block], [piece]))
    assert bool(found) == (length_inside(piece, block) > 0) or all(depth < 1e-6 for *_, depth in found)


def test_crossings_name_body_piece_and_depth() -> None:
    bodies = [body(0.0, 0.0), body(1.0, 0.0), body(1.03, 0.0)]
    pieces = [segment(-1.0, -0.01, 3.0, -0.01), segment(-1.0, 0.009, 0.5, 0.009), segment(1.0, -1.0, 1.0, 1.0)]
    found = {(b, p): depth for b, p, depth in crossings(bodies, pieces)}
    assert found == {(0, 1): pytest.approx(0.001), (1, 2): pytest.approx(0.02)}


def test_a_thousand_bodies_on_a_thousand_pieces_are_checked_quickly() -> None:
    bodies = [body(0.04 * i, 0.01) for i in range(1000)]
    pieces = [segment(0.04 * i, 0.0, 0.04 * (i + 1), 0.0) for i in range(1000)]
    start = time.perf_counter()
    assert list(crossings(bodies, pieces)) == []
    assert time.perf_counter() - start < 1.0


def test_the_lowest_corner_of_a_turned_rectangle() -> None:
    assert Rectangle.of(body(0.0, 0.0, math.pi / 4)).bottom == pytest.approx(-0.03 * math.sqrt(0.5), abs=1e-15)
