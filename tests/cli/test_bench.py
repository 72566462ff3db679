"""blocksim bench: the table on a screen, for programs, its file, and wrong usage."""

import json
from pathlib import Path

import pytest

from blocksim.bench import registry
from blocksim.bench.harness import Benchmark, Effort, Number, Readings, single
from tests.cli.conftest import Command


def measured(effort: Effort) -> Readings:
    numbers = (Number("a step", "ns", (3.0, 1.0, 2.0)[: effort.repeats]), single("memory", "bytes/block", 5000.0))
    return Readings(numbers, notes=("soft",), details=({"quick": effort.quick},))


def stopped(_: Effort) -> Readings:
    raise KeyboardInterrupt


@pytest.fixture(autouse=True)
def table_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    table = (
        Benchmark("first", "made up", measured, quick="half of it"),
        Benchmark("stop", "stopped", stopped, quick=""),
    )
    monkeypatch.setattr(registry, "MEASUREMENTS", table)


def test_table_fits_80_columns_and_names_the_machine_and_json_and_file_hold_the_same(blocksim: Command) -> None:
    answer = blocksim("bench", "first", "--repeats", 3, "--quick")
    assert answer.code == 0
    lines = answer.out.splitlines()
    assert lines[0].split() == ["quantity", "unit", "median", "smallest", "largest"]
    assert lines[2] == "first: made up"
    assert lines[3].split() == ["a", "step", "ns", "2", "1", "3"]
    assert lines[4].split() == ["memory", "bytes/block", "5000", "–", "–"]
    assert max(map(len, lines)) <= 80
    for told in ("first: soft", "first shortened: half of it", "cores, load", "numba", "blocksim 0"):
        assert told in answer.err
    answer = blocksim("bench", "first", "--json", "--out", "bench.json")
    assert answer.err == ""
    data = json.loads(answer.out)
    assert json.loads(Path("bench.json").read_text(encoding="utf-8")) == data
    machine = {"processor", "cores", "platform", "python", "numba", "numpy", "blocksim", "load", "busy"}
    assert machine <= set(data["machine"])
    assert data["measurements"][0]["numbers"][0]["samples"] == [3.0, 1.0, 2.0]
    assert data["measurements"][0]["details"] == [{"quick": False}]


def test_a_stop_keeps_what_was_measured(blocksim: Command) -> None:
    answer = blocksim("bench", "--out", "bench.json")
    assert answer.code == 75
    assert "a step" in answer.out
    assert "stopped" in answer.err
    assert len(json.loads(Path("bench.json").read_text(encoding="utf-8"))["measurements"]) == 1
