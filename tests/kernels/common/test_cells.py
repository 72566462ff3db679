"""Cells are few and hold everything once, wherever it lies; neighbours are those of a search over all pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.neighbours import lay_cells, sort_into_cells
from blocksim.kernels.sph.cells import PLACE, find_neighbours

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Floats, Records
    from blocksim.kernels.common.neighbours import CellGrid


RADIUS = 0.1
# on the edges of cells, between them, and so far away that cells of the size of the radius would be too many
PLACES = st.one_of(
    st.integers(-6, 6).map(lambda k: k * RADIUS), st.floats(-0.5, 0.5), st.floats(-1e9, 1e9), st.just(-0.0)
)
CLOUDS = st.lists(st.tuples(PLACES, PLACES), min_size=1, max_size=40).map(np.array)


def sort(positions: Floats, radius: float) -> tuple[CellGrid, list[list[int]]]:
    """Return the grid, and what lies in every cell."""
    n = len(positions)
    places: Records = np.ascontiguousarray(positions).view(PLACE)[:, 0].view(np.recarray)
    starts, order = np.full(3 * n + 3, -1), np.full(n, -1)
    grid = lay_cells(places, radius, n, False)
    sort_into_cells(places, grid, starts, order)
    count = grid.columns * grid.rows
    assert (starts[0], starts[count]) == (0, n)
    return grid, [order[starts[c] : starts[c + 1]].tolist() for c in range(count)]


@given(positions=CLOUDS, radius=st.sampled_from([1e-9, RADIUS, 1e12]))
def test_cells_are_few_and_hold_every_particle_once(positions: Floats, radius: float) -> None:
    grid, cells = sort(positions, radius)
    assert len(cells) <= 3 * len(positions) + 1
    assert grid.size >= radius
    assert sorted(i for cell in cells for i in cell) == list(range(len(positions)))
    assert all(cell == sorted(cell) for cell in cells)


def test_cells_of_an_even_cloud_have_the_size_of_the_radius() -> None:
    grid, _ = sort(np.random.default_rng(3).uniform(0.0, 1.0, (1000, 2)), 0.1)
    assert (grid.size, grid.columns, grid.rows) == (0.1, 10, 10)


@pytest.mark.parametrize("far", [1e3, 1e12, 1e300])
def test_a_few_that_have_flown_off_do_not_make_cells_larger(far: float) -> None:
    positions = np.random.default_rng(3).uniform(0.0, 1.0, (1000, 2))
    positions[::100] = np.random.default_rng(4).uniform(-far, far, (10, 2))
    positions[7] = np.nan
    grid, cells = sort(positions, 0.1)
    assert grid.size < 0.2
    assert max(map(len, cells)) < 60


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


@pytest.mark.parametrize(
    ("positions", "points", "radius", "message"),
    [
        ([[0.0, 0.0], [np.nan, 0.0]], [[0.0, 0.0]], 1.0, "finite"),
        ([[0.0, 0.0]], [[np.inf, 0.0]], 1.0, "finite"),
        ([[0.0, 0.0]], [[0.0, 0.0]], 0.0, "radius above zero"),
        ([[0.0, 0.0]], [[0.0, 0.0]], np.nan, "radius above zero"),
        (np.empty((0, 2)), [[0.0, 0.0]], 1.0, "at least one particle"),
    ],
)
def test_search_that_makes_no_sense_is_refused(positions: Floats, points: Floats, radius: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        find_neighbours(np.array(positions), np.array(points), radius)
