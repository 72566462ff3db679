"""The scenarios with soil that ship: all of them begin, and what the comments of some of them say about their end."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.scenario import load_scenario
from blocksim.simulation import Result
from blocksim.study.run import run
from tests.study.conftest import SCENARIOS

if TYPE_CHECKING:
    from collections.abc import Mapping

FOLDER = SCENARIOS / "soil"
PAGE = (SCENARIOS / "README.md").read_text(encoding="utf-8")


def run_soil(name: str, values: "Mapping[str, object]") -> Result:
    return run(load_scenario(FOLDER / f"{name}.toml", dict(values)))


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.toml")), ids=lambda path: path.stem)
def test_a_scenario_with_soil_is_described_and_begins(path: Path) -> None:
    assert f"`soil/{path.name}`" in PAGE
    result = run_soil(path.stem, {"time.end": 4e-3, "output.every": 2e-3})
    assert (result.status, result.reason) == ("finished", "end of simulated time")
    (soils,) = result.frames.others
    assert all(np.isfinite(soils[name]).all() for name in ("x", "y", "vx", "vy", "sxx", "syy", "sxy"))
    assert abs(result.summary.energy_J.relative_residual) < 1e-3


def moved(result: Result, block: str) -> float:
    """Return how far (mm) a block has moved along x."""
    return float(1e3 * abs(np.diff(result.frames.x[[0, -1], result.frames.names.index(block)])[0]))


@pytest.mark.long
@pytest.mark.parametrize(
    ("friction", "slides"), [(0.415, ["before_water"]), (0.38, ["before_water", "before_soil"]), (0.45, [])]
)
def test_water_moves_a_wall_that_soil_does_not(friction: float, slides: list[str]) -> None:
    result = run_soil("seawall", {"friction.block_ground": friction})
    for block in ("before_water", "before_soil"):
        assert (moved(result, block) > 1.0) == (block in slides)


@pytest.mark.long
@pytest.mark.parametrize(("tilt", "flows"), [("26.2 deg", False), ("27 deg", True)])
def test_sand_in_a_box_flows_once_the_tangent_of_its_tilt_is_the_sine_of_its_friction_angle(
    tilt: str, flows: bool
) -> None:
    """26.6 degrees for 30; it would be 30 with normal stresses along the layer that stay what they are."""
    assert (moved(run_soil("tilting_box", {"ground.tilt": tilt}), "1") > 10.0) == flows


@pytest.mark.long
@pytest.mark.parametrize(("cohesion", "falls"), [("480 Pa", True), ("580 Pa", False)])
def test_a_vertical_cut_needs_the_cohesion_of_limit_analysis(cohesion: str, falls: bool) -> None:
    """Within a tenth of 530 Pa."""
    assert (moved(run_soil("vertical_cut", {"materials.clay.cohesion": cohesion}), "1") > 1.0) == falls
