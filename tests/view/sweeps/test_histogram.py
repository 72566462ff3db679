"""Histograms: how far their axis reaches."""

import numpy as np

from blocksim.view.sweeps.scatter import limits_of


def test_axis_leaves_out_the_rarest_run_outs_but_nothing_measured() -> None:
    x = np.append(np.linspace(60.0, 80.0, 999), 1000.0)
    low, high = limits_of(x, np.array([50.0, 85.0]))
    assert 49.0 > low > 45.0
    assert 85.0 < high < 90.0
    low, high = limits_of(np.full(3, 70.0), np.empty(0))
    assert low < 70.0 < high
