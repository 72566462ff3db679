"""The registry, and what a number tells of its samples."""

import itertools
import json

import pytest

from blocksim.bench.bench import report, run_measurement
from blocksim.bench.machine import Machine, this_machine
from blocksim.bench.measurement import Findings, Measurement, Number, Setting, repeated, single
from blocksim.bench.measurements import MEASUREMENTS, PEERS, UnknownMeasurementError, chosen
from blocksim.errors import ExitCode


def test_a_number_is_the_median_with_its_spread() -> None:
    one = Number("a step", "ns", (3.0, 9.0, 4.0))
    assert (one.median, one.smallest, one.largest, one.is_repeated) == (4.0, 3.0, 9.0, True)
    assert not single("memory", "bytes", 7).is_repeated


def test_every_repeat_is_a_sample_of_its_own() -> None:
    counter = itertools.count(1)
    assert repeated("n", "", lambda: next(counter), 3).samples == (1.0, 2.0, 3.0)


def test_chosen_keeps_the_order_of_the_registry() -> None:
    assert chosen([]) == MEASUREMENTS
    assert [one.name for one in chosen(["start-up", "walls", "walls"])] == ["walls", "start-up"]
    assert chosen(["wall"], peers=True) == PEERS[2:]


@pytest.mark.parametrize(
    ("name", "peers", "told"),
    [
        (
            "wals",
            False,
            "NAME 'wals': no such measurement, did you mean 'walls'? Choose: three-blocks, ensemble, walls, threads",
        ),
        ("wals", True, "did you mean 'wall'? Choose with --peers: three-blocks, three-blocks-e0, wall"),
        (
            "memory",
            False,
            "NAME 'memory': no such measurement; choose: three-blocks, ensemble, walls, threads, nonsmooth-blocks",
        ),
    ],
)
def test_unknown_names_are_wrong_usage(name: str, peers: bool, told: str) -> None:
    with pytest.raises(UnknownMeasurementError) as caught:
        chosen(["three-blocks", name], peers=peers)
    assert told in str(caught.value)
    assert caught.value.exit_code == ExitCode.USAGE


def test_the_report_is_json_without_numbers_that_json_lacks() -> None:
    numbers = (Number("there", "s", (1.0, 2.0)), single("never", "s", float("inf")))
    measurement = Measurement("made-up", "made up", lambda _: Findings(numbers, ("said",)), quick="less")
    outcome = run_measurement(measurement, Setting(quick=True))
    data = report(this_machine(), [outcome])
    (found,) = json.loads(json.dumps(data, allow_nan=False))["measurements"]
    assert (found["shortened"], found["notes"]) == ("less", ["said"])
    assert found["numbers"][0]["samples"] == [1.0, 2.0]
    assert [one["median"] for one in found["numbers"]] == [1.5, None]


@pytest.mark.parametrize(("load", "busy"), [(None, False), (0.1, False), (1.7, True)])
def test_a_busy_machine_is_reported(load: float | None, busy: bool) -> None:
    machine = Machine("P9", 4, "Linux", "3.12", "0.6", "2.0", "1.0", "abc", load)
    assert machine.is_busy == busy
    assert machine.to_dict()["busy"] == busy
    assert any("Other processes" in line for line in machine.lines()) == busy
    assert machine.lines()[0] == f"P9, 4 cores, load {'unknown' if load is None else f'{load:.2f}'} at the start"
