"""Static limit analysis against published factors and closed forms: walls, arches, wedges, blocks on slopes."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, load_scenario
from blocksim.statics.blockwork import Blockwork
from blocksim.statics.joint_forces import joint_forces
from blocksim.statics.programme import Equilibrium, Programme, horizontal_margin

EXACT = 1e-4  # relative
STONE = {"stone": {"density": 2000.0, "young_modulus": 1e10, "poisson_ratio": 0.2}}
TIME = {"scheme": "nonsmooth", "end": 1.0}


def blockwork(friction: float, **tables: Any) -> Blockwork:
    """Return the blocks of a scenario in one material; every block is given by its width and height (m)."""
    rules = {"block_block": friction, "block_ground": friction}
    return Blockwork.of(
        Model(load_scenario({"schema": 1, "name": "s", "materials": STONE, "friction": rules, "time": TIME, **tables}))
    )


def brick(width: float, height: float, depth: float = 1.0) -> dict[str, object]:
    return {"width": width, "height": height, "length": depth, "material": "stone"}


def pushed(blocks: Blockwork, sign: float = 1.0) -> Equilibrium:
    found = Programme(blocks).greatest(blocks.forces, sign * blocks.horizontal)
    assert found is not None
    return found


@pytest.mark.parametrize(("friction", "thickness"), [(0.75, 0.10672), (0.325, 0.17821)])
def test_least_thickness_of_an_arch_of_27_voussoirs_is_the_published_one(friction: float, thickness: float) -> None:
    arch = {"kind": "arch", "block": "v", "radius": 1.0, "embrace": "180 deg", "count": 27}
    voussoir = {"v": {"depth": 1.0, "material": "stone"}}
    for share, stands in ((1.0 - EXACT, False), (1.0 + EXACT, True)):
        blocks = blockwork(friction, blocks=voussoir, structures=[{**arch, "thickness": share * thickness}])
        assert bool(Programme(blocks).carries(blocks.forces).factor) == stands


def test_wall_one_of_ferris_and_tin_loi_has_their_bound_and_nearly_their_least_factor() -> None:
    blocks = Blockwork.of(Model(load_scenario("scenarios/tilting_wall.toml", {"ground.tilt": "0 deg"})))
    for sign in (1.0, -1.0):  # the wall is symmetric
        found = pushed(blocks, sign)
        assert found.factor == pytest.approx(0.64286, rel=EXACT)
        estimate = Programme(blocks).estimate(blocks.forces, sign * blocks.horizontal, found.factor)
        assert 0.63982 * (1.0 - EXACT) < estimate < 0.63982 * 1.0005


@pytest.mark.parametrize(("friction", "width", "height"), [(0.3, 0.3, 0.2), (0.9, 0.1, 0.4)])
def test_a_block_slides_at_its_friction_or_topples_about_its_edge(friction: float, width: float, height: float) -> None:
    blocks = blockwork(
        friction, blocks={"b": brick(width, height)}, bodies=[{"block": "b", "x": 0.0, "y": 0.5 * height}]
    )
    found = pushed(blocks)
    assert found.factor == pytest.approx(min(friction, width / height), rel=1e-9)
    ((x, y, turn),) = found.mechanism
    is_sliding = friction < width / height
    assert (abs(turn) < 1e-9) == is_sliding
    # it opens as it slides, by the coefficient of friction; about its right edge it turns clockwise
    assert y / x == pytest.approx(friction if is_sliding else width / height, rel=1e-6)
    (joint,) = joint_forces(blocks, found)
    assert joint.slides == is_sliding
    assert joint.compression == pytest.approx(-blocks.forces[0, 1])
    if not is_sliding:
        assert joint.margin_m == pytest.approx(0.0, abs=1e-9)
        assert joint.x_m == pytest.approx(0.5 * width)


def test_below_a_head_that_stays_parallel_a_wall_carries_what_virtual_work_says() -> None:
    """It turns about its toe and lifts the head by the opposite corner: V h = (Q + W/2) b."""
    bodies = [
        {"block": "wall", "x": 0.0, "y": 0.6},
        {"block": "head", "name": "head", "x": 0.0, "y": 1.3, "guide": "no rotation"},
    ]
    down = {"kind": "force", "body": "head", "magnitude": "50 kN", "direction": "-90 deg", "point": [0.3, 0.0]}
    blocks = blockwork(1.8, blocks={"wall": brick(1.0, 1.2), "head": brick(1.0, 0.2)}, bodies=bodies, loads=[down])
    push = np.zeros_like(blocks.forces)
    push[1, 0] = 1.0
    found = Programme(blocks).greatest(blocks.forces, push)
    assert found is not None
    wall, head = blocks.masses * 9.81
    assert found.factor == pytest.approx((50e3 + head + 0.5 * wall) / 1.2, rel=1e-9)


def test_forces_are_in_equilibrium_and_in_their_cones_and_the_mechanism_does_the_work_that_the_factor_says() -> None:
    blocks = Blockwork.of(Model(load_scenario("scenarios/tilting_wall.toml", {"ground.tilt": "0 deg"})))
    found = pushed(blocks)
    assert (found.normal >= -1e-9).all()
    assert (np.abs(found.shear) <= blocks.friction * found.normal + 1e-6).all()
    total = np.zeros((len(blocks.names) + 1, 3))
    for rates, forces in ((blocks.assembly.across, found.normal), (blocks.assembly.along, found.shear)):
        for side in (0, 1):
            np.add.at(total, blocks.assembly.places[:, side], rates[:, side] * forces[:, None])
    weight = float(np.abs(blocks.forces[:, 1]).sum())
    residual = total[:-1] + blocks.forces + found.factor * blocks.horizontal
    assert np.abs(residual).max() < 1e-7 * weight
    dead, live = ((found.mechanism * forces).sum() for forces in (blocks.forces, blocks.horizontal))
    assert live > 0.0
    assert -dead / live == pytest.approx(found.factor, rel=1e-6)  # virtual work; dilatant joints take none


def test_water_pushes_as_its_integral_and_a_dam_slides_at_the_friction_of_statics() -> None:
    block = {"dam": brick(1.0, 2.0)}
    level, gravity = 1.5, 9.81
    water = {"kind": "pressure", "body": "1", "face": "left", "water_level": level}

    def dam(friction: float) -> bool:
        blocks = blockwork(friction, gravity=gravity, blocks=block, bodies=[{"block": "dam", "x": 0.5, "y": 1.0}],
            loads=[water])  # fmt: skip
        return bool(Programme(blocks).carries(blocks.forces).factor)

    needed = 9810.0 * level**2 / 2.0 / (2000.0 * gravity * 2.0)
    assert not dam(needed * (1.0 - EXACT))
    assert dam(needed * (1.0 + EXACT))


def test_the_horizontal_margin_is_that_of_the_weaker_side() -> None:
    blocks = {"b": brick(0.2, 0.4)}
    stands = blockwork(0.9, blocks=blocks, bodies=[{"block": "b", "x": 0.0, "y": 0.2}], ground={"tilt": "10 deg"})
    expected = math.tan(math.atan(0.5) - math.radians(10.0))
    assert horizontal_margin(stands) == pytest.approx((expected, expected), rel=1e-6)
    falls = blockwork(0.9, blocks=blocks, bodies=[{"block": "b", "x": 0.0, "y": 0.2}], ground={"tilt": "30 deg"})
    assert horizontal_margin(falls) is None


def test_the_horizontal_margin_of_a_block_below_a_lid_is_an_estimate_of_its_friction() -> None:
    """A lid that it would have to lift as it slides makes the bound infinite."""
    bodies = [{"block": "b", "x": 0.0, "y": 0.1}, {"block": "b", "x": 0.0, "y": 0.3, "fixed": True}]
    found = horizontal_margin(blockwork(0.4, blocks={"b": brick(0.4, 0.2)}, bodies=bodies))
    assert found == pytest.approx((math.inf, 0.4), rel=2e-3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"bodies": [{"block": "b", "x": 0.0, "y": 0.5}]}, "block 1 rests on nothing"),
        ({"bodies": [{"block": "b", "x": 0.0, "y": 0.1, "velocity": [1.0, 0.0]}]}, "body 1 moves at the start"),
        ({"bodies": [{"block": "b", "x": 0.0, "y": 0.1, "fixed": True}]}, "no block is free"),
        ({"motion": {"kind": "harmonic", "frequency": 1.0, "amplitude": 0.01}}, "supports move"),
    ],
)
def test_what_is_no_sustained_load_is_refused_with_the_reason(change: Mapping[str, object], reason: str) -> None:
    tables = {"blocks": {"b": brick(0.2, 0.2)}, "bodies": [{"block": "b", "x": 0.0, "y": 0.1}], **change}
    with pytest.raises(InvalidInputError, match=f"statics: {reason}"):
        blockwork(0.5, **tables)
