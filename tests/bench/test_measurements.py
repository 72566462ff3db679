"""The registry, what a number tells of its samples, and the report."""

import itertools
import json

import pytest

from blocksim.bench.harness import (
    Benchmark,
    Effort,
    Number,
    Readings,
    machine_lines,
    repeat,
    report,
    single,
    this_machine,
)
from blocksim.bench.registry import MEASUREMENTS, UnknownMeasurementError, choose
from blocksim.errors import ExitCode


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


def test_a_load_that_the_system_does_not_know_is_not_busy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.getloadavg")
    machine = this_machine()
    assert (machine["load"], machine["busy"]) == (None, False)
    assert machine_lines(machine)[0].endswith(" cores, load unknown at the start")
