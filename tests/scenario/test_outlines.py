"""Outlines of blocks and soils: area, moments, faults, what they meet and what fills them, found another way."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import geometry
from blocksim.scenario.geometry import (
    Corner,
    Floats,
    area_of,
    box_of,
    centre_outline,
    centroid,
    faults,
    is_upright,
    regular,
    section_of,
)

PLACE = st.floats(-1e3, 1e3)
ANGLES = st.lists(st.integers(0, 71), min_size=3, max_size=16, unique=True).map(sorted)


def on_ellipse(angles: list[int], wide: float) -> list[Corner]:
    """Return a convex polygon, its corners on an ellipse, at multiples of 5 degrees."""
    return [(wide * math.cos(math.radians(5.0 * a)), math.sin(math.radians(5.0 * a))) for a in angles]


def told(points: list[Corner]) -> tuple[int | None, str]:
    return next(faults(points), (None, ""))


@given(ANGLES, st.floats(0.1, 10.0), PLACE, PLACE)
def test_moments_are_those_of_the_triangles_from_the_first_corner(
    angles: list[int], wide: float, x: float, y: float
) -> None:
    points = np.array([(x + u, y + v) for u, v in on_ellipse(angles, wide)])
    fan = [np.array([points[0], points[k], points[k + 1]]) for k in range(1, len(points) - 1)]
    areas = np.array([0.5 * abs(np.linalg.det(t[1:] - t[0])) for t in fan])
    middles = np.array([t.mean(axis=0) for t in fan])
    centre = areas @ middles / areas.sum()
    # a triangle about its centroid: area/36 times the sum of its squared sides; then Huygens and Steiner
    own = [a / 36.0 * sum(np.sum((t[i] - t[i - 1]) ** 2) for i in range(3)) for a, t in zip(areas, fan, strict=True)]
    polar = sum(own) + float(areas @ np.sum((middles - centre) ** 2, axis=1))
    assert centroid(points.tolist()) == pytest.approx(centre, abs=1e-9 * wide + 1e-12)
    assert section_of(centre_outline(points.tolist())) == pytest.approx((areas.sum(), polar), rel=1e-8)


def test_an_outline_far_from_its_origin_keeps_its_digits() -> None:
    near = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.25), (0.0, 0.25)]
    far = [(x + 500_000.0, y + 5_500_000.0) for x, y in near]
    centred = ((-0.25, -0.125), (0.25, -0.125), (0.25, 0.125), (-0.25, 0.125))
    assert centre_outline(far) == centre_outline(near) == centred


@pytest.mark.parametrize("sides", [3, 4, 7])
def test_regular_blocks_stand_on_a_level_side(sides: int) -> None:
    corners = regular(sides, 2.0)
    assert corners[0][1] == pytest.approx(corners[1][1], abs=1e-12)
    assert corners[0][1] == pytest.approx(box_of(corners)[0][1], abs=1e-12)
    area, polar = section_of(corners)
    assert area == pytest.approx(0.5 * sides * 4.0 * math.sin(2.0 * math.pi / sides))
    assert polar == pytest.approx(area * 4.0 / 6.0 * (2.0 + math.cos(2.0 * math.pi / sides)))
    assert told(list(corners)) == (None, "")


@given(ANGLES, st.floats(0.1, 10.0))
def test_convex_outlines_pass_in_both_senses(angles: list[int], wide: float) -> None:
    points = on_ellipse(angles, wide)
    assert told(points) == told(points[::-1]) == (None, "")
    assert area_of(points) == pytest.approx(-area_of(points[::-1]))


@given(st.floats(1e-3, 10.0), st.floats(0.05, 20.0), st.integers(0, 3), st.booleans())
def test_upright_rectangles_have_no_round_off_of_their_own(
    wide: float, slender: float, first: int, clockwise: bool
) -> None:
    """They are placed with the sides that were given, wherever the corners begin."""
    tall = wide * slender
    points = [(0.0, 0.0), (wide, 0.0), (wide, tall), (0.0, tall)]
    points = [*points[first:], *points[:first]][:: -1 if clockwise else 1]
    assert is_upright(centre_outline(points))
    assert {(2.0 * abs(x), 2.0 * abs(y)) for x, y in centre_outline(points)} == {(wide, tall)}
    assert not is_upright(centre_outline([(0.0, 0.0), (wide, 1e-9 * wide), (wide, tall), (0.0, tall)]))
    assert not is_upright(centre_outline([(0.0, 0.0), (wide, 0.0), (wide, tall)]))


SQUARE = geometry.corners_of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
ELL = geometry.corners_of([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)])
SLOPE = geometry.corners_of([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)])


def moved(x: float, y: float) -> geometry.Floats:
    return np.asarray(SQUARE + np.array([x, y]))


@pytest.mark.parametrize(
    ("other", "meets"),
    [
        (moved(1.0, 0.0), False),  # a common edge
        (moved(1.0, 1.0), False),  # a common corner
        (moved(1.0 - 1e-6, 0.0), True),
        (moved(0.0, 0.0), True),  # the same
        (0.1 * SQUARE + 0.4, True),  # inside
        (moved(1.2, 1.2), False),
        (np.array([[0.5, -1.0], [0.6, -1.0], [0.6, 2.0], [0.5, 2.0]]), True),  # across, no corner inside
    ],
)
def test_polygons_overlap_where_they_have_more_than_edges_in_common(other: geometry.Floats, meets: bool) -> None:
    assert geometry.overlap(SQUARE, other) is meets
    assert geometry.overlap(other, SQUARE) is meets
    assert not geometry.overlap(ELL, moved(1.0, 1.0))  # the notch is free
    assert geometry.overlap(ELL, moved(0.9, 1.0))


def test_a_lattice_keeps_its_discs_inside_and_the_weight_above_counts_what_is_there_only() -> None:
    places, area = geometry.fill_rows(SQUARE, 0.1)
    assert len(places) == 100
    assert area == pytest.approx(1.0)
    assert places[0] == pytest.approx([0.05, 0.05])
    sloping, _ = geometry.fill_rows(SLOPE, 0.05)
    assert geometry.edge_distance(sloping, SLOPE).min() >= 0.499 * 0.05
    assert len(sloping) * 0.05**2 == pytest.approx(1.0, abs=0.05)
    points = np.array([[0.5, 0.5], [1.5, 0.25], [0.5, 2.5]])
    assert geometry.height_above(ELL, points) == pytest.approx([1.5, 0.75, 0.0])


def side(a: Floats, b: Floats, point: Floats) -> float:
    """Return on which side of the line from a to b a point lies."""
    return float((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]))


def meeting(corners: Floats) -> list[tuple[int, int]]:
    """Return the pairs of edges that meet, one pair after the other."""
    ends, count, found = np.roll(corners, -1, axis=0), len(corners), []
    for i, j in itertools.combinations(range(count), 2):
        a, b, c, d = corners[i], ends[i], corners[j], ends[j]
        crosses = side(a, b, c) * side(a, b, d) <= 0.0 >= side(c, d, a) * side(c, d, b)
        boxes = np.maximum(np.minimum(a, b), np.minimum(c, d)) <= np.minimum(np.maximum(a, b), np.maximum(c, d))
        if (j - i) % count not in (1, count - 1) and crosses and boxes.all():
            found.append((i, j))
    return found


@pytest.mark.parametrize("count", [3, 4, 5, 8, 20])
def test_edges_that_meet_are_all_found_in_their_order(count: int) -> None:
    """On a coarse lattice corners lie on edges, edges along edges, and many cross; a circle crosses nothing."""
    draw = np.random.default_rng(count)
    for size in (2, 4, 1000):
        corners = draw.integers(0, size, (count, 2)).astype(float)
        assert [*geometry.self_crossings(corners)] == meeting(corners)
    turn = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    assert [*geometry.self_crossings(np.stack([np.cos(turn), np.sin(turn)], axis=1))] == []
