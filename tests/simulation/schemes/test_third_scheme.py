"""A stepping scheme that only tests know is one file and one line: it runs, resumes and sweeps as all others do."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blocksim
from blocksim.errors import ScenarioError
from blocksim.scenario import Scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.document import Document
from blocksim.scenario.models.timeline import SCHEMES
from blocksim.simulation import run_ensemble
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.schemes import SMALLEST_SCENE
from tests.simulation.flight import STEP, FlightTime

END = 0.1


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Register the scheme: one line."""
    monkeypatch.setitem(SCHEMES, "flight", FlightTime)


def thrown(**time: Any) -> Scenario:
    """Return a scenario of a block that is thrown upwards."""
    body = {"block": "any", "x": 0.0, "y": 5.0, "velocity": [1.0, 0.5], "spin": 2.0}
    times = {"scheme": "flight", "end": END, **time}
    return scenario_from_mapping({**SMALLEST_SCENE, "name": "toy", "bodies": [body], "time": times})


def test_blocks_move_by_its_steps_and_are_recorded() -> None:
    result = blocksim.run(thrown())
    steps = np.arange(len(result.frames))
    np.testing.assert_allclose(result.frames.x[:, 0], steps * STEP)
    np.testing.assert_allclose(
        result.frames.y[:, 0], 5.0 + 0.5 * steps * STEP - 9.81 * STEP**2 * steps * (steps - 1) / 2
    )
    assert result.summary.energy_J.kinetic == pytest.approx(result.frames.energy["kinetic"][-1])
    assert blocksim.run(thrown(drag=1.0)).frames.vx[-1, 0] == pytest.approx((1.0 - STEP) ** 100)


def test_resumed_runs_are_bit_identical(tmp_path: Path) -> None:
    whole = blocksim.run(thrown(), threads=2)
    part = blocksim.run(thrown(), out=tmp_path / "cut", precautions=CheckpointPolicy(wall_time=1e-9))
    assert part.status == "interrupted"
    again = blocksim.run(thrown(), out=tmp_path / "cut", resume=True)
    assert again.summary.final_state_sha256 == whole.summary.final_state_sha256
    (end,) = run_ensemble([thrown()])
    assert end.columns == whole.columns


def test_its_keys_are_checked_and_written() -> None:
    assert Document.parse(scenario_to_toml(thrown(drag=0.5))).build() == thrown(drag=0.5)
    for name, value, told in (
        ("drags", 1.0, "time.drags: .*did you mean 'drag'"),
        ("drag", "fast", "time.drag: .*fast"),
    ):
        with pytest.raises(ScenarioError, match=told):
            thrown(**{name: value})


def test_sweeps_vary_its_keys_and_resume(tmp_path: Path) -> None:
    def swept(*drags: float) -> Any:
        return blocksim.sweep(thrown(), {"time.drag": list(drags)}, out=tmp_path).to_frame().to_dict("list")

    first = swept(0.0, 0.01)
    assert first["status"] == ["finished", "finished"]
    again = swept(0.0, 0.01)
    assert again == first
    assert len((tmp_path / "manifest.jsonl").read_text().splitlines()) == 2
