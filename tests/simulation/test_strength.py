"""Strength reduction: a factor is what frictions and cohesions divided by hand are, for joints and for soil alone."""

import math
from typing import Any

import numpy as np
import pytest

import blocksim
from blocksim.scenario import GROUND, Model, Scenario
from blocksim.simulation import Result
from blocksim.study.static_limit import static_limit
from blocksim.world.interactions import contact_classes, interactions_of
from blocksim.world.systems.soil_arrays import build_soils, interactions_with
from blocksim.world.systems.soils import SOILS
from tests.soils import DEPTH, column, scene
from tests.study.plans import SQUAT, block_on_a_slope

FACTOR = 1.5
ANGLE = math.radians(20.0)  # of clay
WALL: dict[str, Any] = {
    "blocks": {"wall": {"width": 0.04, "height": 0.06, "length": DEPTH, "material": "soft"}},
    "bodies": [{"block": "wall", "x": -0.02, "y": 0.03}],
}


def same(one: Result, other: Result) -> bool:
    names = ("x", "y", "angle", "vx", "vy", "spin")
    return all(np.array_equal(getattr(one.frames, name), getattr(other.frames, name)) for name in names)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_a_run_with_a_factor_is_that_of_frictions_divided_by_hand_to_the_bit(scheme: str) -> None:
    data = {**block_on_a_slope(SQUAT), "ground": {"tilt": "25 deg"}, "time": {"scheme": scheme, "end": 0.05}}
    upper = {"block": "b", "x": 0.02, "y": 0.075}
    data["bodies"] = [*data["bodies"], upper]
    full = {"block_block": {"static": 0.4, "kinetic": 0.35}, "block_ground": {"static": 0.6, "kinetic": 0.5}}
    by_hand = {side: {name: value / FACTOR for name, value in pair.items()} for side, pair in full.items()}
    reduced = blocksim.run({**data, "friction": full, "strength": {"factor": FACTOR}})
    assert same(reduced, blocksim.run({**data, "friction": by_hand}))
    assert not same(reduced, blocksim.run({**data, "friction": full}))


def walled(angle: float, cohesion: float, friction: float, **more: Any) -> Scenario:
    """Return clay behind a block, with a friction between them and the ground."""
    clay = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.49}  # at rest within either surface
    strong = {**clay, "friction_angle": f"{angle!r} rad", "cohesion": cohesion}
    soft = {"density": 2700.0, "young_modulus": 5.84e6, "poisson_ratio": 0.3}
    pairs = {"clay": {"soft": {"friction": friction}, GROUND: {"friction": friction}}}
    rules = {"block_block": friction, "block_ground": friction}
    tables = {"materials": {"clay": strong, "soft": soft}, "pairs": pairs, "friction": rules, **WALL, **more}
    return scene(column(0.05, 0.05, 0.005, material="clay"), end=0.01, **tables)


def test_a_run_of_soil_with_a_factor_is_that_of_weaker_soil_to_the_bit() -> None:
    weaker = math.atan(math.tan(ANGLE) / FACTOR)
    reduced = blocksim.run(walled(ANGLE, 300.0, 0.4, strength={"factor": FACTOR}))
    assert same(reduced, blocksim.run(walled(weaker, 300.0 / FACTOR, 0.4 / FACTOR)))
    assert not same(reduced, blocksim.run(walled(ANGLE, 300.0, 0.4)))


@pytest.mark.parametrize("of", [["soil"], ["joints"], ["soil", "joints"]])
def test_a_factor_divides_what_it_is_of_and_leaves_pressure_at_rest(of: list[str]) -> None:
    table = column(0.05, 0.1, 0.005, material="clay")
    pairs: Any = {"clay": {"soft": {"friction": {"static": 0.4, "kinetic": 0.3}}}}
    full, reduced = (
        Model(scene(table, pairs=pairs, strength=one, **WALL)) for one in ({}, {"factor": FACTOR, "of": of})
    )
    joints, soil = (FACTOR if part in of else 1.0 for part in ("joints", "soil"))
    for name in ("static_friction", "kinetic_friction"):  # with the ground as soil's own
        one, other = (interactions_with(model)[name] for model in (full, reduced))
        assert one.max() > 0.0
        np.testing.assert_array_equal(other, one / joints)
        one, other = (
            np.array(
                [
                    [getattr(pair, name) for pair in row]
                    for row in interactions_of(model.scenario, contact_classes(model))
                ]
            )
            for model in (full, reduced)
        )
        np.testing.assert_array_equal(other, one / joints)
    (record,) = build_soils(reduced).kinds
    weaker = math.atan(math.tan(ANGLE) / soil)
    assert (record.slope, record.cohesion) == pytest.approx((math.sin(weaker) / 3.0, 1e3 / soil * math.cos(weaker)))
    np.testing.assert_array_equal(SOILS.elements(full).start, SOILS.elements(reduced).start)


def test_the_factor_of_a_block_on_an_incline_is_friction_over_slope_by_statics(tmp_path: Any) -> None:
    slope = {**block_on_a_slope(SQUAT), "ground": {"tilt": "10 deg"}, "friction": {"block_ground": 0.6}}
    (found,) = static_limit(slope, {"strength.factor": {"from": 1.0, "to": 5.0}}, out=tmp_path / "slope").limits
    assert found.low <= 0.6 / math.tan(math.radians(10.0)) <= found.high
    push = {"kind": "force", "body": "1", "magnitude": 0.2 * 2500 * 0.1 * 0.05 * 0.1 * 9.81}
    pushed = {**block_on_a_slope(SQUAT), "friction": {"block_ground": 0.6}, "loads": [push]}
    (found,) = static_limit(pushed, {"strength.factor": {"from": 1.0, "to": 5.0}}, out=tmp_path / "push").limits
    assert found.low <= 3.0 <= found.high


def test_a_factor_of_one_is_no_other_scenario() -> None:
    plain = block_on_a_slope(SQUAT)
    assert Model(plain).hash == Model({**plain, "strength": {"factor": 1.0, "of": ["soil"]}}).hash
    assert Model(plain).hash != Model({**plain, "strength": {"factor": 1.1}}).hash
