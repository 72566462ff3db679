"""How far something has come: a bar on a terminal, plain lines elsewhere."""

from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from blocksim.cli import progress
from blocksim.cli.progress import case_progress, cell_text, count_progress
from blocksim.study.rows import Head
from tests.cli.conftest import Command


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


def test_elsewhere_there_are_lines_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter([0.0, 1.0, 3.0, 4.0, 6.0])
    monkeypatch.setattr("blocksim.cli.progress.time.monotonic", lambda: next(now))
    with count_progress("pictures", quiet=False) as show:
        for done in range(1, 5):
            show(done, 4)
    assert capsys.readouterr().err == "2 of 4 pictures\n4 of 4 pictures\n"


def test_quiet_shows_nothing(terminal: StringIO, capsys: pytest.CaptureFixture[str]) -> None:
    with count_progress("pictures", quiet=True) as show, case_progress([], quiet=True) as on_row:
        show(1, 2)
        on_row(1, 2, {"status": "finished"})
    assert (terminal.getvalue(), capsys.readouterr().err) == ("", "")


def test_animate_counts_its_pictures_on_a_terminal(blocksim: Command, finished: Path, terminal: StringIO) -> None:
    answer = blocksim("animate", finished, "--speed", "1", "--fps", "10", "--width", "240")
    assert answer.code == 0
    assert " frames" in terminal.getvalue()


def test_many_cases_are_told_with_their_pace_their_failures_and_the_time_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter([0.0, 100.0, 100.0, 101.0])
    monkeypatch.setattr("blocksim.cli.progress.time.monotonic", lambda: next(now, 101.0))
    with case_progress([Head("gravity")], quiet=False) as on_row:
        on_row(10, 1000, {"status": "failed", "gravity": 9.81})
    assert capsys.readouterr().err == "10/1000 cases, 1 failed, 0.01 a second, 99000 s left\n"


def test_cells_are_told_in_words() -> None:
    assert [cell_text(one) for one in (True, False, 0.1, float("nan"), "slid")] == ["yes", "no", "0.1", "–", "slid"]
