"""Cases of soil mechanics at the sizes of their references; the quick ones of test_soil.py see the same code.

S1 earth pressure at rest, S2 and S3 active thrust on a wall that is drawn back, S5 the friction that three blocks need
to hold soil back, S10 the energy that a collapsed column keeps (of another code, SPHinXsys).
"""

import math

import numpy as np
import pytest

from tests.soils import DEPTH, FAR, LEFT, MATERIALS, UNIT_WEIGHT, Soil, column, right, scene

pytestmark = pytest.mark.long
SINE = math.sin(math.radians(21.9))
ACTIVE = (1.0 - SINE) / (1.0 + SINE)
FINE, COARSE = 0.0025, 0.005  # m
HEIGHT = 0.1  # m
SMOOTH = {"friction": 0.0}


def test_earth_pressure_at_rest_between_smooth_walls() -> None:
    table = column(0.06, HEIGHT, FINE, start="ramp")
    pairs = {"rods": {"smooth": SMOOTH, "ground": SMOOTH}}
    soil = Soil(scene(table, walls=[LEFT, right(0.06)], pairs=pairs))
    soil.to_time(0.35)
    left, base = (soil.mean_force_on(body, soil.time + 0.05) for body in (1, soil.world.bodies.size - 1))
    slope = SINE / math.sqrt(3.0)
    assert -base[1] == pytest.approx(soil.weight, rel=0.005)
    assert -2.0 * left[0] / (UNIT_WEIGHT * HEIGHT**2 * DEPTH) == pytest.approx(
        (1.0 - slope) / (1.0 + 2.0 * slope), rel=0.01
    )


def active_thrust(spacing: float, base: float) -> float:
    """Return K of a smooth wall drawn back by 1 % of the height at 5 mm/s, the mean over the second half."""
    blocks = {
        "far": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "soft"},
        "wall": {"width": 0.04, "height": 0.16, "length": DEPTH, "material": "smooth"},
    }
    wall = {"block": "wall", "x": -0.02, "y": 0.08, "fixed": True}
    pairs = {"rods": {"smooth": SMOOTH, "ground": {"friction": base}}}
    soil = Soil(
        scene(column(0.15, HEIGHT, spacing), blocks=blocks, bodies=[wall, FAR], walls=[right(0.15)], pairs=pairs)
    )
    soil.to_time(0.05)
    soil.world.bodies.vx[0] = -0.005
    soil.to_time(0.15)
    thrust, _ = soil.mean_force_on(0, 0.25)
    points = soil.soils.points
    columns = np.arange(0.0, 0.02, spacing)
    tops = [points["y"][(points["x"] >= x - 0.001) & (points["x"] < x + spacing)].max() for x in columns]
    return float(-2.0 * thrust / (UNIT_WEIGHT * (np.mean(tops) + 0.5 * spacing) ** 2 * DEPTH))


def test_the_active_thrust_is_that_of_mohr_and_coulomb_and_a_rough_base_takes_less_of_it_the_finer_it_is() -> None:
    smooth = active_thrust(COARSE, 0.0)
    assert smooth == pytest.approx(ACTIVE, rel=0.02)
    rough = math.tan(math.radians(21.9))
    assert active_thrust(COARSE, rough) < active_thrust(FINE, rough) < 1.02 * ACTIVE


@pytest.mark.parametrize(("share", "slides"), [(0.94, True), (1.06, False)])
def test_three_blocks_hold_soil_back_with_the_friction_that_the_thrust_needs(share: float, slides: bool) -> None:
    height, width, count = 0.025, 0.032, 3
    retained = count * height
    weight = MATERIALS["soft"]["density"] * 9.81 * width * height * count
    needed = 0.5 * ACTIVE * UNIT_WEIGHT * retained**2 / weight
    table = {**column(0.0, retained, FINE), "x": [width, width + 0.15]}
    soil = Soil(
        scene(
            table,
            blocks={"b": {"width": width, "height": height, "length": DEPTH, "material": "soft"}},
            bodies=[{"block": "b", "x": 0.5 * width, "y": height * (k + 0.5)} for k in range(count)],
            walls=[right(width + 0.15)],
            friction={"block_block": 0.6, "block_ground": share * needed},
            pairs={"rods": {"soft": SMOOTH, "smooth": SMOOTH, "ground": SMOOTH}},
        )
    )
    soil.to_time(0.4)
    before = soil.bodies[0].x
    soil.to_time(0.5)
    assert bool(before - soil.bodies[0].x > 1e-4) is slides


def test_a_collapsed_column_keeps_the_energy_that_another_code_finds() -> None:
    pairs = {"rods": {"smooth": {"friction": math.tan(math.radians(21.9))}}}
    soil = Soil(scene(column(0.2, HEIGHT, 0.004), walls=[LEFT], pairs=pairs))
    before = soil.entries()["soils_potential"]
    soil.to_time(1.0)
    assert soil.entries()["soils_potential"] / before == pytest.approx(0.691, abs=0.03)
