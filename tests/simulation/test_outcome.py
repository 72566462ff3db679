"""A run that blows up stops soon, and says where: status, step, block, last good checkpoint."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.errors import ExitCode
from blocksim.kernels.common.arrays import NOT_FINITE, OVERLAP_LIMIT, REACHED
from blocksim.scenario import place_bodies
from blocksim.simulation import schemes, simulate, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy, read_checkpoint
from blocksim.simulation.loop import BY_CODE, RESIDUAL, Outcome, diagnose
from blocksim.simulation.schemes import build, build_scene
from tests.simulation.sliding import sliding

if TYPE_CHECKING:
    from pathlib import Path

    from blocksim.scenario import Scenario
    from blocksim.world.build import InitialScene
    from tests.simulation.conftest import Shipped

TIMES_THE_LIMIT = 50.0


@pytest.fixture
def forced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every scene step fifty times as far as it safely can."""

    def forced_build(scenario: Scenario) -> InitialScene:
        built = build(scenario)
        built.scene.world.controls[0].step *= TIMES_THE_LIMIT
        return built

    monkeypatch.setattr(schemes, "build", forced_build)


@pytest.mark.usefixtures("forced")
def test_scene_that_blows_up_stops_and_names_step_block_and_checkpoint(soft: Shipped, tmp_path: Path) -> None:
    often = CheckpointPolicy(checkpoint_steps=1)
    result = simulate_into(soft(output__every=1.0), tmp_path / "run", precautions=often)
    assert (result.status, result.summary.exit_code) == ("failed", ExitCode.NUMERICAL_FAILURE)
    assert 0 < result.summary.steps <= 1000
    assert f"step {result.summary.steps})" in result.reason
    assert "block " in result.reason
    last = result.summary.last_checkpoint
    assert last is not None
    assert 0 < last < result.summary.steps
    positions = [read_checkpoint(path).head.position.step for path in (tmp_path / "run").glob("checkpoint.*")]
    assert last == max(positions)
    assert json.loads((tmp_path / "run" / "run.json").read_text())["last_checkpoint"] == last
    assert not (tmp_path / "run" / "done.json").exists()


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_overlap_names_the_pair_that_is_deepest(scheme: str) -> None:
    scenario = sliding({"time": {"scheme": scheme}, "contact": {"max_overlap": 1e-12}}, end=0.01)
    result = simulate(scenario)
    assert result.summary.exit_code == ExitCode.NUMERICAL_FAILURE
    assert "(block below and the ground by " in result.reason or "(block below and block above by " in result.reason
    assert f"mm, step {result.summary.steps})" in result.reason


def test_block_that_is_not_finite_is_named() -> None:
    scenario = sliding({})
    scene, placed = build_scene(scenario), place_bodies(scenario)
    scene.world.bodies[1].vy = np.nan
    assert diagnose(BY_CODE[NOT_FINITE], NOT_FINITE, scene, placed).reason.endswith("(block above, step 0)")


def test_lost_energy_names_the_fastest_block() -> None:
    scenario = sliding({})
    scene, placed = build_scene(scenario), place_bodies(scenario)
    reason = diagnose(RESIDUAL, REACHED, scene, placed).reason
    assert reason.endswith("(the fastest is block above with 1 m/s, step 0)")


def test_runs_that_did_not_fail_keep_their_words() -> None:
    scenario = sliding({})
    for outcome in (BY_CODE[REACHED], Outcome("interrupted", "stopped by SIGTERM", ExitCode.STOPPED_EARLY)):
        assert diagnose(outcome, OVERLAP_LIMIT, build_scene(scenario), place_bodies(scenario)) == outcome
