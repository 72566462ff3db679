"""Measurements at their quick sizes: scenes, runs from the same state, what they tell, the registry and the report."""

import itertools
import json
from collections.abc import Callable
from math import isfinite
from pathlib import Path

import numpy as np
import pytest

from blocksim.bench import registry
from blocksim.bench.harness import (
    Benchmark,
    Effort,
    Number,
    Readings,
    Rerun,
    RunFailedError,
    machine_lines,
    repeat,
    report,
    single,
    this_machine,
    three_blocks,
)
from blocksim.bench.registry import MEASUREMENTS, START_UP, StartError, UnknownMeasurementError, choose
from blocksim.bench.three_blocks import CLOSE, SETTINGS, Solution, converged_levels, scatter_friction
from blocksim.errors import ExitCode
from blocksim.scenario import Model, load_scenario
from tests.golden import Golden

NOMINAL = Path(__file__).parents[2] / "scenarios" / "three_blocks_nominal.toml"
SOFT = {"stiffness_scale": 1e-4}


def of_springs(found: Readings) -> None:
    step, answer, stiffest = (one.median for one in found.numbers)
    assert 20.0 < step < 1e5
    assert 0.0 < answer < stiffest
    off = {(row["stiffness_scale"], row["safety"]): float(str(row["off_mm"])) for row in found.details}
    assert off[1e-2, 0.05] == 0.0
    assert off[1e-4, 0.05] > 0.2
    assert "stiffness_scale 0.001" in found.notes[0]


def of_rigid_blocks(found: Readings) -> None:
    assert found.numbers[4].samples == pytest.approx([1e3 / one for one in found.numbers[5].samples])
    *levels, finest, without = found.details
    assert (len(levels), finest["step"], finest["off_mm"]) == (6, 2e-4, 0.0)
    assert "settings that are, as all with shorter steps, within 0.2 mm" in found.notes[1]
    assert (without["step"], without["substeps"], without["velocity_sweeps"]) == (1e-3, 1, 1)
    x = np.array(without["x_mm"])
    assert np.abs(x - [16.0, 67.03, 128.78]).max() < 0.25  # where one sweep without restitution puts them
    assert f"at x = {x[1]:.2f} and" in found.notes[0]


def of_rigid_walls(found: Readings) -> None:
    whole, share, *_, x, y = (one.median for one in found.numbers)
    assert share == pytest.approx(1e9 * whole / (100 * 4 * 40))
    assert 100.0 < x < 250.0  # mm; the wall is 272 mm long
    assert 0.0 < y < 62.5  # mm: lower than it stood
    assert all(float(str(row["sweeps_per_substep"])) >= 1.0 for row in found.details)


def of_walls(found: Readings) -> None:
    assert all(800.0 < one.median < 2000.0 for one in found.numbers[2:4])
    assert {row["rebuilds"] for row in found.details} != {0}  # making pair lists is part of what is timed


def of_threads(found: Readings) -> None:
    assert found.notes[1].endswith("blocks always use one thread")


SPECIAL: dict[str, Callable[[Readings], None]] = {
    "three-blocks": of_springs,
    "nonsmooth-blocks": of_rigid_blocks,
    "walls": of_walls,
    "nonsmooth-walls": of_rigid_walls,
    "threads": of_threads,
    "nonsmooth-threads": of_threads,
}


@pytest.mark.parametrize(
    "measurement",
    [pytest.param(one, id=one.name, marks=pytest.mark.long if one is START_UP else ()) for one in MEASUREMENTS],
)
def test_measurement_tells_its_numbers(
    measurement: Benchmark, golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    repeats = 1 if measurement is START_UP else 2  # processes that start take seconds
    found = measurement.measure(Effort(quick=True, repeats=repeats))
    for one in found.numbers:
        assert all(isfinite(sample) for sample in one.samples)
        assert min(one.samples) > 0.0 or "exponent" in one.quantity
    golden("\n".join(f"{one.quantity} | {one.unit} | {len(one.samples)}" for one in found.numbers))
    if measurement.name in SPECIAL:
        SPECIAL[measurement.name](found)
    assert list(tmp_path.iterdir()) == []


def test_levels_count_as_converged_from_where_all_finer_ones_agree() -> None:
    def level(scale: float, x: float) -> Solution:
        return Solution({"scale": scale}, np.array([[0.0, 0.0, x], [0.0, 0.0, 0.0]]), (3.0, 1.0, 2.0), 10)

    levels = [level(1e-4, 0.9 * CLOSE), level(1e-3, 2.0 * CLOSE), level(1e-2, -0.9 * CLOSE), level(1.0, 0.0)]
    assert [one.setting["scale"] for one in converged_levels(levels, levels[-1])] == [1.0, 1e-2]
    told = levels[1].detail(levels[-1])
    assert (levels[1].text, told["scale"], told["steps"], told["cpu_ms"]) == ("scale 0.001", 1e-3, 10, 2000.0)
    assert told["off_mm"] == pytest.approx(0.4)


@pytest.mark.parametrize("scheme", SETTINGS)
def test_members_of_the_ensemble_differ_in_friction(scheme: str) -> None:
    members = scatter_friction(5, scheme)
    assert len({model.scenario.friction.model_dump_json() for model in members}) == 5
    assert {model.scenario.time.scheme for model in members} == {scheme}


def test_a_number_is_the_median_of_its_samples_and_what_is_chosen_keeps_the_order_of_the_registry() -> None:
    values = itertools.cycle((3.0, 9.0, 4.0))
    one = repeat("a step", "ns", lambda: next(values), 3)
    assert (one.median, one.samples) == (4.0, (3.0, 9.0, 4.0))
    assert choose([]) == MEASUREMENTS
    assert [one.name for one in choose(["start-up", "walls", "walls"])] == ["walls", "start-up"]


def test_a_failed_command_is_not_timed_and_unknown_names_are_wrong_usage(golden: Golden) -> None:
    said = []
    for name in ("wals", "memory"):
        with pytest.raises(UnknownMeasurementError) as caught:
            choose(["three-blocks", name])
        assert caught.value.exit_code == ExitCode.USAGE
        said.append(str(caught.value))
    golden("\n".join(said))
    with pytest.raises(StartError, match=r"rnu: exit code 2: .*No such command 'rnu'"):
        registry._seconds(registry.MAIN, "rnu")


def test_the_report_is_json_without_numbers_that_json_lacks() -> None:
    numbers = (Number("there", "s", (1.0, 2.0)), single("never", "s", float("inf")))
    measurement = Benchmark("made-up", "made up", lambda _: Readings(numbers, ("said",)), quick="less")
    data = report(this_machine(), [measurement.run(Effort(quick=True))])
    (found,) = json.loads(json.dumps(data, allow_nan=False))["measurements"]
    assert (found["shortened"], found["notes"]) == ("less", ["said"])
    there, never = found["numbers"]
    spread = {"median": 1.5, "smallest": 1.0, "largest": 2.0, "samples": [1.0, 2.0]}
    assert there == {"quantity": "there", "unit": "s", **spread}
    assert never["median"] is None


@pytest.mark.parametrize(("load", "told", "busy"), [(0.1, "0.10", 0), (1.7, "1.70", 1)])
def test_a_busy_machine_is_reported(load: float, told: str, busy: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.getloadavg", lambda: (load, 0.0, 0.0))
    machine = this_machine()
    assert machine["busy"] == busy
    lines = machine_lines(machine)
    assert sum("Other processes" in line for line in lines) == busy
    assert lines[0].endswith(f" cores, load {told} at the start")


def test_three_blocks_are_those_of_the_scenario_that_ships() -> None:
    ours, shipped = three_blocks(), load_scenario(NOMINAL)
    assert Model(ours).bodies == Model(shipped).bodies
    for table in ("materials", "blocks", "ground", "friction", "contact", "time", "gravity"):
        assert getattr(ours, table) == getattr(shipped, table), table


def test_every_run_starts_from_the_same_state() -> None:
    scene = Rerun(three_blocks(contact=SOFT, time={"stop_at_rest": False}))
    last = round(0.3 / scene.step)
    first = scene.run(last)
    x = first.bodies.x.copy()
    assert first.scene.world.clock[0].steps == last
    assert first.seconds > 0.0
    assert x[2] > 0.12  # block 3 has fallen
    assert np.array_equal(scene.run(last).bodies.x, x)
    assert scene.run(1).bodies.x[2] < 0.061
    world = scene.scene.world
    assert scene.bytes > world.bodies.nbytes + world.pairs.nbytes + world.contacts.nbytes


def test_a_run_that_breaks_off_is_reported_and_not_timed() -> None:
    scene = Rerun(three_blocks(contact={**SOFT, "max_overlap": 1e-6}))
    with pytest.raises(RunFailedError, match="overlap"):
        scene.run(1000)
