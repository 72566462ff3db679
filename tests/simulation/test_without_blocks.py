"""A scene of soil alone: every command that needs no block serves it, and those that need one say so."""

from pathlib import Path

import numpy as np
import pytest

import blocksim
from blocksim.errors import InvalidInputError, ScenarioError
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation import Result
from blocksim.simulation.stores.exports import write_geojson, write_vtkhdf
from tests.soils import LEFT, column, data_of

ALONE = {"blocks": {}, "bodies": [], "output": {"every": 0.02}}
DATA = data_of(column(0.04, 0.04, 0.005), walls=[LEFT], end=0.06, **ALONE)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return blocksim.run(scenario_from_mapping(DATA), out=tmp_path_factory.mktemp("alone") / "run")


def test_soil_alone_falls_as_beside_a_block_far_away(run: Result) -> None:
    beside = blocksim.run(scenario_from_mapping(data_of(*DATA["soils"], walls=[LEFT], end=0.06, output=DATA["output"])))
    assert run.columns["block"] == []
    assert run.summary.movement is None
    front, expected = (one.endings["soils"]["right_mm"] for one in (run, beside))
    assert front == pytest.approx(expected, rel=1e-3)  # other steps
    assert run.folder is not None
    (again,) = blocksim.open_run(run.folder).frames.others
    assert np.ptp(again["y"][-1]) > 0.02


def test_soil_needs_no_wall_either() -> None:
    free = blocksim.run(scenario_from_mapping({**DATA, "walls": []}))
    left, right = (free.endings["soils"][name][0] for name in ("left_mm", "right_mm"))
    assert left + right == pytest.approx(40.0, abs=0.1)  # it spreads alike to both sides


@pytest.mark.parametrize("kind", ["strip", "final", "profile"])
def test_soil_alone_is_drawn(run: Result, tmp_path: Path, kind: str) -> None:
    assert blocksim.plot(run, tmp_path / "picture.png", kind=kind).stat().st_size > 5000


def test_soil_alone_is_exported_and_reported(run: Result, tmp_path: Path) -> None:
    assert write_vtkhdf(tmp_path / "run.vtkhdf", run.frames, run.scenario) == len(run.frames.time)
    assert blocksim.report(run, out=tmp_path / "run.html").stat().st_size > 20_000
    assert blocksim.animate(run, tmp_path / "run.gif").stat().st_size > 5000


def test_what_is_about_blocks_says_that_there_are_none(run: Result, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="a history is that of blocks"):
        blocksim.plot(run, tmp_path / "picture.png", kind="history")
    with pytest.raises(InvalidInputError, match="no block to export"):
        write_geojson(tmp_path / "run.geojson", run.frames, run.scenario)


def test_soil_on_the_solid_side_of_a_wall_is_refused_as_it_would_pass_through() -> None:
    turned = {**LEFT, "from": LEFT["to"], "to": LEFT["from"]}
    with pytest.raises(ScenarioError, match="meets the solid side of wall 1, right of the way"):
        scenario_from_mapping({**DATA, "walls": [turned]})
