"""Gravity with horizontal and vertical coefficients: closed forms by runs and statics, mirror, energy, and soil."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blocksim
from blocksim.scenario import Model
from blocksim.simulation.schemes import build
from blocksim.study.static_limit import static_limit
from blocksim.world.systems.soils import SOILS
from tests.soils import UNIT_WEIGHT, Soil, column, scene
from tests.study.plans import FRICTION, SLENDER, SQUAT, block_on_a_slope

SCHEMES = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
STATE = ("x", "y", "angle", "vx", "vy", "spin")


def block(size: tuple[float, float], scheme: str, **tables: Any) -> dict[str, Any]:
    return {**block_on_a_slope(size), "start": {"settle": True}, "time": {"scheme": scheme, "end": 1.0}, **tables}


@SCHEMES
@pytest.mark.parametrize("size", [SQUAT, SLENDER])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_block_slides_at_its_friction_or_topples_at_its_width_over_height(
    scheme: str, size: tuple[float, float], sign: float
) -> None:
    critical = min(FRICTION, size[0] / size[1])
    for share in (0.98, 1.02):
        gravity = {"horizontal": sign * share * critical}
        start = {"settle": share < 1.0}  # what falls has no rest to begin at
        frames = blocksim.run(block(size, scheme, gravity=gravity, start=start)).frames
        moved, turned = sign * (frames.x[-1, 0] - frames.x[0, 0]), -sign * frames.angle[-1, 0]
        if share < 1.0:
            assert abs(moved) < 1e-4
        else:
            assert moved > 0.02
        assert (turned > 1.0) == (share > 1.0 and size == SLENDER)


@pytest.mark.parametrize(("size", "lift"), [(SQUAT, 0.0), (SLENDER, 0.0), (SQUAT, 0.3), (SLENDER, -0.3)])
def test_statics_finds_the_same_and_weight_that_is_lighter_in_proportion(
    size: tuple[float, float], lift: float, tmp_path: Path
) -> None:
    held = {**block_on_a_slope(size), "gravity": {"vertical": lift}}
    found = static_limit(held, {"gravity.horizontal": {"from": -1.0, "to": 1.0}}, out=tmp_path / "static")
    critical = min(FRICTION, size[0] / size[1]) * (1.0 - lift)
    assert found.is_linear
    assert [one.bound for one in found.limits] == pytest.approx([-critical, critical], rel=1e-9)
    bare = static_limit(block_on_a_slope(size), {"gravity.horizontal": {"from": 0.0, "to": 1.0}}, out=tmp_path / "bare")
    assert bare.limits[0].bound == pytest.approx(min(FRICTION, size[0] / size[1]), rel=1e-9)


@pytest.mark.parametrize("name", ["three_blocks", "three_blocks_nonsmooth"])
def test_blocks_fall_with_a_vertical_coefficient_as_with_so_much_less_gravity(name: str) -> None:
    file = f"scenarios/{name}.toml"
    one, other = (
        blocksim.run(blocksim.load(file, {**values, "time.end": 0.1}))
        for values in ({"gravity.vertical": 0.25}, {"gravity": 9.81 * 0.75})
    )
    for quantity in STATE:
        np.testing.assert_array_equal(getattr(one.frames, quantity), getattr(other.frames, quantity))


def pile(scheme: str, way: float, **tables: Any) -> dict[str, Any]:
    """Return two blocks, of which the upper one stands off the middle, pushed to one side."""
    bodies = [{"block": "b", "x": 0.0, "y": 0.025}, {"block": "b", "x": 0.03 * way, "y": 0.075}]
    return block(SQUAT, scheme, bodies=bodies, gravity={"horizontal": 0.45 * way, "vertical": -0.2},
        start={}, **tables)  # fmt: skip


@SCHEMES
def test_blocks_pushed_to_the_other_side_move_as_in_a_mirror_and_energy_adds_up(scheme: str) -> None:
    exact = {"velocity_tolerance": 1e-12} if scheme == "nonsmooth" else {}
    time = {"scheme": scheme, "end": 0.2, **exact}
    one, other = (blocksim.run(pile(scheme, way) | {"time": time}) for way in (1.0, -1.0))
    # impulses are found one after the other: measured with rigid contacts 7e-8 m, 5e-4 rad/s
    assert one.frames.x[-1, 1] > 0.032
    for quantity, sign in zip(STATE, (-1.0, 1.0, -1.0, -1.0, 1.0, -1.0), strict=True):
        left, right = getattr(one.frames, quantity), getattr(other.frames, quantity)
        np.testing.assert_allclose(left, sign * right, atol=1e-6 if scheme == "explicit" else 1e-3)
    assert one.summary.energy_J.relative_residual < 1e-3


@SCHEMES
def test_gravity_that_turns_keeps_its_coefficients(scheme: str) -> None:
    """In the air: what a load turns moves as over a ground of this tilt, and what it does is work of the load."""
    high = {
        "bodies": [{"block": "b", "x": 0.0, "y": 5.0}],
        "gravity": {"horizontal": 0.4, "vertical": 0.3},
        "start": {},
    }
    load = {"kind": "gravity", "times": [0.0, 1.0], "tilts": ["20 deg", "20 deg"]}
    time = {"scheme": scheme, "end": 0.1}
    turned, tilted = (
        blocksim.run(block(SQUAT, scheme) | high | {"time": time} | more)
        for more in ({"loads": [load]}, {"ground": {"tilt": "20 deg"}})
    )
    g = 9.81
    expected = (-g * (math.sin(math.radians(20.0)) - 0.4), -g * (math.cos(math.radians(20.0)) - 0.3))
    for result in (turned, tilted):
        speeds = (result.frames.vx[-1, 0], result.frames.vy[-1, 0]) / result.frames.time[-1]
        assert speeds == pytest.approx(expected, rel=1e-6)
        assert result.summary.energy_J.relative_residual < 1e-6
    scenes = [Model(block(SQUAT, scheme) | high | more) for more in ({"loads": [load]}, {"ground": {"tilt": "20 deg"}})]
    one, other = (build(model).world.controls[0] for model in scenes)
    assert (float(other.gravity_x), float(other.gravity_y)) == pytest.approx(expected)
    assert (float(one.gravity_x), float(one.gravity_y)) == pytest.approx((0.4 * g, -0.7 * g))
    assert float(one.push) >= math.dist((one.gravity_x, one.gravity_y), expected) - g


def test_soil_feels_both_coefficients_and_starts_with_the_weight_that_is_left() -> None:
    table = column(0.05, 0.1, 0.005)
    x, y, *_, syy, _, _, _ = SOILS.elements(Model(scene(table, gravity={"horizontal": 0.2, "vertical": 0.25}))).start
    np.testing.assert_allclose(syy, -0.75 * UNIT_WEIGHT * (0.1 - y))
    assert x.size == y.size
    falling = column(0.05, 0.05, 0.005, y=[0.5, 0.55], start="ramp")
    soil = Soil(scene(falling, gravity={"horizontal": 0.2, "vertical": 0.25}))
    soil.to_time(0.02)
    means = [float(soil.soils.points[name].mean()) for name in ("vx", "vy")]
    assert means[0] > 0.0
    assert means[0] / means[1] == pytest.approx(-0.2 / 0.75, rel=1e-9)
