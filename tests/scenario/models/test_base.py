"""Names of scenarios: folders of results are made of them, on any file system, and never anywhere else."""

import re

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Scenario, json_schema, scenario_from_mapping
from blocksim.simulation.files import RESULTS, default_folder
from tests.scenario.conftest import data_of

HOSTILE = (
    *("../../x", "/etc/x", "..", ".", "a/b", "a\\b", "C:x", "", " ", "a b", "-rf", ".hidden", "x" * 101, "x" * 300),
    *("CON", "con", "nul", "aux.txt", "Com1", "LPT9.toml", "prn.", "a.", "a\0", "a\n", "a\x1b[2J", "\u202egnp.exe"),
    *("caf\u00e9", "\U0001f4a9", "a\u200b", "<b>", "$(id)", "`id`", "%s", "*", "?", "|", '"', "'", "~root", "\u2215"),
)
FINE = ("a", "three_blocks", "7", "a.b-c_D", "CONE", "com10", "nulled.x", "x" * 100)


def scenario_named(name: str) -> Scenario:
    return scenario_from_mapping(data_of(name=name))


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_that_is_no_folder_everywhere_is_refused(name: str) -> None:
    with pytest.raises(ScenarioError, match="is not a name"):
        scenario_named(name)


@pytest.mark.parametrize("name", FINE)
def test_results_lie_in_a_folder_of_the_name_below_results(name: str) -> None:
    folder = default_folder(scenario_named(name))
    assert folder.parent.name == name
    assert folder.resolve().parent.parent == RESULTS.resolve()


def test_editors_are_reported_the_same() -> None:
    pattern = json_schema()["properties"]["name"]["pattern"].replace("$", r"\Z")  # it allows no line feed behind it
    assert [name for name in (*HOSTILE, *FINE) if re.search(pattern, name)] == list(FINE)
