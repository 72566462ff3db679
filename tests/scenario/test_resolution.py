"""The resolved file means the same to the last bit, and the hash tells scenarios apart."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from blocksim.scenario import (
    Document,
    Scenario,
    load_scenario,
    scenario_from_mapping,
    scenario_hash,
    scenario_to_toml,
)
from blocksim.scenario.overrides import freeze
from blocksim.scenario.resolution import deciding_values

REPOSITORY = Path(__file__).parents[2]


def again(scenario: Scenario) -> Scenario:
    return Document.parse(scenario_to_toml(scenario)).build()


def test_a_shipped_scenario_is_written_and_loaded_bit_equal(shipped: Path) -> None:
    scenario = load_scenario(shipped)
    assert again(scenario) == scenario
    assert repr(again(scenario)) == repr(scenario)
    assert scenario_hash(again(scenario)) == scenario_hash(scenario)
    assert scenario_to_toml(again(scenario)) == scenario_to_toml(scenario)


def test_a_sweep_is_written_as_lists_of_values(valid_text: str) -> None:
    tilts = '"ground.tilt" = { from = "1 deg", to = "2 deg", count = 2 }'
    scenario = Document.parse(f'{valid_text}\n[sweep]\nmode = "list"\n{tilts}\n"time.end" = [1, 2]\n').build()
    assert again(scenario) == scenario
    assert '"ground.tilt" = [\n    "1 deg",\n    "2 deg",\n]' in scenario_to_toml(scenario)


def test_the_experiment_table_can_be_renamed(tmp_path: Path) -> None:
    scenario = load_scenario(REPOSITORY / "scenarios" / "three_blocks_nominal.toml")
    (tmp_path / "copy.csv").touch()
    (tmp_path / "scenario.toml").write_text(scenario_to_toml(scenario, experiment_table="copy.csv"))
    experiment = load_scenario(tmp_path / "scenario.toml").experiment
    assert experiment is not None
    assert experiment.table == tmp_path / "copy.csv"


OTHER_VALUES = """
name = "other"
gravity = 9.8
materials.m = { density = 2.0, young_modulus = 2.0, poisson_ratio = 0.1 }
blocks.b = { width = 2.0, height = 2.0, length = 2.0, upright = "length", along = "length", material = "n" }
structures.0 = { block = "c", kind = "staircase", count = 2, left = 0.1, bottom = 0.1, offset = 0.1 }
structures.0.velocity = [1, 0]
structures.0.shear_velocity = 1
bodies.0 = { block = "c", x = 11, y = 11, angle = "1 deg", velocity = [0, 1], spin = 1, fixed = true, name = "x" }
ground = { tilt = "1 deg", material = "n", profile = [[0, 0], [1, 0]] }
walls.0 = { from = [-12, 0], to = [-9, 0], material = "n" }
friction.block_block = { static = 0.32, kinetic = 0.1, kinetic_ratio = 0.5, transition_speed = 0.1 }
friction.block_ground = { static = 0.39, kinetic = 0.1, kinetic_ratio = 0.5, transition_speed = 0.1 }
motion = { amplitude = 0.1, frequency = 2, phase = "1 deg", direction = "1 deg", start = 0.1, duration = 8, ramp = 0.5 }
pairs.m.n = { restitution = 0.1, normal_stiffness = 1.0, shear_stiffness_ratio = 0.82, shear_damping_ratio = 0.1 }
pairs.m.n.friction = { static = 0.32, kinetic = 0.1, kinetic_ratio = 0.5, transition_speed = 0.1 }
contact.model = "kernel"
contact.law = "hertz-mindlin"
contact.restitution = { block_block = 0.1, block_ground = 0.1 }
contact.stiffness_scale = 0.1
contact.normal_stiffness = 1.0
contact.shear_stiffness_ratio = 0.82
contact.shear_damping_ratio = 0.1
contact.max_overlap = 0.1
contact.skin = 0.1
contact.contact_radius = 0.1
contact.particle_spacing = 0.1
contact.smoothing_length = 0.1
contact.kernel = "cubic-spline"
time = { end = 1.0, step = 1e-6, safety = 0.1, force_step = true, stop_at_rest = false, rest_speed = 1, rest_hold = 1 }
output = { every = 1.0, contacts = true }
probes.0 = { name = "crown", every = "step", body = "2", at = [0.1, 0] }
loads.0 = { name = "push", body = "2", magnitude = 2, direction = "1 deg", axes = "body", point = [0.1, 0] }
start = { settle = false, hold = ["2"], release = "always" }
"""


def flat(table: dict[str, Any], path: str = "") -> dict[str, Any]:
    """Return values by dotted keys."""
    found: dict[str, Any] = {}
    for key, entry in table.items():
        found |= flat(entry, f"{path}{key}.") if isinstance(entry, dict) else {path + key: entry}
    return found


HASHED = {key: value for line in OTHER_VALUES.splitlines() for key, value in flat(tomllib.loads(line)).items()}
RAMP = {"kind": "ramp", "distance": 1, "duration": 1}
HASHED |= {"bodies.0.motion": RAMP, "events": [{"at": 1, "remove": ["1"]}]}
OTHER_SHAPES = {"blocks.b.outline", "blocks.b.sides", "blocks.b.radius", "blocks.b.depth"}
"""Tried by themselves, below: a block has one shape."""
SINGLE_CHOICE = {
    "schema",
    "time.scheme",
    "materials.m.unit_weight",
    "motion.kind",
    "probes.0.kind",
    "loads.0.kind",
    "loads.0.history.kind",
}


@pytest.fixture
def data() -> dict[str, Any]:
    material = {"density": 1, "young_modulus": 1, "poisson_ratio": 0}
    block = {"width": 1, "height": 1, "length": 1, "material": "m"}
    return {
        "schema": 1,
        "name": "a",
        "materials": {"m": material, "n": material},
        "blocks": {"b": block, "c": block},
        "structures": [{"kind": "stack", "block": "b", "count": 1}],
        "bodies": [{"block": "b", "x": 10, "y": 10}],
        "walls": [{"from": [-10, 0], "to": [-10, 1]}],
        "pairs": {"m": {"n": {"friction": 0.3}}},
        "motion": {"kind": "harmonic", "amplitude": 1, "frequency": 1},
        "probes": [{"kind": "point", "body": "1"}],
        "loads": [{"kind": "force", "body": "1", "magnitude": 1}],
        "start": {"settle": True},
    }


OF_SOILS = ("friction_angle", "cohesion", "dilation", "yield_surface")
"""Keys that a block's material does not have; tests/scenario/models/test_soil.py looks at them."""


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
    assert scenario_hash(document.with_values(values).build()) != scenario_hash(document.build())


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
    assert scenario_hash(one) != scenario_hash(other)
    for scenario in (one, other):
        text = scenario_to_toml(scenario)
        assert Scenario.model_validate(freeze(tomllib.loads(text))) == scenario
        assert "upright" not in text


def test_rectangles_are_hashed_without_the_keys_of_outlines(data: dict[str, Any]) -> None:
    keys = {"width", "height", "length", "upright", "along", "material"}
    assert set(deciding_values(scenario_from_mapping(data))["blocks"]["b"]) == keys


@pytest.mark.parametrize(
    "values",
    [
        {"description": "text"},
        {"experiment.table": __file__},
        {"sweep": {"time.end": [1, 2]}},
        {"provenance": {"time.end": "measured"}},
        {"time.end": "2000 ms"},
        {"friction.block_block": 0.31},
        {"blocks.b.along": "width"},
    ],
)
def test_the_hash_ignores_what_does_not_move_anything(data: dict[str, Any], values: dict[str, object]) -> None:
    document = Document.from_mapping(data)
    assert scenario_hash(document.with_values(values).build()) == scenario_hash(document.build())


def test_resolved_sweep_over_schemes_can_be_read_again(data: dict[str, Any]) -> None:
    sweep = {"time.scheme": ["explicit", "nonsmooth"]}
    swept = Document.from_mapping({**data, "sweep": sweep}).build()
    again = Document.parse(scenario_to_toml(swept)).build()
    assert again.sweep == swept.sweep
    assert scenario_hash(again) == scenario_hash(swept)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_resolved_scenario_has_the_keys_of_its_scheme(data: dict[str, Any], scheme: str) -> None:
    scenario = Document.from_mapping({**data, "time": {"scheme": scheme}}).build()
    text = scenario_to_toml(scenario)
    assert ("safety" in text, "substeps" in text) == (scheme == "explicit", scheme == "nonsmooth")
    assert Document.parse(text).build() == scenario
