"""Measurements of the non-smooth scheme, at their quick sizes: what they run and what they tell."""

import math

import numpy as np
import pytest

from blocksim.bench import nonsmooth_blocks, nonsmooth_threads, nonsmooth_walls
from blocksim.bench.measurement import Setting
from blocksim.bench.scenes import three_blocks
from blocksim.bench.stepping import UNTIL_SOLVED, Stepping
from blocksim.bench.walls import Size, growth
from blocksim.scenario.models.stepping import Nonsmooth

QUICK = Setting(quick=True, repeats=2)


def test_a_stepping_is_what_the_scenario_gets() -> None:
    time = three_blocks(time=Stepping(2e-3, substeps=3, sweeps=5).time(end=0.5)).time
    assert isinstance(time, Nonsmooth)
    assert (time.step, time.substeps, time.velocity_sweeps, time.end) == (2e-3, 3, 5, 0.5)
    default = three_blocks(time={"scheme": "nonsmooth"}).time
    assert isinstance(default, Nonsmooth)
    assert Stepping(1e-3).sweeps == UNTIL_SOLVED == default.velocity_sweeps


def test_three_blocks_end_where_one_sweep_without_restitution_puts_them() -> None:
    found = nonsmooth_blocks.measure(QUICK)
    *_, without = found.details
    assert (without["step"], without["substeps"], without["velocity_sweeps"]) == (1e-3, 1, 1)
    x = np.array(without["x_mm"])
    assert x[:2] == pytest.approx([16.0, 67.03], abs=0.15)
    assert x[2] == pytest.approx(128.78, abs=0.25)
    assert f"at x = {x[1]:.2f} and" in found.notes[0]


def test_three_blocks_tell_times_alone_and_among_many_and_a_setting_that_finer_ones_confirm() -> None:
    found = nonsmooth_blocks.measure(QUICK)
    names = ["alone", "among many", "collapses a second and core"]
    assert [one.quantity for one in found.numbers] == [f"e = {e}: {name}" for e in ("0", "0.2") for name in names]
    assert all(len(one.samples) == 2 and one.median > 0.0 for one in found.numbers)
    assert found.numbers[4].samples == pytest.approx([1e3 / one for one in found.numbers[5].samples])
    *levels, finest, _ = found.details
    assert (finest["step"], finest["off_mm"]) == (2e-4, 0.0)
    assert len(levels) == 6
    assert "settings that are, as all with shorter steps, within 0.2 mm" in found.notes[1]


def test_walls_tell_times_growth_and_where_the_first_one_ends() -> None:
    found = nonsmooth_walls.measure(QUICK)
    whole, share, small, large, exponent, x, y = found.numbers
    assert [one.quantity for one in (whole, small, large)] == [
        "40 blocks, 0.1 s",
        "40 blocks, a substep",
        "160 blocks, a substep",
    ]
    assert share.median == pytest.approx(1e9 * whole.median / (100 * 4 * 40))
    assert math.isfinite(exponent.median)
    assert 100.0 < x.median < 250.0  # mm; the wall is 272 mm long
    assert 0.0 < y.median < 62.5  # mm: lower than it stood
    assert all(float(str(row["sweeps_per_substep"])) >= 1.0 for row in found.details)


def test_growth_is_that_of_the_time_of_a_whole_substep() -> None:
    sizes = (Size(10, 10), Size(40, 25))
    walls = [nonsmooth_walls.Wall(size, (size.blocks**1.25,), 10, 0, 0, 0.0, 0.0) for size in sizes]
    assert growth(walls) == pytest.approx(1.25)


def test_threads_leave_small_walls_alone() -> None:
    found = nonsmooth_threads.measure(Setting(quick=True, repeats=1))
    assert [one.quantity for one in found.numbers] == [
        "40 blocks, 2 threads",
        "40 blocks, speed-up",
        "1000 blocks, 2 threads",
        "1000 blocks, speed-up",
    ]
    assert all(math.isfinite(one.median) and one.median > 0.0 for one in found.numbers)
    assert found.notes[1].startswith("walls of 40 blocks always use one thread")
