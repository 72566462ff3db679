"""Histograms: their axis, what they count, and what they name."""

from pathlib import Path

import numpy as np

from blocksim.view.sweeps.histogram import draw, limits_of
from tests.view.sweeps.made_up import made_up, samples


def test_histogram_names_cases_repeats_and_intervals(tmp_path: Path) -> None:
    path = tmp_path / "histogram.svg"
    sweep = made_up(samples(1)[:1], "sobol")
    draw(sweep, path)
    text = path.read_text(encoding="utf-8")
    for told in ("final x of block 2 (mm)", "all 50 cases", "6 repeats and their range", "next test (95 %)"):
        assert f"<!-- {told} -->" in text
    assert sweep.inside is not None
    assert f"<!-- all inside ({100 * int(sweep.inside.sum()) // 50} %) -->" in text


def test_histogram_without_measurements_names_cases_only(tmp_path: Path) -> None:
    path = tmp_path / "histogram.svg"
    draw(made_up(samples(1)[:1], "sobol", measured=False), path)
    text = path.read_text(encoding="utf-8")
    assert "all 50 cases" in text
    assert "repeats" not in text
    assert "all inside" not in text


def test_axis_leaves_out_the_rarest_run_outs_but_nothing_measured() -> None:
    x = np.append(np.linspace(60.0, 80.0, 999), 1000.0)
    low, high = limits_of(x, np.array([50.0, 85.0]))
    assert 49.0 > low > 45.0
    assert 85.0 < high < 90.0
    low, high = limits_of(np.full(3, 70.0), np.empty(0))
    assert low < 70.0 < high
