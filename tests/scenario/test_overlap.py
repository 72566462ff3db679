"""Overlap of rectangles and convex polygons, against polygons clipped another way, and over many bodies."""

import math
from itertools import combinations

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario.geometry import Corner, centre_outline
from blocksim.scenario.overlap import Outlines, near_pairs, overlapping_pairs, penetration
from blocksim.scenario.placement import PlacedBody, PlacedSegment


def body(x: float, y: float, angle: float = 0.0, size_x: float = 0.04, size_y: float = 0.02) -> PlacedBody:
    return PlacedBody("b", "brick", "steel", size_x, size_y, 1.0, 1.0, x, y, angle, 0.0, 0.0, 0.0, fixed=False)


def corners(b: PlacedBody) -> list[tuple[float, float]]:
    c, s = math.cos(b.angle), math.sin(b.angle)
    return [(b.x + c * u - s * v, b.y + s * u + c * v) for u, v in b.corners]


def polygon(x: float, y: float, points: list[Corner], angle: float = 0.0) -> PlacedBody:
    outline = centre_outline(points)
    sizes = [max(values) - min(values) for values in zip(*outline, strict=True)]
    return body(x, y, angle, *sizes)._replace(outline=outline)


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


def depth_of(one: PlacedBody, other: PlacedBody) -> float:
    (depth,) = penetration(Outlines.of([one]), Outlines.of([other]))
    return float(depth)


place = st.floats(-0.04, 0.04)
turn = st.floats(-math.pi, math.pi)


def test_depth() -> None:
    for other, depth in (
        (body(0.039, 0.0), 0.001),
        (body(0.0, 0.0195), 0.0005),
        (body(0.0, 0.0), 0.02),
        (body(0.04, 0.0), 0.0),
        (body(0.05, 0.0), -0.01),
        (body(0.02, 0.02, math.pi / 2), 0.01),
    ):
        assert depth_of(body(0.0, 0.0), other) == pytest.approx(depth, abs=1e-15)
    for gap, count in ((0.0, 0), (-0.9e-9, 0), (-1.1e-9, 1), (1e-9, 0)):  # a nanometre of overlap is forgiven
        assert len(list(overlapping_pairs([body(0.0, 0.0), body(0.04 + gap, 0.0)]))) == count


CORNERS = st.lists(st.integers(0, 23), min_size=3, max_size=7, unique=True).map(sorted)


@st.composite
def polygons(draw: st.DrawFn) -> PlacedBody:
    """Draw a polygon with corners on an ellipse, or a rectangle."""
    x, y, angle = draw(place), draw(place), draw(turn)
    if draw(st.booleans()):
        return body(x, y, angle)
    angles = [math.radians(15.0 * number) for number in draw(CORNERS)]
    return polygon(x, y, [(0.03 * math.cos(a), 0.02 * math.sin(a)) for a in angles], angle)


SIDES = st.sampled_from([1e-3, 0.0125, 0.04, 0.04, 0.3])
RECTANGLES = st.builds(body, st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), turn, SIDES, SIDES)
BODIES = st.lists(RECTANGLES | polygons(), max_size=12)


@given(BODIES)
def test_the_cells_find_the_pairs_that_comparing_all_finds(bodies: list[PlacedBody]) -> None:
    expected = {(i, j) for i, j in combinations(range(len(bodies)), 2) if depth_of(bodies[i], bodies[j]) > 1e-9}
    found = [(i, j) for i, j, _ in overlapping_pairs(bodies)]
    assert set(found) == expected
    assert len(found) == len(expected)


@given(BODIES, st.lists(st.tuples(place, place, place, place), max_size=6))
def test_the_cells_find_the_crossings_that_comparing_all_finds(
    bodies: list[PlacedBody], ends: list[tuple[float, float, float, float]]
) -> None:
    pieces = [segment(*piece) for piece in ends if math.dist(piece[:2], piece[2:]) > 1e-4]
    single = {(i, j) for i, b in enumerate(bodies) for j, p in enumerate(pieces) for _ in overlapping_pairs([b], [p])}
    found = [(i, j) for i, j, _ in overlapping_pairs(bodies, pieces)]
    assert set(found) == single
    assert len(found) == len(single)


def test_a_pair_is_found_wherever_it_is_and_what_stands_on_end_among_level_pieces() -> None:
    for x in (-1e9, 0.02, 1e3, 1e300, 1e308):
        assert [pair[:2] for pair in overlapping_pairs([body(x, 5.0), body(3.0, 0.0), body(x, 5.001)])] == [(0, 2)]
    short = [segment(0.001 * i, 0.0, 0.001 * (i + 1), 0.0) for i in range(-5, 5)]  # alone they have no height
    assert {piece for _, piece, _ in overlapping_pairs([body(0.0, 0.0)], short)} == set(range(10))


def test_overlaps_are_found_in_portions(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies = [body(0.001 * i, 0.0) for i in range(30)]
    found = sorted(overlapping_pairs(bodies))
    monkeypatch.setattr("blocksim.scenario.overlap.MOST_AT_ONCE", 7)
    assert sorted(overlapping_pairs(bodies)) == found
    assert len(found) == 30 * 29 // 2


def pairs_compared(bodies: list[PlacedBody]) -> int:
    return sum(one.size for one, _ in near_pairs(Outlines.of(bodies)))


def test_bodies_that_only_touch_are_hardly_compared() -> None:
    for columns in (2500, 1, 50):
        bodies = [body(0.04 * (i % columns), 0.02 * (i // columns)) for i in range(2500)]
        assert list(overlapping_pairs(bodies)) == []
        assert pairs_compared(bodies) <= 4 * 2500  # eight neighbours each
        if columns == 50:  # and a large one below
            bodies.append(body(1.0, -1.01, size_x=200.0, size_y=2.0))
            assert list(overlapping_pairs(bodies)) == []
            assert pairs_compared(bodies) <= 4 * 2500 + 50


def test_crossings_name_body_piece_and_depth() -> None:
    bodies = [body(0.0, 0.0), body(1.0, 0.0), body(1.03, 0.0)]
    pieces = [segment(-1.0, -0.01, 3.0, -0.01), segment(-1.0, 0.009, 0.5, 0.009), segment(1.0, -1.0, 1.0, 1.0)]
    found = {(b, p): depth for b, p, depth in overlapping_pairs(bodies, pieces)}
    assert found == {(0, 1): pytest.approx(0.001), (1, 2): pytest.approx(0.02)}


@given(polygons(), polygons())
def test_polygons_penetrate_where_they_have_an_area_in_common(one: PlacedBody, other: PlacedBody) -> None:
    depth = depth_of(one, other)
    assert (common_area(one, other) > 0) == (depth > 0) or abs(depth) < 1e-6
    assert depth == pytest.approx(depth_of(other, one), abs=1e-15)
    lowest = min(y for _, y in corners(one))
    assert Outlines.of([other, one]).bottom[1] == pytest.approx(lowest, abs=1e-15)
