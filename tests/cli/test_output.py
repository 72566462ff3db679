"""Tables fit the screen, progress is told, and whatever happens there is one message and the right exit code."""

import errno
import json
import math
from collections.abc import Callable
from io import StringIO
from pathlib import Path

import pytest
import typer
from rich.console import Console

from blocksim.cli import progress
from blocksim.cli.commands import errors_as_messages, report_internal_error
from blocksim.cli.output import answer, duration, note, number, print_json, table_lines
from blocksim.cli.prepare import announce_compilation
from blocksim.cli.progress import case_progress, cell_text, count_progress
from blocksim.errors import ExitCode, InputMissingError, OutputError
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
    monkeypatch.setattr(progress, "is_on_terminal", lambda: True)
    monkeypatch.setattr("rich.console.Console", lambda **_: Console(file=screen, force_terminal=True, width=80))
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


LONG = "x" * 300


def exit_code_of(error: BaseException) -> int:
    def fail() -> None:
        with errors_as_messages():
            raise error

    with pytest.raises(typer.Exit) as caught:
        fail()
    return caught.value.exit_code


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputMissingError("x: no such file"), ExitCode.INPUT_MISSING),
        (OutputError("x: cannot be written"), ExitCode.INPUT_OUTPUT),
        (KeyboardInterrupt(), ExitCode.STOPPED_EARLY),
        (OSError(errno.ENOSPC, "No space left on device"), ExitCode.INPUT_OUTPUT),
        (OSError(errno.EMFILE, "Too many open files"), ExitCode.INPUT_OUTPUT),
        (MemoryError(), ExitCode.INPUT_OUTPUT),
        (ImportError("x.so: failed to map segment from shared object"), ExitCode.INPUT_OUTPUT),
        (RuntimeError("can't start new thread"), ExitCode.INPUT_OUTPUT),
    ],
)
def test_error_becomes_a_line_and_its_exit_code(
    capsys: pytest.CaptureFixture[str], error: BaseException, code: int
) -> None:
    assert exit_code_of(error) == code
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_shortage_that_a_library_wraps_is_reported_and_no_other_error(capsys: pytest.CaptureFixture[str]) -> None:
    error = RuntimeError("cannot compile")
    error.__cause__ = MemoryError()
    assert exit_code_of(error) == ExitCode.INPUT_OUTPUT
    assert capsys.readouterr().err.startswith("the system has run out of memory")
    with pytest.raises(ZeroDivisionError), errors_as_messages():
        raise ZeroDivisionError


def test_current_folder_that_is_gone_is_reported(
    blocksim: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    answer = blocksim("run", tmp_path / "scenarios" / "three_blocks_nominal.toml")
    assert answer.code == 66
    assert answer.err == "the current folder no longer exists; change to another one with cd\n"


def test_internal_error_is_one_line_and_a_file_also_on_a_full_disk(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    report_internal_error(ValueError("two\nlines"))
    line = capsys.readouterr().err
    assert line.startswith("internal error: ValueError: two lines; please report it with the file ")
    assert line.count("\n") == 1
    assert "ValueError: two" in next(tmp_path.iterdir()).read_text()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    report_internal_error(ValueError("x"))
    assert "internal error: ValueError: x" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["export", "report", "compare", "plot", "animate", "check"])
def test_names_that_are_too_long_are_reported_in_a_line(blocksim: Command, command: str) -> None:
    answer = blocksim(command, LONG)
    assert answer.code in {66, 74}
    assert "File name too long" in answer.err
    assert len(answer.err) < 2 * len(LONG)
