"""Scatter matrices and histograms: which variables they show, and how far their axes reach."""

import numpy as np

from blocksim.view.sweeps.scatter import MOST_INPUTS, limits_of, variables_of
from tests.view.sweeps.made_up import REPEATS, grid, made_up, samples


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


def test_axis_leaves_out_the_rarest_run_outs_but_nothing_measured() -> None:
    x = np.append(np.linspace(60.0, 80.0, 999), 1000.0)
    low, high = limits_of(x, np.array([50.0, 85.0]))
    assert 49.0 > low > 45.0
    assert 85.0 < high < 90.0
    low, high = limits_of(np.full(3, 70.0), np.empty(0))
    assert low < 70.0 < high
