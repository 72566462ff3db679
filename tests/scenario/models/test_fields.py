"""What fields of a scenario take: words, whole numbers, sides of blocks, densities, names that folders can have."""

import re

import numpy as np
import pytest
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from blocksim.errors import ScenarioError
from blocksim.scenario import json_schema, scenario_from_mapping
from blocksim.scenario.geometry import edge_distance
from blocksim.scenario.models.base import OneOf, Whole
from blocksim.scenario.models.geometry import Block, Material
from blocksim.scenario.models.timeline import NewVelocity
from blocksim.simulation.files import RESULTS, default_folder
from tests.scenario.conftest import data_of


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


@pytest.mark.parametrize(
    ("turned", "sizes"),
    [
        ({}, (0.032, 0.025, 0.05)),
        ({"upright": "height"}, (0.032, 0.025, 0.05)),
        ({"upright": "length"}, (0.032, 0.05, 0.025)),
        ({"upright": "width"}, (0.05, 0.032, 0.025)),
        ({"upright": "height", "along": "length"}, (0.05, 0.025, 0.032)),
        ({"upright": "length", "along": "height"}, (0.025, 0.05, 0.032)),
        ({"along": "length"}, (0.05, 0.025, 0.032)),
    ],
)
def test_sides_along_upright_and_deep(turned: dict[str, str], sizes: tuple[float, float, float]) -> None:
    block = Block.model_validate({"width": "32 mm", "height": "25 mm", "length": "50 mm", "material": "a", **turned})
    assert (block.size_x, block.size_y, block.depth) == sizes


def test_a_given_density_is_used_as_it_is() -> None:
    stone = {"young_modulus": 1.0, "poisson_ratio": 0.0}
    assert Material.model_validate({"density": 2700.5, **stone}).density == 2700.5
    assert Material.model_validate({"unit_weight": 9810.0, **stone}).density == 1000.0
    for given in ({}, {"density": 1.0, "unit_weight": 9.81}):
        with pytest.raises(ValidationError, match="density"):
            Material.model_validate({**stone, **given})


HOSTILE = (
    *("../../x", "/etc/x", "..", ".", "a/b", "a\\b", "C:x", "", " ", "a b", "-rf", ".hidden", "x" * 101, "x" * 300),
    *("CON", "con", "nul", "aux.txt", "Com1", "LPT9.toml", "prn.", "a.", "a\0", "a\n", "a\x1b[2J", "\u202egnp.exe"),
    *("caf\u00e9", "\U0001f4a9", "a\u200b", "<b>", "$(id)", "`id`", "%s", "*", "?", "|", '"', "'", "~root", "\u2215"),
)
FINE = ("a", "three_blocks", "7", "a.b-c_D", "CONE", "com10", "nulled.x", "x" * 100)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_that_is_no_folder_everywhere_is_refused(name: str) -> None:
    with pytest.raises(ScenarioError, match="is not a name"):
        scenario_from_mapping(data_of(name=name))


def test_results_lie_in_a_folder_of_the_name_below_results_and_editors_are_told_the_same() -> None:
    for name in FINE:
        folder = default_folder(scenario_from_mapping(data_of(name=name)))
        assert folder.parent.name == name
        assert folder.resolve().parent.parent == RESULTS.resolve()
    pattern = json_schema()["properties"]["name"]["pattern"].replace("$", r"\Z")  # it allows no line feed behind it
    assert [name for name in (*HOSTILE, *FINE) if re.search(pattern, name)] == list(FINE)
