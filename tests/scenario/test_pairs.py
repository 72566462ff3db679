"""Which key decides what holds between two materials."""

from typing import Any

import pytest

from blocksim.scenario import GROUND, Scenario, resolve_pair, scenario_from_mapping
from tests.golden import Golden
from tests.scenario.conftest import MATERIAL, data_of


def scenario_data(**tables: object) -> dict[str, Any]:
    return data_of(materials={"oak": MATERIAL, "steel": MATERIAL, "sand": MATERIAL, "S235.JR": MATERIAL}, **tables)


def scenario(**tables: object) -> Scenario:
    return scenario_from_mapping(scenario_data(**tables))


def static_and_rule(made: Scenario, one: str, other: str, *, ground: bool) -> tuple[float, str]:
    pair = resolve_pair(made, one, other, ground=ground)
    return pair.friction.static, pair.rules["friction"]


def test_general_keys_are_named_where_they_are_given_and_others_are_defaults(golden: Golden) -> None:
    stiff = {"normal_stiffness": 1e6, "shear_stiffness_ratio": 0.5, "shear_damping_ratio": 0.3}
    contact = {"restitution": {"block_block": 0.1}, **stiff}
    told = []
    for made in (scenario(), scenario(friction={"block_ground": 0.5}, contact=contact)):
        for other, ground in (("steel", False), (GROUND, True)):
            pair = resolve_pair(made, "oak", other, ground=ground)
            values = {name: getattr(pair, name) for name in ("restitution", *stiff)}
            rules = [f"{name} = {value} ({pair.rules[name]})" for name, value in values.items()]
            told.append(f"friction = {pair.friction.static} ({pair.rules['friction']}), {', '.join(rules)}")
    golden("\n".join(told))


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
    made = scenario(pairs={"S235.JR": {"ground": {"restitution": 0}}})
    pair = resolve_pair(made, "S235.JR", GROUND, ground=True)
    assert (pair.restitution, pair.rules["restitution"]) == (0.0, 'pairs."S235.JR".ground.restitution')
