"""Scatter matrices: which variables they show, as what, and what is marked."""

from pathlib import Path

import numpy as np

from blocksim.view.sweeps.matrix import MOST_INPUTS, draw, variables_of
from tests.view.sweeps.made_up import REPEATS, grid, made_up, samples


def test_matrix_names_inputs_blocks_and_marks(tmp_path: Path) -> None:
    path = tmp_path / "matrix.svg"
    draw(made_up(samples(3), "sobol", failed=5), path)
    text = path.read_text(encoding="utf-8")
    for told in ("key_0", "key_2", "scheme", "nonsmooth", "x of 2 (mm)", "repeats", "failed (10 %)"):
        assert f"<!-- {told} -->" in text
    assert "in all measured ranges (" in text
    assert text.count('id="axes_') == 5 * 6 // 2  # the lower half of five variables


def test_matrix_without_measurements_marks_nothing(tmp_path: Path) -> None:
    path = tmp_path / "matrix.svg"
    draw(made_up(samples(2), "sobol", measured=False), path)
    text = path.read_text(encoding="utf-8")
    assert "repeats" not in text
    assert "<!-- finished -->" in text


def test_words_are_spread_so_that_dots_do_not_hide_each_other() -> None:
    *_, word, block = variables_of(made_up(samples(2), "sobol"))
    assert word.levels == ("explicit", "nonsmooth")
    assert len(np.unique(word.values)) == 50
    assert np.round(word.values).tolist() == [number % 2 for number in range(50)]
    assert block.repeats is not None
    assert block.repeats.tolist() == REPEATS.tolist()


def test_limits_hold_all_values_and_repeats() -> None:
    friction, scale, block = variables_of(made_up(grid()))
    assert scale.is_log
    assert not friction.is_log
    for one in (friction, scale):
        assert one.limits[0] < one.values.min() <= one.values.max() < one.limits[1]
    assert block.limits[0] < REPEATS.min() < REPEATS.max() < block.limits[1]


def test_many_inputs_are_cut() -> None:
    assert len(variables_of(made_up(samples(20), "sobol"))) == MOST_INPUTS + 1
