"""A scene that slides at a high friction for every contact model and law, and runs of it that are interrupted."""

import os
import signal
from collections.abc import Iterable, Mapping
from pathlib import Path

from blocksim.analysis.bits import differences
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.simulation import Progress, Result, read_result, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy

MODELS: dict[str, dict[str, dict[str, object]]] = {
    "surface-linear": {"contact": {"model": "surface", "law": "linear"}},
    "surface-hertz": {"contact": {"model": "surface", "law": "hertz-mindlin"}},
    "particles-linear": {"contact": {"model": "particles", "law": "linear", "particle_spacing": 0.004}},
    "particles-hertz": {"contact": {"model": "particles", "law": "hertz-mindlin", "particle_spacing": 0.004}},
    "kernel-linear": {"contact": {"model": "kernel", "law": "linear", "particle_spacing": 0.004}},
    "kernel-hertz": {"contact": {"model": "kernel", "law": "hertz-mindlin", "particle_spacing": 0.004}},
    "outlines": {
        "block": {
            "outline": [[-0.025, -0.008], [0.025, -0.008], [0.027, 0], [0.025, 0.008], [-0.025, 0.008], [-0.027, 0]],
            "depth": 0.025,
            "material": "aluminium",
        }
    },
    "nonsmooth": {"time": {"scheme": "nonsmooth", "step": 1e-4}},
}
FLAT = {"width": 0.05, "height": 0.016, "length": 0.025, "material": "aluminium"}
SOFT = 0.001


def sliding(parts: Mapping[str, Mapping[str, object]], end: float = 0.05, every: float = 1e-3) -> Scenario:
    """Return a scenario in which a block slides on another one, which slides too, and a third one tumbles."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "sliding",
            "materials": {"aluminium": {"unit_weight": 26700.0, "young_modulus": 69e9, "poisson_ratio": 0.3}},
            "blocks": {"flat": parts.get("block", FLAT)},
            "bodies": [
                {"block": "flat", "name": "below", "x": 0.0, "y": 0.008, "velocity": [0.3, 0.0]},
                {"block": "flat", "name": "above", "x": 0.0, "y": 0.024, "velocity": [1.0, 0.0]},
                {"block": "flat", "name": "beside", "x": 0.12, "y": 0.04, "angle": "30 deg", "spin": "200 deg/s"},
            ],
            "friction": {"block_block": 0.9, "block_ground": 0.9},
            "contact": {"stiffness_scale": SOFT, **parts.get("contact", {})},
            "time": {"end": end, "stop_at_rest": False, **parts.get("time", {})},
            "output": {"every": every, **parts.get("output", {})},
        }
    )


def interrupted_at(scenario: Scenario, folder: Path, steps: Iterable[int], threads: int = 1) -> list[int]:
    """Run a scenario into a folder and interrupt it at these steps; return those at which it really was."""
    stopped = []
    for number, step in enumerate(steps):

        def stop(where: Progress, step: int = step) -> None:
            if where.steps >= step:
                os.kill(os.getpid(), signal.SIGTERM)

        often = CheckpointPolicy(checkpoint_steps=step)  # so that a call ends at that step
        part = simulate_into(scenario, folder, resume=number > 0, threads=threads, precautions=often, on_progress=stop)
        assert part.status == "interrupted", part.reason
        assert part.summary.last_checkpoint == part.summary.steps
        stopped.append(part.summary.steps)
    return stopped


def assert_same(one: Result, other: Result) -> None:
    """Assert that two kept runs have left the same bits: final state, table, ledger, all that is in every frame."""
    assert one.summary.final_state_sha256 == other.summary.final_state_sha256
    assert one.summary.energy_J == other.summary.energy_J
    assert one.summary.convergence == other.summary.convergence
    assert one.folder is not None
    assert other.folder is not None
    assert (one.folder / "final.csv").read_bytes() == (other.folder / "final.csv").read_bytes()
    assert differences(one.frames, other.frames).is_none
    assert differences(read_result(one.folder).frames, read_result(other.folder).frames).is_none
