"""Outlines of soils: what lies in them, what they meet, what fills them."""

import numpy as np
import pytest

from blocksim.scenario import geometry

SQUARE = geometry.corners_of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
ELL = geometry.corners_of([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)])
SLOPE = geometry.corners_of([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)])


def moved(x: float, y: float) -> geometry.Floats:
    return np.asarray(SQUARE + np.array([x, y]))


def test_corners_run_counter_clockwise_however_they_are_given() -> None:
    assert geometry.area_of(geometry.corners_of([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)])) == 1.0
    assert geometry.area_of(ELL) == 3.0


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


def test_the_notch_of_an_ell_is_free() -> None:
    assert not geometry.overlap(ELL, moved(1.0, 1.0))
    assert geometry.overlap(ELL, moved(0.9, 1.0))


def test_a_lattice_fills_a_square_and_keeps_its_discs_inside_a_slope() -> None:
    places = geometry.fill_lattice(SQUARE, 0.1)
    assert len(places) == 100
    assert places[0] == pytest.approx([0.05, 0.05])
    sloping = geometry.fill_lattice(SLOPE, 0.05)
    assert geometry.edge_distance(sloping, SLOPE).min() >= 0.499 * 0.05
    assert len(sloping) * 0.05**2 == pytest.approx(1.0, abs=0.05)


def test_the_weight_above_counts_what_is_there_only() -> None:
    points = np.array([[0.5, 0.5], [1.5, 0.25], [0.5, 2.5]])
    assert geometry.height_above(ELL, points) == pytest.approx([1.5, 0.75, 0.0])


def test_edges_that_cross_are_found() -> None:
    bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    assert list(geometry.self_crossings(bow)) == [(0, 2)]
    assert list(geometry.self_crossings(ELL)) == []
