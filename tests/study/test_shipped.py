"""The scenarios that ship, end to end: what their comments and pages say about them; those with soil begin."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Document, load_scenario
from blocksim.scenario.models.motion import read_record
from blocksim.scenario.units import STANDARD_GRAVITY
from blocksim.simulation import Result
from blocksim.study.run import run
from tests.study.conftest import SCENARIOS
from tests.study.plans import cases

STUDIES = {"sweep_friction_stiffness": 10_000, "sweep_readings": 4875, "ensemble_three_blocks": 1024}
END = "time.end"


def run_shipped(name: str, **overrides: object) -> Result:
    return run(load_scenario(SCENARIOS / f"{name}.toml", overrides))


@pytest.mark.parametrize(("name", "count"), STUDIES.items())
def test_shipped_studies_have_cases_that_can_be_run(name: str, count: int) -> None:
    found = cases(Document.read(SCENARIOS / f"{name}.toml"))
    assert len(found) == count
    assert not [case.problem for case in map(found.__getitem__, range(0, count, count // 50)) if case.model is None]


ENDS: dict[str, tuple[str, dict[str, Any], bool]] = {
    "column": ("record_column", {"motion.pga": "0.35 g", END: 12.0}, False),
    "column at twice": ("record_column", {"motion.pga": "0.7 g", END: 12.0}, True),
    "drums below 0.26 g": ("drum_column", {"motion.amplitude": "0.245 g"}, False),
    "drums above 0.26 g": ("drum_column", {"motion.amplitude": "0.275 g"}, True),
}


@pytest.mark.parametrize("case", ENDS)
def test_what_falls_and_what_does_not_is_what_the_file_says(case: str) -> None:
    name, values, falls = ENDS[case]
    result = run_shipped(name, **values)
    assert result.status == "finished"
    assert result.summary.movement is not None
    assert (result.summary.movement.outcome == "fell") == falls
    if name == "record_column":
        turned = np.degrees(np.abs(result.frames.rotation[:, 0]).max())
        assert (2.0 < turned < 10.0) == (case == "column")
        assert result.probes["crown"]["rotation"].tolist() == result.frames.rotation[:, 4].tolist()


def test_the_synthetic_record_is_what_its_script_makes() -> None:
    script = runpy.run_path(str(SCENARIOS / "records" / "synthetic.py"))
    found = read_record(SCENARIOS / "records" / "synthetic.AT2")
    assert (len(found.times), found.times[1], found.unit) == (script["COUNT"], script["STEP"], "g")
    np.testing.assert_allclose(found.values, STANDARD_GRAVITY * script["record"](), rtol=0, atol=1e-7)


FOLDER = SCENARIOS / "soil"
PAGE = (SCENARIOS / "README.md").read_text(encoding="utf-8")


def run_soil(name: str, values: dict[str, object]) -> Result:
    return run(load_scenario(FOLDER / f"{name}.toml", values))


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
@pytest.mark.parametrize(("cohesion", "falls"), [("480 Pa", True), ("580 Pa", False)])
def test_a_vertical_cut_needs_the_cohesion_of_limit_analysis(cohesion: str, falls: bool) -> None:
    """Within a tenth of 530 Pa."""
    assert (moved(run_soil("vertical_cut", {"materials.clay.cohesion": cohesion}), "1") > 1.0) == falls
