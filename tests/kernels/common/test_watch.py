"""Members of ensembles stop at the frames of a run, and no later than at the first in which a block has moved."""

import math

import numpy as np
import pytest

from blocksim.kernels.common.arrays import BODY, Records, zeros
from blocksim.kernels.common.members import Watched, frame_to_watch, watch
from blocksim.simulation.instruments import POSITION

THRESHOLD, REACH = 1e-3, 0.03  # m


def watched(threshold: float = THRESHOLD, *, peaks: bool = True) -> Watched:
    """Watch the second of two members, of two blocks each, the second of them fixed."""
    thresholds = np.array([[math.inf, math.inf], [threshold, math.inf]])
    places = np.zeros((2, 3, 2))
    periods, steps = np.array([0.0, 3.0]), np.zeros(2, dtype=np.int64)
    frames = periods if peaks else np.zeros(2)
    return Watched(frames, periods, steps, places, np.zeros((2, 3, 2)), np.full((2, 2), REACH), thresholds, np.zeros(2))


def bodies(**state: float) -> Records:
    """Return two blocks and the ground; both blocks are where `state` says."""
    all_bodies = zeros(3, BODY)
    for name, value in state.items():
        all_bodies[name][:2] = value
    return all_bodies


@pytest.mark.parametrize(
    ("state", "moved"),
    [
        ({"x": 0.999e-3}, False),
        ({"x": -1.001e-3}, True),
        ({"x": 0.6e-3, "y": -0.801e-3}, True),
        ({"angle": -0.999 * THRESHOLD / REACH}, False),
        ({"angle": -1.001 * THRESHOLD / REACH}, True),
        ({"y": math.nan}, True),
    ],
)
def test_first_frame_in_which_a_free_block_has_moved_is_kept(state: dict[str, float], moved: bool) -> None:
    seen = watched()
    watch(bodies(**state), seen, 1, 6)
    assert seen.steps.tolist() == [0, 6 if moved else 0]
    if moved:
        assert np.array_equal(seen.places[1], [[state.get(name, 0.0)] * 2 for name in POSITION], equal_nan=True)


def test_the_largest_rotation_is_followed_to_the_end_and_the_first_frame_of_a_move_kept() -> None:
    seen = watched()
    assert [frame_to_watch(seen, m, 4) for m in (0, 1)] == [0, 6]
    for step, angle in ((6, -0.2), (9, 0.1)):
        watch(bodies(angle=angle), seen, 1, step)
    assert seen.steps.tolist() == [0, 6]
    assert seen.peaks.tolist() == [0.0, 0.2]
    assert frame_to_watch(seen, 1, 7) == 9
