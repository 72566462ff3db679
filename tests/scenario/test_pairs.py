"""Which key decides what holds between two materials."""

from typing import Any

import pytest

from blocksim.scenario import GROUND, Document, Scenario, resolve_pair, scenario_from_mapping
from blocksim.scenario.models.contact import PairFriction
from tests.scenario.conftest import MATERIAL, data_of


def scenario(**tables: object) -> Scenario:
    return scenario_from_mapping(scenario_data(**tables))


def scenario_data(**tables: object) -> dict[str, Any]:
    return data_of(materials={"oak": MATERIAL, "steel": MATERIAL, "sand": MATERIAL}, **tables)


def static_and_rule(made: Scenario, one: str, other: str, *, ground: bool) -> tuple[float, str]:
    pair = resolve_pair(made, one, other, ground=ground)
    return pair.friction.static, pair.rules["friction"]


def test_without_any_key_everything_is_a_default_or_follows_from_the_materials() -> None:
    block = resolve_pair(scenario(), "oak", "steel", ground=False)
    ground = resolve_pair(scenario(), "oak", GROUND, ground=True)
    assert (block.friction.static, ground.friction.static) == (0.31, 0.38)
    assert (block.restitution, ground.restitution) == (0.2, 0.2)
    assert block.normal_stiffness is block.shear_stiffness_ratio is block.shear_damping_ratio is None
    assert dict(block.rules) == {
        "friction": "default",
        "restitution": "default",
        "normal_stiffness": "materials",
        "shear_stiffness_ratio": "materials",
        "shear_damping_ratio": "default",
    }


def test_general_keys_are_named_where_they_are_given() -> None:
    made = scenario(
        friction={"block_ground": 0.5},
        contact={
            "restitution": {"block_block": 0.1},
            "normal_stiffness": 1e6,
            "shear_stiffness_ratio": 0.5,
            "shear_damping_ratio": 0.3,
        },
    )
    pair = resolve_pair(made, "oak", GROUND, ground=True)
    assert (pair.friction.static, pair.restitution) == (0.5, 0.2)
    assert (pair.normal_stiffness, pair.shear_stiffness_ratio, pair.shear_damping_ratio) == (1e6, 0.5, 0.3)
    assert dict(pair.rules) == {
        "friction": "friction.block_ground",
        "restitution": "default",
        "normal_stiffness": "contact.normal_stiffness",
        "shear_stiffness_ratio": "contact.shear_stiffness_ratio",
        "shear_damping_ratio": "contact.shear_damping_ratio",
    }
    assert resolve_pair(made, "oak", "oak", ground=False).rules["restitution"] == "contact.restitution.block_block"


@pytest.mark.parametrize("order", [("oak", "steel"), ("steel", "oak")])
def test_a_pair_of_blocks_may_be_given_and_asked_in_either_order(order: tuple[str, str]) -> None:
    made = scenario(friction={"block_block": 0.7}, pairs={order[0]: {order[1]: {"friction": 0.2}}})
    expected = (0.2, f"pairs.{order[0]}.{order[1]}.friction")
    assert static_and_rule(made, "oak", "steel", ground=False) == expected
    assert static_and_rule(made, "steel", "oak", ground=False) == expected
    assert static_and_rule(made, "oak", "oak", ground=False) == (0.7, "friction.block_block")
    assert static_and_rule(made, "oak", GROUND, ground=True) == (0.38, "default")


def test_every_quantity_looks_for_its_own_key() -> None:
    made = scenario(
        ground={"material": "sand"},
        pairs={"oak": {"ground": {"restitution": 0.1}, "sand": {"friction": 0.9, "restitution": 0.7}}},
    )
    pair = resolve_pair(made, "oak", GROUND, ground=True)
    assert (pair.friction.static, pair.restitution) == (0.9, 0.1)
    assert (pair.rules["friction"], pair.rules["restitution"]) == (
        "pairs.oak.sand.friction",
        "pairs.oak.ground.restitution",
    )


GROUND_PAIRS = {"ground": {"friction": 0.1}, "sand": {"friction": 0.2}, "steel": {"friction": 0.3}}


@pytest.mark.parametrize(
    ("given", "material", "other", "rule"),
    [
        ("ground sand", "sand", GROUND, "pairs.oak.ground.friction"),
        ("sand", "sand", GROUND, "pairs.oak.sand.friction"),
        ("sand", None, GROUND, "default"),
        ("steel", "sand", GROUND, "default"),
        ("ground steel", "sand", "steel", "pairs.oak.steel.friction"),
        ("ground sand", "sand", "steel", "pairs.oak.ground.friction"),
        ("sand", "sand", "steel", "default"),
    ],
)
def test_rules_on_the_ground_and_on_walls(given: str, material: str | None, other: str, rule: str) -> None:
    pairs = {"oak": {name: GROUND_PAIRS[name] for name in given.split()}}
    made = scenario(ground={} if material is None else {"material": material}, pairs=pairs)
    static, found = static_and_rule(made, "oak", other, ground=True)
    assert found == rule
    assert static == (0.38 if rule == "default" else GROUND_PAIRS[rule.split(".")[2]]["friction"])


def test_names_with_dots_are_quoted_in_rules() -> None:
    data = scenario_data(pairs={"S235.JR": {"ground": {"restitution": 0}}})
    data["materials"]["S235.JR"] = MATERIAL
    pair = resolve_pair(scenario_from_mapping(data), "S235.JR", GROUND, ground=True)
    assert (pair.restitution, pair.rules["restitution"]) == (0.0, 'pairs."S235.JR".ground.restitution')


PROMOTED = [
    ({"friction": 0.5}, (0.5, 0.1)),
    ({"friction": "45 deg"}, (pytest.approx(1.0), 0.1)),
    ({"friction": {"static": 0.5, "kinetic": 0.4}}, (0.5, 0.1)),
    ({"restitution": 0.5}, (0.6, 0.1)),
    (None, (0.6, 0.1)),
]


@pytest.mark.parametrize(("pair", "expected"), PROMOTED)
@pytest.mark.parametrize("key", ["pairs.oak.ground.friction.kinetic", "pairs.ground.oak.friction.kinetic"])
def test_setting_the_kinetic_friction_of_a_pair_keeps_the_static_one(
    pair: dict[str, object] | None, expected: tuple[float, float], key: str
) -> None:
    pairs = {} if pair is None else {"pairs": {"oak": {"ground": pair}}}
    document = Document.from_mapping(scenario_data(friction={"block_ground": 0.6}, **pairs))
    friction = resolve_pair(document.with_values({key: 0.1}).build(), "oak", GROUND, ground=True).friction
    assert (friction.static, friction.kinetic) == expected


def test_a_pair_that_is_set_in_the_other_order_stays_one_pair() -> None:
    given = scenario_data() | {"pairs": {"oak": {"steel": {"restitution": 0.1}}}}
    document = Document.from_mapping(given).with_values({"pairs.steel.oak.restitution": 0.3})
    assert document.build().pairs["oak"].keys() == {"steel"}
    assert resolve_pair(document.build(), "steel", "oak", ground=False).restitution == 0.3


def test_the_friction_of_a_new_pair_of_blocks_starts_from_the_default() -> None:
    document = Document.from_mapping(scenario_data()).with_values({"pairs.oak.steel.friction.kinetic": 0.1})
    friction = resolve_pair(document.build(), "oak", "steel", ground=False).friction
    assert friction == PairFriction(static=0.31, kinetic=0.1)
