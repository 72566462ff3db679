"""Rows of particles along faces at a geostatic start: what their stresses are, and that they are in equilibrium."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.tolerances import DECAY
from blocksim.kernels.soil.stress import ROWS, share_of_row
from blocksim.kernels.sph.functions import wendland_slope
from blocksim.scenario import Scenario
from blocksim.world.systems.soils import SMOOTHING
from tests.soils import BLOCKS, FAR, LEFT, MATERIALS, SMOOTH_WALLS, Soil, column, right, scene

SPACING = 0.005


def weight_of_row(k: int) -> float:
    """Return half of sum V f d (x) d across a face, of the particles of a row k spacings away."""
    total = 0.0
    for along in range(-4, 5):
        away = math.hypot(k, along)
        total -= wendland_slope(away, SMOOTHING) / away * k * k
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
        column(0.05, 0.1, SPACING, gradient="raw"),
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


def corrected_column(width: float, **material: Any) -> Scenario:
    """Return soil with corrected gradients at rest between smooth walls on a smooth ground."""
    table = column(width, 0.1, SPACING, gradient="corrected")
    materials = {**MATERIALS, "rods": {**MATERIALS["rods"], **material}}
    pairs = {"rods": {**SMOOTH_WALLS["rods"], "ground": {"friction": 0.0}}}
    return scene(table, walls=[LEFT, right(width)], pairs=pairs, materials=materials)


def test_corrected_gradients_start_with_the_forces_across_all_faces_in_equilibrium() -> None:
    width = 0.06
    soil = Soil(corrected_column(width))
    points, states, pull = soil.soils.points, soil.soils.states, 9.81 * float(soil.soils.kinds["mass"][0])
    side = 0.5 * width - np.abs(points["x"] - 0.5 * width)
    is_low, is_at_wall = points["y"] < 3.0 * SPACING, side < 3.0 * SPACING
    is_high = points["y"] > 0.1 - 4.0 * SPACING  # no face: up to a quarter of the weight
    fx, fy = np.abs(states["fx"]) / pull, np.abs(states["fy"] - pull) / pull
    assert fx[~is_low].max() < 0.05  # 9 with the stress inside
    assert fy[~is_at_wall & ~is_high].max() < 0.1  # 17
    assert fy[is_at_wall & ~is_low & ~is_high].max() < 0.3  # what the yield surface leaves to the others


def test_corrected_soil_starts_within_the_yield_surface() -> None:
    soils = Soil(corrected_column(0.06)).soils
    states, kind = soils.states, soils.kinds[0]
    normal = np.array([states["sxx"], states["syy"], states["szz"]])
    total, shear = normal.sum(axis=0), states["sxy"]
    deviator = np.sqrt(0.5 * ((normal - total / 3.0) ** 2).sum(axis=0) + shear**2)
    assert (deviator + kind["slope"] * total).max() < 1e-9 * np.abs(normal).max()
    assert states["plastic"].max() < 1e-12
