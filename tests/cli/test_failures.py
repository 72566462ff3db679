"""Whatever happens: one message, the right exit code, no traceback."""

import errno
from pathlib import Path

import pytest
import typer

from blocksim.cli.commands import errors_as_messages, report_internal_error
from blocksim.errors import ExitCode, InputMissingError, OutputError
from tests.cli.conftest import Command

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
