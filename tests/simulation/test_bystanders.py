"""What else is in a scene of rigid contacts is no matter for what happens elsewhere, at a given step and tolerance."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.scenario import Model
from blocksim.simulation.schemes import build
from blocksim.verification.scene import HEIGHT, WIDTH, SteppedScene, scenario_of

AWAY = 5.0  # m
TIME = {"scheme": "nonsmooth", "step": 1e-3, "substeps": 4, "velocity_tolerance": 1e-6, "stop_at_rest": False}
RESTING: list[dict[str, Any]] = [{"x": AWAY + 2.0 * k * WIDTH, "y": HEIGHT / 2} for k in range(9)]
FLYING: list[dict[str, Any]] = [
    {"x": AWAY + 2.0 * k * WIDTH, "y": 3.0 + 0.1 * k, "velocity": [0.3 * k, 0.1], "spin": "20 deg/s"} for k in range(4)
]
BYSTANDERS = [*RESTING, FLYING[0]]


def scene_of(seed: int) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return one to six blocks that fly, stand on one another or side by side, and how they touch."""
    random = np.random.default_rng(seed)
    pitch = WIDTH * float(random.choice([1.0, 1.02]))
    bodies: list[dict[str, Any]] = [
        {"x": k % 3 * pitch, "y": (k // 3 + 0.5) * HEIGHT} for k in range(int(random.integers(1, 7)))
    ]
    bodies[0] |= {"velocity": [float(random.uniform(-1.0, 1.0)), 0.0]}
    bodies[-1] |= {"y": bodies[-1]["y"] + 0.01, "spin": f"{random.uniform(-90.0, 90.0)} deg/s"}
    impacts = "sequential" if seed % 2 else "simultaneous"
    return bodies, {"impacts": impacts, "restitution": float(random.choice([0.0, 0.2, 0.5, 0.501, 0.8]))}


def end_of(bodies: list[dict[str, Any]], contact: Mapping[str, object], **tables: Any) -> NDArray[np.float64]:
    """Return the states of bodies after 0.1 s."""
    scenario = scenario_of(bodies, contact=contact, time=TIME, **tables)
    return SteppedScene(build(Model(scenario))).to_time(0.1).state()


@pytest.mark.parametrize("seed", range(30))
def test_loads_on_blocks_far_away_change_no_bit(seed: int) -> None:
    bodies, contact = scene_of(seed)
    load = {"kind": "force", "body": str(len(bodies) + 1), "magnitude": "1 mN", "direction": "0 deg"}
    free, loaded = (end_of([*bodies, *BYSTANDERS], contact, loads=loads)[: len(bodies)] for loads in ([], [load]))
    assert loaded.tolist() == free.tolist()


@pytest.mark.parametrize("seed", range(30))
def test_blocks_at_rest_and_in_flight_far_away_change_no_bit(seed: int) -> None:
    bodies, contact = scene_of(seed)
    alone = end_of(bodies, contact).tolist()
    for far in (RESTING, FLYING, [*FLYING, *RESTING]):
        assert end_of([*bodies, *far], contact)[: len(bodies)].tolist() == alone


@pytest.mark.parametrize("impacts", ["simultaneous", "sequential"])
@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.5, 0.501])
def test_idle_blocks_far_away_change_less_of_a_struck_row_than_the_tolerance_of_the_velocity_pass(
    impacts: str, restitution: float
) -> None:
    row: list[dict[str, Any]] = [{"x": k * WIDTH, "y": HEIGHT / 2} for k in range(5)]
    row[0] |= {"x": -0.01, "velocity": [1.0, 0.0]}
    contact = {"impacts": impacts, "restitution": restitution}
    alone = end_of(row, contact)
    for count in (7, 8, 9):  # 12 to 14 blocks
        end = end_of([*row, *BYSTANDERS[:count]], contact)[: len(row)]
        np.testing.assert_allclose(end, alone, rtol=0.0, atol=1e-9)
