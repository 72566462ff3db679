"""The resolved file means the same to the last bit, and the hash tells scenarios apart."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from blocksim.scenario import Document, Model, Scenario, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.overrides import freeze
from blocksim.scenario.resolution import deciding_values


def again(scenario: Scenario) -> Scenario:
    return Document.parse(scenario_to_toml(scenario)).build()


def test_a_shipped_scenario_is_written_and_loaded_bit_equal(shipped: Path) -> None:
    scenario = load_scenario(shipped)
    assert scenario.name == shipped.stem
    assert again(scenario) == scenario
    assert repr(again(scenario)) == repr(scenario)
    assert Model(again(scenario)).hash == Model(scenario).hash
    assert scenario_to_toml(again(scenario)) == scenario_to_toml(scenario)


HASHED = tomllib.loads(Path(__file__).with_name("other_values.toml").read_text())
OTHER_SHAPES = {"blocks.b.outline", "blocks.b.sides", "blocks.b.radius", "blocks.b.depth"}
"""Tried by themselves, below: a block has one shape."""
SINGLE_CHOICE = {"schema", "time.scheme", "materials.m.unit_weight", "motion.kind", "probes.0.kind", "loads.0.kind"}
SINGLE_CHOICE |= {"loads.0.history.kind", "actuators.0.displacement.kind"}
OF_SOILS = ("friction_angle", "cohesion", "dilation", "yield_surface")
"""Keys that a block's material does not have; tests/scenario/models/test_soil.py looks at them."""


@pytest.fixture
def data() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("all_tables.toml").read_text())


def leaves(table: BaseModel, path: str = "") -> Iterator[str]:
    """Yield the dotted key of every single value below a table."""
    for name, info in type(table).model_fields.items():
        value = getattr(table, name)
        key = path + (info.alias or name)
        if isinstance(value, BaseModel):
            yield from leaves(value, key + ".")
        elif isinstance(value, dict):
            yield from leaves_of_named(value, key)
        elif value and isinstance(value, tuple) and isinstance(value[0], BaseModel):
            yield from leaves(value[0], key + ".0.")
        else:
            yield key


def leaves_of_named(entries: dict[str, Any], key: str) -> Iterator[str]:
    for name, entry in entries.items():
        if isinstance(entry, dict):
            yield from leaves_of_named(entry, f"{key}.{name}")
        else:
            yield from leaves(entry, f"{key}.{name}.")


@pytest.mark.parametrize("key", HASHED)
def test_the_hash_changes_with_every_value_that_decides_the_motion(data: dict[str, Any], key: str) -> None:
    document = Document.from_mapping(data)
    values = {key: HASHED[key]} | ({"structures.0.overlap": 1.0} if HASHED[key] == "staircase" else {})
    assert Model(document.with_values(values).build()).hash != Model(document.build()).hash


def test_every_key_is_either_hashed_or_known_not_to_matter(data: dict[str, Any]) -> None:
    found = set(leaves(scenario_from_mapping(data)))
    unmoved = {"description", "experiment", "sweep"}
    others = {key for key in found if key.startswith(("materials.n.", "blocks.c."))}
    others |= {f"materials.m.{key}" for key in OF_SOILS}
    assert found - others - OTHER_SHAPES - SINGLE_CHOICE - unmoved == set(HASHED)


WEDGE = {"outline": [[0, 0], [1, 0], [0, 1]], "depth": 1, "material": "m"}
HEXAGON = {"sides": 6, "radius": 1, "depth": 1, "material": "m"}


@pytest.mark.parametrize(
    ("block", "change"),
    [
        (WEDGE, {"depth": 2}),
        (WEDGE, {"outline": [[0, 0], [1, 0], [0, 1.5]]}),
        (HEXAGON, {"depth": 2}),
        (HEXAGON, {"sides": 5}),
        (HEXAGON, {"radius": 2}),
    ],
)
def test_the_hash_changes_with_every_key_of_an_outline(
    data: dict[str, Any], block: dict[str, Any], change: dict[str, Any]
) -> None:
    one, other = (Scenario.model_validate(freeze({**data, "blocks": {"b": b}})) for b in (block, {**block, **change}))
    assert Model(one).hash != Model(other).hash
    for scenario in (one, other):
        text = scenario_to_toml(scenario)
        assert Scenario.model_validate(freeze(tomllib.loads(text))) == scenario
        assert "upright" not in text


def test_the_hash_ignores_what_does_not_move_anything(data: dict[str, Any]) -> None:
    document = Document.from_mapping(data)
    unmoved = {
        "description": "text",
        "experiment.table": __file__,
        "sweep": {"time.end": [1, 2]},
        "provenance": {"time.end": "measured"},
        "time.end": "2000 ms",
        "friction.block_block": 0.31,
        "blocks.b.along": "width",
    }
    for key, value in unmoved.items():
        assert Model(document.with_values({key: value}).build()).hash == Model(document.build()).hash, key
    outlined = {"width", "height", "length", "upright", "along", "material"}  # and none of the keys of outlines
    assert set(deciding_values(document.build())["blocks"]["b"]) == outlined


def test_resolved_scenario_has_the_keys_of_its_scheme_and_a_sweep_over_schemes(data: dict[str, Any]) -> None:
    for scheme in ("explicit", "nonsmooth"):
        scenario = Document.from_mapping({**data, "time": {"scheme": scheme}}).build()
        text = scenario_to_toml(scenario)
        assert ("safety" in text, "substeps" in text) == (scheme == "explicit", scheme == "nonsmooth")
        assert again(scenario) == scenario
    swept = Document.from_mapping({**data, "sweep": {"time.scheme": ["explicit", "nonsmooth"]}}).build()
    assert again(swept) == swept
