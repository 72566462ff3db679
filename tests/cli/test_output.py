"""Tables fit the screen, numbers and JSON their readers; a bar on a terminal and lines elsewhere tell of progress."""

import json
import math
from collections.abc import Callable
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from blocksim.cli import progress
from blocksim.cli.output import answer, duration, note, number, print_json, table_lines
from blocksim.cli.prepare import announce_compilation
from blocksim.cli.progress import case_progress, cell_text, count_progress
from blocksim.simulation import schemes
from blocksim.study.rows import Head
from tests.cli.conftest import Command
from tests.golden import Golden


def test_tables_line_up_and_cut_texts_but_never_numbers_or_heads(
    monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    narrow = table_lines(("block", "x mm"), [("1", "16.00"), ("long", "-1.5")])
    wide = table_lines(("block", "x"), [("a" * 60, "1234567.89"), ("b", "1")])
    assert max(map(len, wide)) == 40
    golden("\n".join([*narrow, "", *wide, "", *table_lines(("a", "b"), [])]))


def test_numbers_durations_and_cells_are_told_in_words(golden: Golden) -> None:
    """Numbers have no minus zero and no NaN, durations the largest unit of which there are two."""
    numbers = [f"{value!r}: {number(value)}" for value in (1.005, -0.001, -0.01, math.nan, math.inf)]
    lengths = [f"{seconds} s: {duration(seconds)}" for seconds in (119.0, 150.0, 9000.0, 216000.0)]
    cells = [f"{cell!r}: {cell_text(cell)}" for cell in (True, False, 0.1, math.nan, "slid")]
    golden("\n".join([*numbers, "", *lengths, "", *cells]))


def test_json_has_null_for_what_is_not_finite_and_texts_do_not_steer_the_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_json({"a": [math.nan, (math.inf, 1.0)], "b": True})
    assert json.loads(capsys.readouterr().out) == {"a": [None, [None, 1.0]], "b": True}
    note("0.1:x:3 [bold] é")
    answer("a\x1b[2Jb")
    assert capsys.readouterr() == ("a\ufffd[2Jb\n", "0.1:x:3 [bold] é\n")


def test_compiled_solver_that_cannot_be_kept_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(schemes, "is_compiled", lambda _: False)
    monkeypatch.setattr(schemes, "compile_kernels", lambda _: 30.0)
    monkeypatch.setattr("blocksim.kernels.common.jit.cache_folder", lambda: Path("/disk/blocksim/0123"))
    announce_compilation("surface", quiet=False)
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith("/disk/blocksim/0123: the compiled solver cannot be stored there; free some space")


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> StringIO:
    """Have a terminal in place of standard error."""
    screen = StringIO()
    monkeypatch.setattr(progress, "Console", lambda **_: Console(file=screen, force_terminal=True, width=80))
    return screen


def test_terminal_has_a_bar_for_the_cases_of_a_sweep(terminal: StringIO, capsys: pytest.CaptureFixture[str]) -> None:
    with case_progress([Head("gravity")], quiet=False) as on_row:
        on_row(3, 8, {"status": "finished", "gravity": 9.81})
    assert "3 of 8 cases" in terminal.getvalue()
    assert capsys.readouterr().err == ""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Have a clock that shows these times (s), and then the last one."""

    def show(*times: float) -> None:
        left = iter(times)
        monkeypatch.setattr("blocksim.cli.progress.time.monotonic", lambda: next(left, times[-1]))

    return show


def test_elsewhere_there_are_lines_now_and_then_with_pace_failures_and_the_time_left(
    capsys: pytest.CaptureFixture[str], clock: Callable[..., None]
) -> None:
    clock(0.0, 1.0, 3.0, 4.0, 6.0)
    with count_progress("pictures", quiet=False) as show:
        for done in range(1, 5):
            show(done, 4)
    assert capsys.readouterr().err == "2 of 4 pictures\n4 of 4 pictures\n"
    clock(0.0, 100.0, 100.0, 101.0)
    with case_progress([Head("gravity")], quiet=False) as on_row:
        on_row(10, 1000, {"status": "failed", "gravity": 9.81})
    assert capsys.readouterr().err == "10/1000 cases, 1 failed, 0.01 a second, 99000 s left\n"


def test_quiet_shows_nothing(terminal: StringIO, capsys: pytest.CaptureFixture[str]) -> None:
    with count_progress("pictures", quiet=True) as show, case_progress([], quiet=True) as on_row:
        show(1, 2)
        on_row(1, 2, {"status": "finished"})
    assert (terminal.getvalue(), capsys.readouterr().err) == ("", "")


def test_animate_counts_its_pictures_on_a_terminal(blocksim: Command, finished: Path, terminal: StringIO) -> None:
    answer = blocksim("animate", finished, "--speed", "1", "--fps", "10", "--width", "240")
    assert answer.code == 0
    assert " frames" in terminal.getvalue()
