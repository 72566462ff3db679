"""Contact parameters of material pairs; the closed form of the clipped restitution against integration."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp

from blocksim.scenario import Scenario, place_bodies, scenario_from_mapping
from blocksim.world.interactions import (
    SMALLEST_RESTITUTION,
    ContactClass,
    contact_classes,
    damping_ratio,
    interaction,
    interaction_tables,
    interactions_of,
    restitution_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from blocksim.kernels.common.arrays import Records

ALUMINIUM = {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}
OAK = {"density": 700.0, "young_modulus": 11e9, "poisson_ratio": 0.4}
SIZES = {"width": 0.032, "height": 0.025, "length": 0.05}


def scenario(ground: Mapping[str, object] | None = None, **tables: Any) -> Scenario:
    """Return blocks of aluminium (two upright differently, so of different depth) and of oak."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "pairs",
            "materials": {"aluminium": ALUMINIUM, "oak": OAK},
            "blocks": {
                "paper": {**SIZES, "material": "aluminium", "upright": "length"},
                "flat": {**SIZES, "material": "aluminium"},
                "wooden": {**SIZES, "material": "oak"},
            },
            "bodies": [
                {"block": name, "x": 0.1 * i, "y": 0.1} for i, name in enumerate(("paper", "flat", "wooden", "flat"))
            ],
            "ground": ground or {},
            **tables,
        }
    )


def classes(of: Scenario) -> tuple[ContactClass, ...]:
    return contact_classes(of, place_bodies(of))


def table_of(of: Scenario) -> Records:
    table: Records = interaction_tables([interactions_of(of, classes(of))])[0]
    return table


def modulus(one: Mapping[str, float], two: Mapping[str, float]) -> float:
    return 1.0 / sum((1.0 - m["poisson_ratio"] ** 2) / m["young_modulus"] for m in (one, two))


def test_bodies_of_one_material_and_depth_share_a_class_after_the_ground() -> None:
    ground, *others = classes(scenario())
    assert ground == ContactClass(None, float("inf"))
    assert others == [ContactClass("aluminium", 0.025), ContactClass("aluminium", 0.05), ContactClass("oak", 0.05)]


def test_different_materials_add_their_compliances_and_the_shorter_depth_counts() -> None:
    of = scenario()
    _, paper, flat, wooden = classes(of)
    assert interaction(of, flat, wooden).normal_stiffness == pytest.approx(modulus(ALUMINIUM, OAK) * 0.05, rel=1e-12)
    assert interaction(of, paper, wooden).normal_stiffness == pytest.approx(modulus(ALUMINIUM, OAK) * 0.025, rel=1e-12)
    shear = sum(
        2.0 * (2.0 - m["poisson_ratio"]) * (1.0 + m["poisson_ratio"]) / m["young_modulus"] for m in (ALUMINIUM, OAK)
    )
    assert interaction(of, flat, wooden).shear_ratio == pytest.approx(4.0 / shear / modulus(ALUMINIUM, OAK), rel=1e-12)


def test_given_stiffness_replaces_that_of_the_materials_and_is_scaled() -> None:
    of = scenario(contact={"normal_stiffness": 1e6, "shear_stiffness_ratio": 0.5, "stiffness_scale": 3.0})
    table = table_of(of)
    assert set(table.normal_stiffness[1:].ravel().tolist()) == {3e6}
    assert set(table.shear_ratio[1:].ravel().tolist()) == {0.5}


def test_table_is_symmetric_and_empty_for_the_ground_alone() -> None:
    of = scenario()
    table = table_of(of)
    assert (table == table.T).all()
    assert not table[0, 0].normal_stiffness


def test_ground_and_blocks_have_their_own_friction_and_restitution() -> None:
    of = scenario(
        friction={
            "block_block": {"static": 0.31, "kinetic": 0.19, "transition_speed": 0.004},
            "block_ground": 0.38,
        },
        contact={"restitution": {"block_block": 0.3, "block_ground": 0.6}},
    )
    table = table_of(of)
    blocks, ground = table[1, 2], table[1, 0]
    assert (blocks.static_friction, blocks.kinetic_friction, blocks.transition_speed) == (0.31, 0.19, 0.004)
    assert (ground.static_friction, ground.kinetic_friction) == (0.38, 0.38)
    assert blocks.normal_damping == blocks.shear_damping == damping_ratio(0.3)
    assert ground.normal_damping == ground.shear_damping == damping_ratio(0.6)


def test_given_shear_damping_replaces_the_normal_one_in_shear_only() -> None:
    of = scenario(contact={"shear_damping_ratio": 0.05, "restitution": 0.2})
    ground, paper, *_ = classes(of)
    found = interaction(of, paper, ground)
    assert (found.normal_damping, found.shear_damping) == (damping_ratio(0.2), 0.05)


def row(of: Scenario, one: str, two: str | None) -> Any:
    """Return the parameters between a block type and another one, or the ground."""
    order = ["ground", "paper", "flat", "wooden"]
    return table_of(of)[order.index(one), order.index(two or "ground")]


def test_pair_of_its_own_counts_for_its_two_materials_only() -> None:
    special = {"restitution": 0.7, "normal_stiffness": 5e6, "shear_stiffness_ratio": 0.4, "shear_damping_ratio": 0.01}
    usual, of = scenario(), scenario(pairs={"aluminium": {"oak": {"friction": 0.9, **special}}})
    for block in ("paper", "flat"):
        mixed = row(of, block, "wooden")
        assert (mixed.static_friction, mixed.kinetic_friction) == (0.9, 0.9)
        assert (mixed.normal_stiffness, mixed.shear_ratio) == (5e6, 0.4)
        assert (mixed.normal_damping, mixed.shear_damping) == (damping_ratio(0.7), 0.01)
        assert row(of, block, "flat") == row(usual, block, "flat")
    assert row(of, "wooden", None) == row(usual, "wooden", None)


def test_ground_of_a_named_material_rubs_as_the_pair_of_the_materials_says() -> None:
    pairs = {"aluminium": {"oak": {"friction": 0.9}, "ground": {"restitution": 0.5}}}
    of = scenario(ground={"material": "oak"}, pairs=pairs)
    assert row(of, "paper", None).static_friction == 0.9
    assert row(of, "paper", None).normal_damping == damping_ratio(0.5)
    assert row(of, "wooden", None).normal_damping == damping_ratio(0.2)


def test_walls_are_ground_unless_they_have_a_material_of_their_own() -> None:
    plain, oaken = {"from": [1.0, 0.5], "to": [1.0, 0.0]}, {"from": [2.0, 0.5], "to": [2.0, 0.0], "material": "oak"}
    assert classes(scenario(walls=[plain])) == classes(scenario())
    of = scenario(walls=[plain, oaken], friction={"block_block": 0.2, "block_ground": 0.5})
    *usual, wall = classes(of)
    assert tuple(usual) == classes(scenario())
    assert wall == ContactClass("oak", float("inf"), is_wall=True)
    table = table_of(of)
    assert table[1, -1].normal_stiffness == pytest.approx(modulus(ALUMINIUM, OAK) * 0.025, rel=1e-12)
    assert table[1, -1].static_friction == 0.5
    assert not table[0, -1].normal_stiffness


def test_hertzian_stiffness_goes_with_the_modulus_and_the_root_of_the_radius() -> None:
    law = {"law": "hertz-mindlin"}
    usual, round_ = (
        row(scenario(contact=law), "flat", "wooden"),
        row(scenario(contact={**law, "contact_radius": 0.004}), "flat", "wooden"),
    )
    assert usual.normal_stiffness == pytest.approx(4.0 / 3.0 * modulus(ALUMINIUM, OAK) * 0.001**0.5, rel=1e-12)
    assert round_.normal_stiffness == pytest.approx(2.0 * usual.normal_stiffness, rel=1e-12)
    assert usual.shear_ratio == row(scenario(), "flat", "wooden").shear_ratio
    assert row(scenario(contact=law), "paper", None).normal_stiffness == pytest.approx(
        row(scenario(contact=law), "flat", None).normal_stiffness, rel=1e-12
    )  # the depth of a block has no part in it


def rebound(ratio: float, exponent: float = 1.0) -> float:
    """Return the speed at which x'' = -x^n - 2 z (n x^(n-1))^(1/2) x' from x = 0, x' = 1 has no force any more.

    In w = x^m, m = (n + 1)/2, the force is smooth: dw/ds = m x', dx'/ds = -(w + 2 z n^(1/2) x'), ds = x^(m-1) dt.
    """

    def force(_: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * ratio * sqrt(exponent) * state[1])

    force.terminal, force.direction = True, -1  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda s, state: [0.5 * (exponent + 1.0) * state[1], -force(s, state)],
        (0.0, 500.0),
        [0.0, 1.0],
        events=force,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    return -float(motion.y_events[0][0][1])


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.3, 0.5, 0.7, 0.72, 0.9, 0.999, 1.0, 1.001, 1.5, 3.0, 5.3])
def test_closed_form_is_the_rebound_of_a_contact_that_cannot_pull(ratio: float) -> None:
    assert restitution_of(ratio) == pytest.approx(rebound(ratio), abs=1e-8)


@given(e=st.floats(SMALLEST_RESTITUTION, 0.999999))
def test_damping_ratio_is_the_inverse_of_the_restitution(e: float) -> None:
    assert restitution_of(damping_ratio(e)) == pytest.approx(e, abs=1e-12)


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
def test_limits_are_an_undamped_contact_and_a_rebound_of_less_than_one_percent(law: str) -> None:
    assert restitution_of(0.0) == 1.0
    assert damping_ratio(1.0, law) == 0.0
    assert damping_ratio(0.0, law) == damping_ratio(SMALLEST_RESTITUTION, law)
    assert 0.0 < restitution_of(damping_ratio(0.0)) < 0.01


@pytest.mark.parametrize("e", [SMALLEST_RESTITUTION, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_hertzian_contact_rebounds_as_asked(e: float) -> None:
    assert rebound(damping_ratio(e, "hertz-mindlin"), 1.5) == pytest.approx(e, abs=1e-4)


@pytest.mark.parametrize("e", [-1e-9, 1.0000001, 2.0, float("nan")])
def test_restitution_outside_zero_to_one_is_refused(e: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        damping_ratio(e)
