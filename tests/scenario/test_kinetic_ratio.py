"""Kinetic friction written as a part of the static one."""

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Document, PairFriction, scenario_hash, scenario_to_toml

SIDE = "friction.block_block"


@pytest.fixture
def document(valid_text: str) -> Document:
    return Document.parse(valid_text)


def friction(document: Document, values: dict[str, object]) -> PairFriction:
    return document.with_values(values).build().friction.block_block


def test_kinetic_is_the_ratio_times_static(document: Document) -> None:
    assert friction(document, {SIDE: {"static": 0.5, "kinetic_ratio": 0.25}}).kinetic == 0.125
    assert friction(document, {SIDE: {"static": "45 deg", "kinetic_ratio": 1}}).kinetic == pytest.approx(1.0)


@pytest.mark.parametrize("start", [0.5, {"static": 0.5}, {"static": 0.5, "kinetic": 0.4}])
def test_setting_the_ratio_opens_a_bare_number_and_replaces_a_kinetic_one(document: Document, start: object) -> None:
    set_alone = friction(document, {SIDE: start, f"{SIDE}.kinetic_ratio": 0.25})
    assert (set_alone.static, set_alone.kinetic) == (0.5, 0.125)


def test_the_kinetic_friction_set_last_holds(document: Document) -> None:
    values = {SIDE: {"static": 0.5, "kinetic_ratio": 0.25}, f"{SIDE}.kinetic": 0.3}
    assert friction(document, values).kinetic == 0.3


def test_the_ratio_follows_a_static_friction_that_is_set_later(document: Document) -> None:
    values = {SIDE: {"static": 0.5, "kinetic_ratio": 0.25}, f"{SIDE}.static": 0.4}
    assert friction(document, values).kinetic == 0.1


def test_a_pair_of_materials_may_have_a_ratio(document: Document) -> None:
    made = document.with_values({SIDE: 0.5, "pairs.steel.steel.friction.kinetic_ratio": 0.5}).build()
    assert made.pairs["steel"]["steel"].friction == PairFriction(static=0.5, kinetic_ratio=0.5)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ({"static": 0.5, "kinetic": 0.4, "kinetic_ratio": 0.8}, "kinetic and kinetic_ratio mean the same"),
        ({"static": 0.5, "kinetic_ratio": 0}, "0 is too small; a plain number above 0 and at most 1 is needed"),
        ({"static": 0.5, "kinetic_ratio": 1.1}, "1.1 is too large"),
        ({"static": 0.5, "kinetic_ratio": "3 deg"}, "is an angle; a plain number"),
        ({"static": 0.5, "kinetic_rato": 0.5}, "unknown key, did you mean 'kinetic_ratio'?"),
    ],
)
def test_impossible_ratios_are_refused(document: Document, value: object, told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        friction(document, {SIDE: value})


def test_ratio_and_kinetic_friction_are_not_varied_together(document: Document) -> None:
    sweep = {"mode": "list", f"{SIDE}.kinetic": [0.1], f"{SIDE}.kinetic_ratio": [0.5]}
    with pytest.raises(ScenarioError, match=f"{SIDE}.kinetic, which means the same, is varied too"):
        document.with_values({"sweep": sweep}).build()


def test_a_resolved_ratio_is_the_same_scenario_and_the_same_run_as_its_value(document: Document) -> None:
    by_ratio = document.with_values({SIDE: {"static": 0.31, "kinetic_ratio": 0.62}}).build()
    by_value = document.with_values({SIDE: {"static": 0.31, "kinetic": 0.31 * 0.62}}).build()
    assert Document.parse(scenario_to_toml(by_ratio)).build() == by_ratio
    assert scenario_hash(by_ratio) == scenario_hash(by_value)
