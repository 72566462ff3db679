"""The cell search against a search over all pairs, wherever the particles lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.sph.cells import find_neighbours

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Floats

RADIUS = 0.1
# on the edges of cells, between them, and so far away that cells of the size of the radius would be too many
PLACES = st.one_of(
    st.integers(-6, 6).map(lambda k: k * RADIUS), st.floats(-0.5, 0.5), st.floats(-1e9, 1e9), st.just(-0.0)
)
CLOUDS = st.lists(st.tuples(PLACES, PLACES), min_size=1, max_size=40).map(np.array)


def by_cells(positions: Floats, points: Floats, radius: float) -> list[list[int]]:
    offsets, indices = find_neighbours(positions, points, radius)
    return [sorted(indices[offsets[i] : offsets[i + 1]].tolist()) for i in range(len(points))]


def by_brute_force(positions: Floats, points: Floats, radius: float) -> list[list[int]]:
    dx, dy = (positions[None, :, k] - points[:, None, k] for k in (0, 1))
    return [np.flatnonzero(row).tolist() for row in dx * dx + dy * dy < radius * radius]


@given(positions=CLOUDS, points=CLOUDS, radius=st.sampled_from([0.05, RADIUS, 0.3, 1e6]))
def test_lists_equal_those_of_a_search_over_all_pairs(positions: Floats, points: Floats, radius: float) -> None:
    assert by_cells(positions, points, radius) == by_brute_force(positions, points, radius)
    assert by_cells(positions, positions, radius) == by_brute_force(positions, positions, radius)


def test_neighbours_exactly_at_the_radius_are_none() -> None:
    positions = np.array([[0.0, 0.0], [0.25, 0.0], [0.0, -0.25], [np.nextafter(0.25, 0.0), 0.0]])
    assert by_cells(positions, np.zeros((1, 2)), 0.25) == [[0, 3]]


def test_particles_in_one_place_are_neighbours_of_each_other() -> None:
    positions = np.full((50, 2), -3.0)
    assert by_cells(positions, positions, 1e-3) == [list(range(50))] * 50


def test_points_far_outside_have_no_neighbours() -> None:
    positions = np.random.default_rng(2).uniform(0.0, 1.0, (20, 2))
    far = np.array([[5.0, 0.5], [-5.0, 0.5], [0.5, 1e30], [-1e90, -1e90]])
    assert by_cells(positions, far, 0.2) == [[], [], [], []]
    assert by_cells(positions, np.empty((0, 2)), 0.2) == []


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_places_that_are_no_numbers_are_refused(bad: float) -> None:
    good, wrong = np.zeros((2, 2)), np.array([[0.0, 0.0], [bad, 0.0]])
    for positions, points in ((wrong, good), (good, wrong)):
        with pytest.raises(ValueError, match="finite"):
            find_neighbours(positions, points, 1.0)


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_radius_that_is_not_positive_is_refused(radius: float) -> None:
    with pytest.raises(ValueError, match="radius above zero"):
        find_neighbours(np.zeros((2, 2)), np.zeros((2, 2)), radius)


def test_search_without_particles_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one particle"):
        find_neighbours(np.empty((0, 2)), np.zeros((2, 2)), 1.0)
