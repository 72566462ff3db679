"""The JSON Schema accepts what loading accepts, and refuses typos."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from blocksim.scenario import json_schema, load_scenario, scenario_to_toml

FORMS: dict[str, list[str]] = tomllib.loads(Path(__file__).with_name("schema.toml").read_text())


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    return Draft202012Validator(json_schema())


def test_it_is_a_schema() -> None:
    schema = json_schema()
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_shipped_scenarios_are_valid_as_written_and_resolved(validator: Draft202012Validator, shipped: Path) -> None:
    validator.validate(tomllib.loads(shipped.read_text()))
    validator.validate(tomllib.loads(scenario_to_toml(load_scenario(shipped))))


@pytest.mark.parametrize("addition", FORMS["valid"], ids=lambda text: text.strip().splitlines()[-1])
def test_every_form_of_a_value_is_valid(validator: Draft202012Validator, valid_text: str, addition: str) -> None:
    validator.validate(tomllib.loads(f"{valid_text}\n{addition}\n"))


@pytest.mark.parametrize("addition", FORMS["wrong"], ids=lambda text: text.strip().splitlines()[-1])
def test_mistakes_are_refused(validator: Draft202012Validator, valid_text: str, addition: str) -> None:
    assert not validator.is_valid(tomllib.loads(f"{valid_text}\n{addition}\n"))


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
