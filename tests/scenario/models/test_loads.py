"""Loads in a scenario: what they are refused for, with their place, and how tables and names are read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import load_scenario, scenario_from_mapping, scenario_hash, scenario_to_toml
from blocksim.scenario.models.loads import Gravity, Stretch, VaryingLoad, stretches_of
from tests.scenario.conftest import data_of

if TYPE_CHECKING:
    from pathlib import Path

    from blocksim.scenario import Scenario


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
    assert scenario_hash(again) == scenario_hash(read)


def test_a_load_is_set_by_its_name() -> None:
    named = data_with(FORCE, {**FORCE, "name": "push"})
    changed = load_scenario(named, {"loads.push.magnitude": "5 kN"})
    assert [getattr(load, "magnitude", None) for load in changed.loads] == [2000.0, 5000.0]
    with pytest.raises(ScenarioError, match='loads has no "pull", known: push'):
        load_scenario(named, {"loads.pull.magnitude": "5 kN"})
