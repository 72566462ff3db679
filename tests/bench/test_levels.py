"""Settings of one collapse: which are fine enough, and what is reported of them."""

import numpy as np

from blocksim.bench.levels import CLOSE, Level, settled, solved
from blocksim.bench.scenes import three_blocks


def level(scale: float, x: float) -> Level:
    """Return one whose third block ends at x (m)."""
    return Level({"scale": scale}, np.array([[0.0, 0.0, x], [0.0, 0.0, 0.0]]), (3.0, 1.0, 2.0), 10)


def test_levels_count_as_converged_from_where_all_finer_ones_agree() -> None:
    levels = [level(1e-4, 0.9 * CLOSE), level(1e-3, 2.0 * CLOSE), level(1e-2, -0.9 * CLOSE), level(1.0, 0.0)]
    assert [one.setting["scale"] for one in settled(levels, levels[-1])] == [1.0, 1e-2]


def test_a_level_tells_its_setting_its_error_and_its_median_time() -> None:
    one = level(1e-3, 3e-4)
    assert one.told == "scale 0.001"
    told = one.detail(level(1.0, 1e-4))
    assert (told["scale"], told["steps"], told["cpu_ms"]) == (1e-3, 10, 2000.0)
    assert np.isclose(float(str(told["off_mm"])), 0.2)


def test_a_collapse_is_solved_until_the_blocks_rest() -> None:
    one = solved({"made up": 1.0}, three_blocks(contact={"stiffness_scale": 1e-4}), repeats=2)
    assert len(one.seconds) == 2
    assert one.steps > 1000
    assert 0.12 < one.centres[0, 2] < 0.14  # m: block 3 has fallen
