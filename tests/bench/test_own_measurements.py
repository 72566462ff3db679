"""Our own measurements, at their quick sizes."""

import math
from pathlib import Path

import pytest

from blocksim.bench import ensemble, startup, threads, three_blocks, walls
from blocksim.bench.measurement import Setting, single
from blocksim.bench.startup import StartError

QUICK = Setting(quick=True, repeats=2)


def test_three_blocks_tell_the_cheapest_converged_setting() -> None:
    found = three_blocks.measure(QUICK)
    step, answer, stiffest = found.numbers
    assert all(len(one.samples) == 2 for one in found.numbers)
    assert 20.0 < step.median < 1e5
    assert 0.0 < answer.median < stiffest.median
    off = {(row["stiffness_scale"], row["safety"]): float(str(row["off_mm"])) for row in found.details}
    assert len(off) == 6
    assert off[1e-2, 0.05] == 0.0
    assert off[1e-4, 0.05] > 0.2
    assert "stiffness_scale 0.001" in found.notes[0]


def test_ensemble_tells_its_rates_by_both_schemes_and_its_members_differ() -> None:
    found = ensemble.measure(QUICK)
    names = ["a second and core", "a second, 1 thread", "a second, 2 threads"]
    assert [one.quantity for one in found.numbers] == [
        f"{way}: {name}" for way in ("explicit", "nonsmooth") for name in names
    ]
    assert all(len(one.samples) == 2 and one.median > 1.0 for one in found.numbers)
    for way in ensemble.WAYS:
        members = ensemble.scattered(5, way)
        assert len({scenario.friction.model_dump_json() for scenario in members}) == 5
        assert {scenario.time.scheme for scenario in members} == {way.scheme}


def test_walls_tell_time_memory_and_growth() -> None:
    found = walls.measure(QUICK)
    assert [one.quantity for one in found.numbers[:2]] == ["100 blocks", "400 blocks"]
    assert all(20.0 < one.median < 1e5 for one in found.numbers[:2])
    assert all(800.0 < one.median < 2000.0 for one in found.numbers[2:4])
    assert math.isfinite(found.numbers[4].median)
    assert {row["rebuilds"] for row in found.details} != {0}  # making pair lists is part of what is timed


def test_threads_tell_their_time_and_by_how_much_they_are_faster_and_leave_small_walls_alone() -> None:
    found = threads.measure(QUICK)
    assert [one.quantity for one in found.numbers] == [
        "100 blocks, 2 threads",
        "100 blocks, speed-up",
        "400 blocks, 2 threads",
        "400 blocks, speed-up",
    ]
    assert all(len(one.samples) == 2 and math.isfinite(one.median) and one.median > 0.0 for one in found.numbers)
    assert found.notes[1].startswith("walls of 100 blocks always use one thread")


def test_growth_is_the_exponent_of_a_power_law() -> None:
    found = [
        walls.Wall(size, single("", "ns", 5.0 * size.blocks**0.25), 1.0, 0, 1.0) for size in walls.SIZES
    ]  # ns per block and step, so the time of a step goes with the power 1.25
    assert walls.growth(found) == pytest.approx(1.25)


def test_starts_are_timed_in_processes_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    version, run = startup.measure(Setting(quick=True, repeats=1)).numbers
    assert 0.01 < version.median < run.median
    assert list(tmp_path.iterdir()) == []


def test_a_start_that_fails_is_reported() -> None:
    with pytest.raises(StartError, match=r"rnu: exit code 2: .*No such command 'rnu'"):
        startup._seconds(startup.MAIN, "rnu")
