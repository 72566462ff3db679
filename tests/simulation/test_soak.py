"""Ten simulated seconds of a wall that is pushed, breaks and comes to rest: nothing grows, drifts or creeps.

250 blocks by default, a minute or so; with BLOCKSIM_SOAK=full the 1000 blocks of scenarios/wall.toml, four minutes.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from blocksim.scenario import load_scenario
from blocksim.simulation import Progress, simulate_into
from blocksim.simulation.balance import RESIDUAL_PROMISE
from tests.simulation.conftest import SCENARIOS

SIZE = {} if os.environ.get("BLOCKSIM_SOAK") == "full" else {"structures.0.rows": 10, "structures.0.columns": 25}
WARM, SETTLED, END = 1.0, 3.0, 10.0  # s: by which all lists have found their size, and most blocks their place
MEMORY = Path("/proc/self/statm")


def memory() -> float:
    """Return the memory of this process (pages), or nothing where the system does not tell."""
    return int(MEMORY.read_text().split()[1]) if MEMORY.exists() else 1.0


@pytest.mark.long
def test_long_run_keeps_its_memory_its_energy_and_its_rest(tmp_path: Path) -> None:
    values = {"time.end": END, "time.stop_at_rest": False, "output.every": "10 ms", **SIZE}
    sizes: list[float] = []
    residuals: list[float] = []

    def watch(where: Progress) -> None:
        residuals.append(where.relative_residual)
        if where.time > WARM:
            sizes.append(memory())

    result = simulate_into(load_scenario(SCENARIOS / "wall.toml", values), tmp_path / "run", on_progress=watch)
    assert (result.status, result.reason) == ("finished", "end of simulated time")
    assert max(residuals) <= RESIDUAL_PROMISE
    assert 0.95 * sizes[0] <= min(sizes) <= max(sizes) <= 1.05 * sizes[0]  # frames go to the disk
    frames = result.frames
    settled = int(np.searchsorted(frames.time, SETTLED))
    resting = np.hypot(frames.vx[settled], frames.vy[settled]) < 1e-6  # m/s
    moved = np.hypot(frames.x[settled:] - frames.x[settled], frames.y[settled:] - frames.y[settled])
    assert resting.mean() > 0.9
    assert moved[:, resting].max() <= 1e-9  # m; measured for 1000 blocks: 8e-11
