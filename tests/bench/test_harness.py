"""Scenes that are measured, runs from the same state, the registry, what a number tells of its samples, the report."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from blocksim.bench.harness import (
    UNTIL_SOLVED,
    Benchmark,
    Effort,
    Number,
    Readings,
    Rerun,
    RunFailedError,
    TimeSteps,
    machine_lines,
    pushed_wall,
    repeat,
    report,
    single,
    this_machine,
    three_blocks,
)
from blocksim.bench.registry import MEASUREMENTS, UnknownMeasurementError, choose
from blocksim.errors import ExitCode
from blocksim.scenario import load_scenario, place_bodies
from blocksim.scenario.models.timeline import Nonsmooth


def test_a_number_is_the_median_of_its_samples_with_their_spread() -> None:
    values = itertools.cycle((3.0, 9.0, 4.0))
    one = repeat("a step", "ns", lambda: next(values), 3)
    assert (one.median, one.samples) == (4.0, (3.0, 9.0, 4.0))
    assert single("memory", "bytes", 7).samples == (7.0,)


def test_chosen_keeps_the_order_of_the_registry() -> None:
    assert choose([]) == MEASUREMENTS
    assert [one.name for one in choose(["start-up", "walls", "walls"])] == ["walls", "start-up"]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("wals", ", did you mean 'walls'? Choose: three-blocks, ensemble, walls, threads, nonsmooth-blocks"),
        ("memory", "; choose: three-blocks, ensemble, walls, threads, nonsmooth-blocks"),
    ],
)
def test_unknown_names_are_wrong_usage(name: str, told: str) -> None:
    with pytest.raises(UnknownMeasurementError) as caught:
        choose(["three-blocks", name])
    assert f"NAME '{name}': no such measurement{told}" in str(caught.value)
    assert caught.value.exit_code == ExitCode.USAGE


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


NOMINAL = Path(__file__).parents[2] / "scenarios" / "three_blocks_nominal.toml"


def test_three_blocks_are_those_of_the_scenario_that_ships() -> None:
    ours, shipped = three_blocks(), load_scenario(NOMINAL)
    assert place_bodies(ours) == place_bodies(shipped)
    for table in ("materials", "blocks", "ground", "friction", "contact", "time", "gravity"):
        assert getattr(ours, table) == getattr(shipped, table), table


def test_a_stepping_is_what_the_scenario_gets() -> None:
    time = three_blocks(time=TimeSteps(2e-3, substeps=3, velocity_sweeps=5).time(end=0.5)).time
    assert isinstance(time, Nonsmooth)
    assert (time.step, time.substeps, time.velocity_sweeps, time.end) == (2e-3, 3, 5, 0.5)
    default = three_blocks(time={"scheme": "nonsmooth"}).time
    assert isinstance(default, Nonsmooth)
    assert TimeSteps(1e-3).velocity_sweeps == UNTIL_SOLVED == default.velocity_sweeps


def test_a_wall_is_pushed_in_proportion_to_height() -> None:
    placed = place_bodies(pushed_wall(4, 3))
    y, vx = np.array([(body.y, body.vx) for body in placed]).T
    assert len(placed) == 12
    assert {(body.size_x, body.size_y, body.depth) for body in placed} == {(0.05, 0.032, 0.025)}
    assert vx == pytest.approx(1.0 * y / 0.096)
    assert not any(body.vy or body.spin for body in placed)


SOFT = {"stiffness_scale": 1e-4}


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
