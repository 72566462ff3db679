"""The JSON Schema accepts what loading accepts, and refuses typos."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from blocksim.scenario import json_schema, load_scenario, scenario_to_toml

WALL = '[[structures]]\nkind = "wall"\nblock = "brick"\nrows = 2\ncolumns = 2\n'


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


@pytest.mark.parametrize(
    "addition",
    [
        '[friction]\nblock_block = { static = 0.3, kinetic = "11 deg", transition_speed = "5 mm/s" }',
        '[friction]\nblock_ground = "21 deg"',
        "[contact]\nrestitution = 0.5",
        "[contact]\nrestitution = { block_block = 0.5 }",
        '[contact]\nmodel = "kernel"\nlaw = "hertz-mindlin"\nsmoothing_length = "2 mm"\nkernel = "cubic-spline"',
        '[ground]\nprofile = [[0, 0], ["1 m", "-2 mm"]]',
        '[[walls]]\nfrom = [0, 0]\nto = ["1 m", 1]\nmaterial = "steel"',
        '[pairs.steel.ground]\nfriction = "21 deg"\nrestitution = 0',
        '[motion]\nkind = "harmonic"\namplitude = 1\nfrequency = "2 Hz"\nphase = "90 deg"\nduration = 8',
        '[motion]\nkind = "table"\ntable = "motion.csv"\nscale = -1',
        '[time]\nend = "2 s"\nstep = "auto"',
        '[time]\nstep = "1e-6 s"',
        '[[bodies]]\nblock = "brick"\nx = 1\ny = "1 m"\nangle = 0\nvelocity = ["1 m/s", 0]',
        '[sweep]\nmode = "grid"\n"time.end" = [1, "2 s"]',
        f'{WALL}bond = "stack"\nholes = [[1, 2], [2, 1]]\nvelocity = ["1 m/s", 0]\nshear_velocity = 1',
        f'{WALL}gap = "1 mm"\noffset = 0.0005\nmissing = 0.1\nseed = 7',
        '[[structures]]\nkind = "pyramid"\nblock = "brick"\nrows = 3\ngap = 0',
        '[[structures]]\nkind = "dominoes"\nblock = "brick"\ncount = 3\nspacing = "9 mm"\npush = "-1 m/s"',
        '[[structures]]\nkind = "grid"\nblock = "brick"\nrows = 3\ncolumns = 3\ngap_x = 1\ngap_y = 1\nturn = "9 deg"',
        '[sweep]\n"ground.tilt" = { from = "1 deg", to = "2 deg", count = 3 }',
        '[sweep]\nmode = "lhs"\nsamples = 9\nseed = 1\n"time.end" = { from = 1, to = 2, scale = "log" }',
        '[sweep]\nmode = "normal"\n"time.end" = { mean = "1 s", sd = 0.1 }\ngravity = { mean = 9, sd = 1, to = 10 }',
        "[friction]\nblock_block = { static = 0.3, kinetic_ratio = 0.5 }",
        '[provenance]\n"time.end" = "assumed"',
    ],
)
def test_every_form_of_a_value_is_valid(validator: Draft202012Validator, valid_text: str, addition: str) -> None:
    validator.validate(tomllib.loads(f"{valid_text}\n{addition}\n"))


@pytest.mark.parametrize(
    "addition",
    [
        "[tiem]\nend = 1",
        "[time]\nedn = 1",
        "[time]\nend = 0",
        '[time]\nend = "soon"',
        "[friction]\nblock_blok = 0.3",
        "[contact]\nrestitution = 1.5",
        "[ground]\nprofile = [[0, 0]]",
        '[motion]\nkind = "harmonic"\namplitude = 1',
        "[motion]\namplitude = 1\nfrequency = 1",
        '[motion]\nkind = "table"\ntable = 3',
        "[pairs.steel.ground]",
        "[pairs.steel]\nfriction = 2",
        "[ground]\ntilt = 30",
        '[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = [1]',
        '[[structures]]\nkind = "piramid"\nblock = "brick"\ncount = 1',
        '[[structures]]\nkind = "stack"\nblock = "brick"\ncount = 0',
        f'{WALL}bond = "english"',
        f"{WALL}holes = [[0, 1]]",
        f"{WALL}holes = [[1]]",
        f"{WALL}missing = 2",
        f"{WALL}velocity = 1",
        '[sweep]\n"time.end" = 3',
        '[sweep]\nmode = "sobel"\n"time.end" = [3]',
        '[sweep]\nmode = "lhs"\n"time.end" = { mean = 1 }',
        "[materials.wood]\nyoung_modulus = 1\npoisson_ratio = 0",
        "[materials.wood]\ndensity = 1\nunit_weight = 1\nyoung_modulus = 1\npoisson_ratio = 0",
    ],
)
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
