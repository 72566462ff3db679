"""Ground and walls as cells: solid inwards, beyond all blocks, moved as the scenario says."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.scenario import load_scenario
from blocksim.world.systems.blocks import support_motion, support_quads
from tests.view.made_up import toppling

SCENARIOS = Path(__file__).parents[3] / "scenarios"


def areas(quads: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the areas (m2) of quadrilaterals, positive for corners that run counter-clockwise."""
    one, other = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    return np.asarray(0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]))


def test_profile_is_filled_below_and_a_wall_behind_its_face() -> None:
    scenario = load_scenario(SCENARIOS / "slope.toml")
    quads = support_quads(scenario, toppling(2).tracks[0])
    assert (areas(quads) > 0.0).all()
    profile = np.array(scenario.ground.profile)
    tops = quads[:-1, 2:].reshape(-1, 2)
    assert all(np.isclose(tops, point).all(axis=1).any() for point in profile)
    wall = quads[-1]
    np.testing.assert_allclose(wall[3], [0.5, 0.0])
    np.testing.assert_allclose(wall[2], [0.5, 0.2])
    assert (wall[:2, 0] > 0.5).all()  # the blocks come from the left


def test_level_ground_reaches_beyond_all_blocks() -> None:
    frames = toppling(30)
    quads = support_quads(load_scenario(SCENARIOS / "three_blocks.toml"), frames.tracks[0])
    assert quads.shape == (1, 4, 2)
    assert quads[0, :, 0].min() < frames.x.min() - 0.059
    assert quads[0, :, 0].max() > frames.x.max() + 0.059
    assert quads[0, :, 1].max() == 0.0


def test_table_moves_as_the_scenario_says() -> None:
    scenario = load_scenario(SCENARIOS / "shaking_table.toml")
    times = np.linspace(0.0, 0.5, 2001)
    displacement, velocity = support_motion(scenario, times)
    assert np.ptp(displacement[:, 0]) > 1e-3
    np.testing.assert_allclose(np.gradient(displacement[:, 0], times)[1:-1], velocity[1:-1, 0], atol=1e-3)
    assert support_motion(load_scenario(SCENARIOS / "slope.toml"), times)[1].max() == pytest.approx(0.0)
