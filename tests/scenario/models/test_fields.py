"""What fields of a scenario take, long and short forms of contacts and loads, and the JSON Schema of all of them."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from blocksim.errors import ScenarioError
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import (
    Document,
    Model,
    Scenario,
    json_schema,
    load_scenario,
    scenario_from_mapping,
    scenario_to_toml,
)
from blocksim.scenario.geometry import edge_distance
from blocksim.scenario.models.base import OneOf, Whole
from blocksim.scenario.models.contact import Contact
from blocksim.scenario.models.geometry import Material
from blocksim.scenario.models.loads import Gravity, Stretch, VaryingLoad, stretches_of
from blocksim.scenario.models.timeline import NewVelocity
from blocksim.simulation.files import RESULTS, default_folder
from tests.scenario.conftest import VALID, data_of


def test_whole_number_is_no_flag_and_in_its_range() -> None:
    for value in (True, 1.0, "2", 0, 6):
        with pytest.raises(PydanticCustomError, match="is not a whole number from 1 to 5"):
            Whole(1, 5).read(value)
    assert [Whole(1, 5).read(one) for one in (1, 5)] == [1, 5]


def test_word_is_one_of_those_that_are_available() -> None:
    for value in ("spheres", 2, 1.0, True):
        with pytest.raises(PydanticCustomError, match="is unknown"):
            OneOf(("discs", 1)).read(value)


def test_distance_from_an_edge_is_that_from_its_end_beyond_it() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert edge_distance(np.array([[3.0, 0.5], [0.5, 0.25], [4.0, 5.0]]), square) == pytest.approx([2.0, 0.25, 5.0])


def test_velocity_of_an_event_may_be_one_component_alone() -> None:
    for key in ("vx", "vy", "spin"):
        assert getattr(NewVelocity.model_validate({"body": "1", key: 0.5}), key) == 0.5


def test_a_material_has_either_density_or_unit_weight() -> None:
    stone = {"young_modulus": 1.0, "poisson_ratio": 0.0}
    for given in ({}, {"density": 1.0, "unit_weight": 9.81}):
        with pytest.raises(ValidationError, match="density"):
            Material.model_validate({**stone, **given})


HOSTILE = (
    *("../../x", "/etc/x", "..", ".", "a/b", "a\\b", "C:x", "", " ", "a b", "-rf", ".hidden", "x" * 101, "x" * 300),
    *("prn.", "a.", "a\0", "a\n", "a\x1b[2J", "\u202egnp.exe"),
    *("caf\u00e9", "\U0001f4a9", "a\u200b", "<b>", "$(id)", "`id`", "%s", "*", "?", "|", '"', "'", "~root", "\u2215"),
)
FINE = ("a", "three_blocks", "7", "a.b-c_D", "CON", "com1", "nul.x", "x" * 100)


def test_names_are_those_of_folders_everywhere_and_editors_are_told_the_same() -> None:
    for name in HOSTILE:
        with pytest.raises(ScenarioError, match="is not a name"):
            scenario_from_mapping(data_of(name=name))
    for name in FINE:
        folder = default_folder(Model(scenario_from_mapping(data_of(name=name))))
        assert folder.parent.name == name
        assert folder.resolve().parent.parent == RESULTS.resolve()
    pattern = json_schema()["properties"]["name"]["pattern"].replace("$", r"\Z")  # it allows no line feed behind it
    assert [name for name in (*HOSTILE, *FINE) if re.search(pattern, name)] == list(FINE)


SIDE = "friction.block_block"


@pytest.mark.parametrize(
    ("given", "length", "support"),
    [
        ({}, 0.0013, 0.0026),
        ({"particle_spacing": 0.002}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "cubic-spline"}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "quintic-spline"}, 0.0026, 0.0078),
        ({"particle_spacing": 0.002, "smoothing_length": 0.0016}, 0.0016, 0.0032),
    ],
)
def test_smoothing_length_and_reach_of_the_kernel(given: dict[str, object], length: float, support: float) -> None:
    contact = Contact.model_validate({"model": "kernel", **given})
    reach = support_radius(KERNEL_CODES[contact.kernel], contact.resolved_smoothing_length)
    assert [contact.resolved_smoothing_length, reach] == pytest.approx([length, support])


def test_a_resolved_ratio_is_the_same_scenario_and_the_same_run_as_its_value() -> None:
    document = Document.parse(VALID)
    by_ratio = document.with_values({SIDE: {"static": 0.31, "kinetic_ratio": 0.62}}).build()
    by_value = document.with_values({SIDE: {"static": 0.31, "kinetic": 0.31 * 0.62}}).build()
    assert Document.parse(scenario_to_toml(by_ratio)).build() == by_ratio
    assert Model(by_ratio).hash == Model(by_value).hash


CUBE = {"width": 1, "height": 1, "length": 1, "material": "oak"}
BODIES: list[dict[str, Any]] = [
    {"block": "cube", "x": 0, "y": 0.5},
    {"block": "cube", "x": 1, "y": 0.5, "fixed": True},
]


def data_with(*loads: dict[str, Any], bodies: list[dict[str, Any]] = BODIES) -> dict[str, Any]:
    return data_of(blocks={"cube": CUBE}, bodies=bodies, loads=list(loads))


def scenario(*loads: dict[str, Any], folder: Path | None = None) -> Scenario:
    return scenario_from_mapping(data_with(*loads), *([] if folder is None else [folder]))


FORCE: dict[str, Any] = {"kind": "force", "body": "1", "magnitude": "2 kN"}


def test_a_table_is_read_and_the_resolved_scenario_needs_it_no_more(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text("# jack\ntime_s,factor\n0.5,1\n1.5,3\n")
    (tmp_path / "tilt.csv").write_text("time_s,tilt_deg\n0,0\n10,20\n")
    read = scenario(
        {**FORCE, "history": {"kind": "table", "table": "load.csv"}},
        {"kind": "gravity", "table": "tilt.csv"},
        folder=tmp_path,
    )
    one, two = read.loads
    assert isinstance(one, VaryingLoad)
    assert stretches_of(one, 0.0) == (Stretch(0.0, 1.0, 0.0), Stretch(0.5, 1.0, 2.0), Stretch(1.5, 3.0, 0.0))
    assert isinstance(two, Gravity)
    assert two.tilts == pytest.approx((0.0, 0.3490658503988659))
    (tmp_path / "scenario.toml").write_text(scenario_to_toml(read))
    for name in ("load.csv", "tilt.csv"):
        (tmp_path / name).unlink()
    again = load_scenario(tmp_path / "scenario.toml")
    assert again == read
    assert Model(again).hash == Model(read).hash


def test_a_load_is_set_by_its_name() -> None:
    named = data_with(FORCE, {**FORCE, "name": "push"})
    changed = load_scenario(named, {"loads.push.magnitude": "5 kN"})
    assert [getattr(load, "magnitude", None) for load in changed.loads] == [2000.0, 5000.0]
    for name, told in ("pull", "known: push"), ("psh", "did you mean 'push'"):
        with pytest.raises(ScenarioError, match=f'loads has no "{name}", {told}'):
            load_scenario(named, {f"loads.{name}.magnitude": "5 kN"})


FORMS: dict[str, list[str]] = tomllib.loads(Path(__file__).with_name("schema.toml").read_text())


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = json_schema()
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    return Draft202012Validator(schema)


def test_shipped_scenarios_are_valid_as_written_and_resolved(validator: Draft202012Validator, shipped: Path) -> None:
    validator.validate(tomllib.loads(shipped.read_text()))
    validator.validate(tomllib.loads(scenario_to_toml(load_scenario(shipped))))


@pytest.mark.parametrize("addition", FORMS["valid"], ids=lambda text: text.strip().splitlines()[-1])
def test_every_form_of_a_value_is_valid(validator: Draft202012Validator, addition: str) -> None:
    validator.validate(tomllib.loads(f"{VALID}\n{addition}\n"))


@pytest.mark.parametrize("addition", FORMS["wrong"], ids=lambda text: text.strip().splitlines()[-1])
def test_mistakes_are_refused(validator: Draft202012Validator, addition: str) -> None:
    assert not validator.is_valid(tomllib.loads(f"{VALID}\n{addition}\n"))


def test_every_key_is_described() -> None:
    schema = json_schema()
    tables: dict[str, Any] = {"Scenario": schema, **schema["$defs"]}
    missing = [
        f"{name}.{key}"
        for name, table in tables.items()
        for option in [table, *table.get("anyOf", [])]
        for key, entry in option.get("properties", {}).items()
        if not entry.get("description")
    ]
    assert missing == []
