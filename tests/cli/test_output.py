"""Tables fit the screen; numbers and JSON are fit for their readers."""

import json
import math
from pathlib import Path

import pytest

from blocksim.cli.output import answer, duration, note, number, print_json, table_lines
from blocksim.cli.prepare import announce_compilation
from blocksim.simulation import schemes


def test_columns_line_up() -> None:
    assert table_lines(("block", "x mm"), [("1", "16.00"), ("long", "-1.5")]) == [
        "block   x mm",
        "─────  ─────",
        "1      16.00",
        "long    -1.5",
    ]


def test_wide_table_cuts_texts_and_never_numbers_or_heads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    lines = table_lines(("block", "x"), [("a" * 60, "1234567.89"), ("b", "1")])
    assert max(map(len, lines)) == 40
    assert lines[2] == "a" * 27 + "…" + "  1234567.89"


def test_table_without_rows_has_its_heads() -> None:
    assert table_lines(("a", "b"), []) == ["a  b", "─  ─"]


@pytest.mark.parametrize(
    ("value", "text"), [(1.005, "1.00"), (-0.001, "0.00"), (-0.01, "-0.01"), (math.nan, "–"), (math.inf, "–")]
)
def test_numbers_have_no_minus_zero_and_no_nan(value: float, text: str) -> None:
    assert number(value) == text


def test_json_has_null_for_what_is_not_finite(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"a": [math.nan, (math.inf, 1.0)], "b": True})
    assert json.loads(capsys.readouterr().out) == {"a": [None, [None, 1.0]], "b": True}


def test_notes_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    note("0.1:x:3 [bold] é")
    assert capsys.readouterr().err == "0.1:x:3 [bold] é\n"


def test_compiled_solver_that_cannot_be_kept_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(schemes, "is_compiled", lambda _: False)
    monkeypatch.setattr(schemes, "compile_kernels", lambda _: 30.0)
    monkeypatch.setattr("blocksim.kernels.common.jit.cache_folder", lambda: Path("/disk/blocksim/0123"))
    announce_compilation("surface", quiet=False)
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith("/disk/blocksim/0123: the compiled solver cannot be stored there; free some space")


@pytest.mark.parametrize(
    ("seconds", "text"), [(119.0, "119.0 s"), (150.0, "2.5 min"), (9000.0, "2.5 h"), (216000.0, "2.5 days")]
)
def test_duration_has_the_largest_unit_of_which_there_are_two(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_answer_does_not_steer_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    answer("a\x1b[2Jb")
    assert capsys.readouterr().out == "a\ufffd[2Jb\n"
