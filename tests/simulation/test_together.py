"""Runs in which all comes together: start at rest, loads, moving supports, events, probes; cut anywhere, they agree."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.scenario import Scenario, scenario_from_mapping, scenario_to_toml
from blocksim.simulation import simulate, simulate_into
from blocksim.simulation.files import CHECKPOINTS
from tests.simulation.sliding import assert_same, interrupted_at

if TYPE_CHECKING:
    from pathlib import Path

both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
PROBES: list[dict[str, Any]] = [
    {"kind": "force", "on": "supports", "name": "base", "every": "0.1 ms"},
    {"kind": "force", "on": "2", "by": "1", "name": "joint-force", "every": "2 ms"},
    {"kind": "point", "body": "2", "at": [0.1, 0.05], "name": "corner", "every": "0.7 ms"},
    {"kind": "point", "body": "3", "name": "middle", "every": "step"},
    {"kind": "joint", "bodies": ["1", "2"], "name": "joint"},
    {"kind": "energy", "name": "energy"},
]
LOADS: list[dict[str, Any]] = [
    {"kind": "force", "name": "push", "body": "2", "magnitude": 30.0, "history": {"kind": "ramp", "end": 0.01}},
    {"kind": "pressure", "name": "water", "body": "1", "face": "left", "water_level": 0.08},
    {"kind": "horizontal", "name": "seismic", "magnitude": 0.2},
]
EVENTS = [
    {"at": 0.008, "unload": ["push"], "remove": ["post"]},
    {"at": 0.012, "free": ["ram"], "unload": ["water"]},
    {"at": 0.010, "velocity": {"body": "3", "vx": 0.5}},
    {"at": 0.016, "fix": ["3"]},
]


def all_together(scheme: str, *, columns: int = 0, end: float = 0.02, **changes: Any) -> Scenario:
    """Return a stack that settles, is loaded, pushed and shaken, beside so many others."""
    piers = {"kind": "wall", "block": "brick", "rows": 3, "columns": columns, "left": 1.0, "bond": "stack", "gap": 0.02}
    ramp = {"kind": "ramp", "distance": 0.1, "speed": 1.0, "direction": "180 deg"}
    step, stiffness = ({"step": 1e-4}, {}) if scheme == "nonsmooth" else ({}, {"stiffness_scale": 0.01})
    data = {
        "schema": 1,
        "name": "together",
        "materials": {"stone": {"density": 2000.0, "young_modulus": "1 GPa", "poisson_ratio": 0.2}},
        "blocks": {"brick": {"width": 0.2, "height": 0.1, "length": 0.1, "material": "stone"}},
        "structures": [{"kind": "stack", "block": "brick", "count": 3}, *([piers] if columns else [])],
        "bodies": [
            {"block": "brick", "name": "post", "x": -0.25, "y": 0.05, "fixed": True},
            {"block": "brick", "name": "ram", "x": 0.32, "y": 0.15, "motion": ramp},
        ],
        "motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 20.0, "ramp": 0.01},
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "contact": {"restitution": 0.0, **stiffness},
        "time": {"scheme": scheme, "end": end, "stop_at_rest": False, **step},
        "output": {"every": 0.001, "contacts": True},
        "start": {"settle": True},
        "loads": LOADS,
        "events": EVENTS,
        "probes": PROBES,
    }
    return scenario_from_mapping({**data, **changes})


def assert_same_files(one: Path, other: Path) -> None:
    """Assert that two folders have the same tables, byte for byte."""
    names = ["final.csv", *(f"probe-{probe['name']}.csv" for probe in PROBES)]
    assert {name: (one / name).read_bytes() for name in names} == {name: (other / name).read_bytes() for name in names}


@both
def test_interruptions_at_and_beside_events_change_no_byte_nor_do_probes_and_contacts(
    scheme: str, tmp_path: Path
) -> None:
    scenario = all_together(scheme)
    whole = simulate_into(scenario, tmp_path / "whole")
    assert whole.summary.settled is not None
    assert [event.time_s for event in whole.summary.events] == sorted(event.time_s for event in whole.summary.events)
    first, _, third, _ = (event.step for event in whole.summary.events)
    steps = [first - 1, first, (third + whole.summary.steps) // 2]
    assert interrupted_at(scenario, tmp_path / "parts", steps) == steps
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert_same(resumed, whole)
    assert resumed.summary.events == whole.summary.events
    assert resumed.summary.movement == whole.summary.movement
    assert resumed.summary.warnings == ()
    assert {f"probe-{probe['name']}.csv" for probe in PROBES} < set(resumed.summary.sha256)
    assert_same_files(tmp_path / "parts", tmp_path / "whole")
    unrecorded = simulate(all_together(scheme, probes=[], output={"every": 0.001}))
    assert unrecorded.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert unrecorded.frames.x.tobytes() == whole.frames.x.tobytes()


@pytest.mark.long
@both
def test_two_threads_and_a_change_to_them_on_the_way_change_no_byte(scheme: str, tmp_path: Path) -> None:
    scenario = all_together(scheme, columns=75)
    whole = simulate_into(scenario, tmp_path / "one")
    two = simulate_into(scenario, tmp_path / "two", threads=2)
    assert two.summary.threads == 2
    assert_same(two, whole)
    assert_same_files(tmp_path / "two", tmp_path / "one")
    interrupted_at(scenario, tmp_path / "parts", [whole.summary.events[0].step])
    assert_same(simulate_into(scenario, tmp_path / "parts", resume=True, threads=2), whole)
    assert_same_files(tmp_path / "parts", tmp_path / "one")


@pytest.mark.long
@both
def test_runs_killed_again_and_again_end_with_the_same_bytes(scheme: str, tmp_path: Path) -> None:
    scenario = all_together(scheme, columns=8, end=0.1 if scheme == "explicit" else 0.4)
    whole = simulate_into(scenario, tmp_path / "whole")
    (tmp_path / "together.toml").write_text(scenario_to_toml(scenario))
    command = [sys.executable, "-c", "from blocksim.cli.app import main; main()", "run", "together.toml"]
    command += ["--out", "killed", "--resume", "--quiet", "--checkpoint-steps", "100"]
    for _ in range(4):
        before = _newest(tmp_path / "killed")
        running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while running.poll() is None and _newest(tmp_path / "killed") == before:
            time.sleep(0.01)
        running.send_signal(signal.SIGKILL)
        assert running.wait() == -signal.SIGKILL
    assert_same(simulate_into(scenario, tmp_path / "killed", resume=True), whole)
    assert_same_files(tmp_path / "killed", tmp_path / "whole")


def _newest(folder: Path) -> int:
    """Return when (ns) the newest checkpoint was written, 0 where there is none."""
    files = (folder / name for name in CHECKPOINTS)
    return max((file.stat().st_mtime_ns for file in files if file.is_file()), default=0)
