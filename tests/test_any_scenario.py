"""What any valid scenario does: it is read as it was written, passes the check, runs, resumes, and knows no threads."""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from blocksim.analysis.bits import differences
from blocksim.scenario import Document, Model, scenario_from_mapping, scenario_to_toml
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.study.run import run
from blocksim.world.describe import describe
from tests.scenarios import scenarios


@settings(max_examples=60)
@given(scenarios())
def test_it_is_written_and_loaded_bit_equal(data: dict[str, Any]) -> None:
    scenario = scenario_from_mapping(data)
    again = Document.parse(scenario_to_toml(scenario)).build()
    assert repr(again) == repr(scenario)
    assert Model(again).hash == Model(scenario).hash
    assert Model(again).bodies == Model(scenario).bodies


@settings(max_examples=12)
@given(scenarios())
def test_it_passes_the_check_runs_resumes_and_ends_the_same_on_two_threads(data: dict[str, Any]) -> None:
    moment = {**data["time"], "end": 1e-3, "stop_at_rest": False}
    scenario = scenario_from_mapping({**data, "time": moment, "output": {"every": 2.5e-4}})
    steps = round(1e-3 / describe(Model(scenario)).step)  # few where nothing presses
    assert describe(Model(scenario)).frames == 1 + max(1, min(4, steps))
    straight = run(scenario)
    assert straight.status in {"finished", "failed"}, straight.reason
    with pytest.MonkeyPatch.context() as patch:  # small scenes would not use them
        patch.setattr("blocksim.simulation.schemes.useful_threads", lambda threads, *_: threads)
        shared = run(scenario, threads=2)
    assert (straight.summary.threads, shared.summary.threads) == (1, 2)
    assert differences(straight.frames, shared.frames).is_none
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr("blocksim.simulation.interruption.WallTime.check", lambda _: None)  # it comes later
        out = Path(folder) / "run"
        assert run(scenario, out=out, precautions=CheckpointPolicy(wall_time=0.0)).status in {"interrupted", "failed"}
        assert differences(straight.frames, run(scenario, out=out, resume=True).frames).is_none
