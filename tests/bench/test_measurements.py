"""Our own measurements, at their quick sizes: what they run and what they tell."""

import math
from pathlib import Path

import numpy as np
import pytest

from blocksim.bench import registry, three_blocks, walls
from blocksim.bench.harness import Effort
from blocksim.bench.registry import StartError, choose
from blocksim.bench.three_blocks import CLOSE, Solution, converged_levels

QUICK = Effort(quick=True, repeats=2)


def level(scale: float, x: float) -> Solution:
    """Return one whose third block ends at x (m)."""
    return Solution({"scale": scale}, np.array([[0.0, 0.0, x], [0.0, 0.0, 0.0]]), (3.0, 1.0, 2.0), 10)


def test_levels_count_as_converged_from_where_all_finer_ones_agree() -> None:
    levels = [level(1e-4, 0.9 * CLOSE), level(1e-3, 2.0 * CLOSE), level(1e-2, -0.9 * CLOSE), level(1.0, 0.0)]
    assert [one.setting["scale"] for one in converged_levels(levels, levels[-1])] == [1.0, 1e-2]
    told = levels[1].detail(levels[-1])
    assert (levels[1].text, told["scale"], told["steps"], told["cpu_ms"]) == ("scale 0.001", 1e-3, 10, 2000.0)
    assert told["off_mm"] == pytest.approx(0.4)


def test_three_blocks_tell_the_cheapest_converged_setting() -> None:
    found = three_blocks.EXPLICIT.measure(QUICK)
    step, answer, stiffest = found.numbers
    assert all(len(one.samples) == 2 for one in found.numbers)
    assert 20.0 < step.median < 1e5
    assert 0.0 < answer.median < stiffest.median
    off = {(row["stiffness_scale"], row["safety"]): float(str(row["off_mm"])) for row in found.details}
    assert len(off) == 6
    assert off[1e-2, 0.05] == 0.0
    assert off[1e-4, 0.05] > 0.2
    assert "stiffness_scale 0.001" in found.notes[0]


def test_rigid_blocks_tell_times_alone_and_among_many_and_a_setting_that_finer_ones_confirm() -> None:
    found = three_blocks.NONSMOOTH.measure(QUICK)
    names = ["alone", "among many", "collapses a second and core"]
    assert [one.quantity for one in found.numbers] == [f"e = {e}: {name}" for e in ("0", "0.2") for name in names]
    assert all(len(one.samples) == 2 and one.median > 0.0 for one in found.numbers)
    assert found.numbers[4].samples == pytest.approx([1e3 / one for one in found.numbers[5].samples])
    *levels, finest, without = found.details
    assert (len(levels), finest["step"], finest["off_mm"]) == (6, 2e-4, 0.0)
    assert "settings that are, as all with shorter steps, within 0.2 mm" in found.notes[1]
    assert (without["step"], without["substeps"], without["velocity_sweeps"]) == (1e-3, 1, 1)
    x = np.array(without["x_mm"])
    assert np.abs(x - [16.0, 67.03, 128.78]).max() < 0.25  # where one sweep without restitution puts them
    assert f"at x = {x[1]:.2f} and" in found.notes[0]


def test_ensemble_tells_its_rates_by_both_schemes_and_its_members_differ() -> None:
    found = three_blocks.ENSEMBLE.measure(QUICK)
    names = ["a second and core", "a second, 1 thread", "a second, 2 threads"]
    schemes = ("explicit", "nonsmooth")
    assert [one.quantity for one in found.numbers] == [f"{scheme}: {name}" for scheme in schemes for name in names]
    assert all(len(one.samples) == 2 and one.median > 1.0 for one in found.numbers)
    for scheme in three_blocks.SETTINGS:
        members = three_blocks.scatter_friction(5, scheme)
        assert len({scenario.friction.model_dump_json() for scenario in members}) == 5
        assert {scenario.time.scheme for scenario in members} == {scheme}


def test_walls_on_springs_tell_time_memory_and_growth() -> None:
    found = walls.EXPLICIT.measure(QUICK)
    assert [one.quantity for one in found.numbers[:2]] == ["100 blocks", "400 blocks"]
    assert all(20.0 < one.median < 1e5 for one in found.numbers[:2])
    assert all(800.0 < one.median < 2000.0 for one in found.numbers[2:4])
    assert math.isfinite(found.numbers[4].median)
    assert {row["rebuilds"] for row in found.details} != {0}  # making pair lists is part of what is timed


def test_rigid_walls_tell_times_growth_and_where_the_first_one_ends() -> None:
    found = walls.NONSMOOTH.measure(QUICK)
    whole, share, small, large, exponent, x, y = found.numbers
    names = ["40 blocks, 0.1 s", "40 blocks, a substep", "160 blocks, a substep"]
    assert [one.quantity for one in (whole, small, large)] == names
    assert share.median == pytest.approx(1e9 * whole.median / (100 * 4 * 40))
    assert math.isfinite(exponent.median)
    assert 100.0 < x.median < 250.0  # mm; the wall is 272 mm long
    assert 0.0 < y.median < 62.5  # mm: lower than it stood
    assert all(float(str(row["sweeps_per_substep"])) >= 1.0 for row in found.details)


def test_soils_tell_times_beside_a_wall_memory_and_what_two_threads_gain() -> None:
    found = {one.quantity: one for one in walls.SOILS.measure(QUICK).numbers}
    names = ("", ", over a block of a wall", ", memory")
    wanted = [f"{count} particles{name}" for name in names for count in (256, 484)]
    assert [*found] == [*wanted, "484 particles, 2 threads", "484 particles, speed-up"]
    assert all(len(found[name].samples) == 2 and found[name].median > 0.0 for name in (*wanted[:4], *[*found][-2:]))
    assert found["484 particles, memory"].median < found["256 particles, memory"].median < 600.0


@pytest.mark.parametrize(("name", "small", "large"), [("threads", 100, 400), ("nonsmooth-threads", 40, 1000)])
def test_threads_tell_by_how_much_they_are_faster_and_leave_small_walls_alone(
    name: str, small: int, large: int
) -> None:
    (measurement,) = choose([name])
    found = measurement.measure(QUICK)
    told = [f"{count} blocks, {what}" for count in (small, large) for what in ("2 threads", "speed-up")]
    assert [one.quantity for one in found.numbers] == told
    assert all(len(one.samples) == 2 and math.isfinite(one.median) and one.median > 0.0 for one in found.numbers)
    assert found.notes[1].startswith(f"walls of {small} blocks always use one thread")


def test_starts_are_timed_in_processes_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    version, run = registry.START_UP.measure(Effort(quick=True, repeats=1)).numbers
    assert 0.01 < version.median < run.median
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(StartError, match=r"rnu: exit code 2: .*No such command 'rnu'"):
        registry._seconds(registry.MAIN, "rnu")
