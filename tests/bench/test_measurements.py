"""The registry, what a number tells of its samples, and the report."""

import itertools
import json

import pytest

from blocksim.bench.measurement import (
    Findings,
    Machine,
    Measurement,
    Number,
    Setting,
    repeat,
    report,
    single,
    this_machine,
)
from blocksim.bench.measurements import MEASUREMENTS, UnknownMeasurementError, choose
from blocksim.errors import ExitCode


def test_a_number_is_the_median_of_its_samples_with_their_spread() -> None:
    values = itertools.cycle((3.0, 9.0, 4.0))
    one = repeat("a step", "ns", lambda: next(values), 3)
    assert (one.median, one.smallest, one.largest, one.is_repeated) == (4.0, 3.0, 9.0, True)
    assert not single("memory", "bytes", 7).is_repeated


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
    measurement = Measurement("made-up", "made up", lambda _: Findings(numbers, ("said",)), quick="less")
    data = report(this_machine(), [measurement.run(Setting(quick=True))])
    (found,) = json.loads(json.dumps(data, allow_nan=False))["measurements"]
    assert (found["shortened"], found["notes"]) == ("less", ["said"])
    assert found["numbers"][0]["samples"] == [1.0, 2.0]
    assert [one["median"] for one in found["numbers"]] == [1.5, None]


@pytest.mark.parametrize(("load", "told", "busy"), [(None, "unknown", 0), (0.1, "0.10", 0), (1.7, "1.70", 1)])
def test_a_busy_machine_is_reported(load: float | None, told: str, busy: int) -> None:
    machine = Machine("P9", 4, "Linux", "3.12", "0.6", "2.0", "1.0", "abc", load)
    assert machine.to_dict()["busy"] == busy
    assert sum("Other processes" in line for line in machine.lines()) == busy
    assert machine.lines()[0] == f"P9, 4 cores, load {told} at the start"
