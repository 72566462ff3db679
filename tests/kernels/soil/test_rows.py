"""Rows of particles along faces at a geostatic start: what their stresses are, and that they are in equilibrium."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.soil.rows import DECAY, ROWS, share_of_row
from blocksim.kernels.sph.wendland_c2 import slope
from blocksim.world.systems.soil_kinds import SMOOTHING
from tests.soils import BLOCKS, FAR, LEFT, SMOOTH_WALLS, Soil, column, right, scene

SPACING = 0.005


def weight_of_row(k: int) -> float:
    """Return half of sum V f d (x) d across a face, of the particles of a row k spacings away."""
    total = 0.0
    for along in range(-4, 5):
        away = math.hypot(k, along)
        total -= slope(away, SMOOTHING) / away * k * k
    return total


def test_the_decay_from_row_to_row_is_that_of_the_kernel_on_its_lattice() -> None:
    one, two, three = (weight_of_row(k) for k in (1, 2, 3))
    assert three == 0.0
    assert pytest.approx(2.0 * one / two, rel=1e-5) == DECAY + 1.0 / DECAY
    stress = np.array([share_of_row(float(row)) for row in range(1, 12)])
    assert stress[ROWS:] == pytest.approx(1.0)
    for i in range(2, 9):  # rows without contact, of which the first miss a neighbour
        lower = two / 2.0 * stress[i - 2] + one * stress[i - 1]
        assert one * stress[i + 1] + two / 2.0 * stress[i + 2] == pytest.approx(lower, rel=5e-4)
    assert one * stress[2] + two / 2.0 * (stress[3] + stress[1]) == pytest.approx(one * stress[0], rel=5e-4)


@pytest.mark.parametrize("wall", [None, 0.05])
def test_soil_at_rest_starts_with_all_forces_in_equilibrium(wall: float | None) -> None:
    blocks: dict[str, Any] = {**BLOCKS, "wall": {"width": 0.05, "height": 0.05, "length": 0.05, "material": "smooth"}}
    pile = [{"block": "wall", "x": 0.075, "y": 0.025 + 0.05 * k, "fixed": True} for k in (0, 1)]
    pairs = {"rods": {**SMOOTH_WALLS["rods"], "ground": {"friction": 0.0}}}
    held = scene(
        column(0.05, 0.1, SPACING),
        blocks=blocks,
        bodies=[FAR] if wall else [*pile, FAR],
        walls=[LEFT, right(wall)] if wall else [LEFT],
        pairs=pairs,
    )
    soil = Soil(held)
    points, states, pull = soil.soils.points, soil.soils.states, 9.81 * float(soil.soils.kinds["mass"][0])
    off = np.hypot(states["fx"], states["fy"] - pull) / pull
    is_corner = (np.abs(points["x"] - 0.025) > 0.025 - 2.0 * SPACING) & (points["y"] < 2.0 * SPACING)
    assert is_corner.sum() == 2 * 4
    assert off[~is_corner].max() < 0.3  # 2.9 without
    assert off[is_corner].max() < 1.5
