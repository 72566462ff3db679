"""Commands in a child process, and how much of what comes in is tried."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import pytest
from hypothesis import given, settings, strategies as st

from tests.fuzz.child import MOST_BYTES, MOST_SECONDS, Child, Left
from tests.fuzz.runs import Run, finished_run
from tests.sizes import in_all

ROOT = Path(__file__).parents[2]
T = TypeVar("T")
QUICK = 25  # a taste: even a tenth of a long test is as much again, and more
PLACED = re.compile(r"^bad\.toml:\d+: ", re.MULTILINE)
WHOLE = ("not a text file", "the file is empty", "nested too deeply", "larger than", "not valid TOML: ")


def tries(many: int) -> pytest.MarkDecorator:
    """Give a test the number of examples it is to try: a few, and `many` in a long one."""
    return pytest.mark.parametrize("tried", [QUICK, pytest.param(in_all(many), marks=pytest.mark.long)], ids=str)


def search(tried: int, examples: st.SearchStrategy[T], check: Callable[[T], None]) -> None:
    """Check so many examples, the same ones every time."""
    settings(max_examples=tried)(given(examples)(check))()


def assert_harmless(left: Left, codes: set[int], usual: float = 0.0) -> None:
    """Check that a command ended as commands may: by no exception, soon, with little memory, and a known code.

    `usual` is what the command takes by itself, in s.
    """
    told = f"{left.code}\n{left.err}\n{left.traceback}"
    assert not left.traceback, told
    assert left.code in codes, told
    assert "Traceback" not in left.err, told
    assert bool(left.err) or left.code in {0, 1}, told
    assert left.seconds < MOST_SECONDS + usual, f"{left.seconds} s: {told}"
    assert left.memory < MOST_BYTES, f"{left.memory} bytes: {told}"


def check_damaged(child: Child, folder: Path, content: bytes) -> None:
    """Let a scenario be checked: it is accepted, or refused with the place, or as a whole."""
    (folder / "bad.toml").write_bytes(content)
    left = child.call(folder, "check", "bad.toml")
    assert_harmless(left, {0, 65, 66})
    if left.code == 65 and "bad.toml" in left.err:
        assert PLACED.search(left.err) or any(told in left.err for told in WHOLE), left.err


@pytest.fixture(scope="session")
def child() -> Iterator[Child]:
    """Give a process that runs commands, warm."""
    with Child(ROOT) as child:
        yield child


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a folder that all examples of a file use, one after the other, with the tables that scenarios name."""
    folder = tmp_path_factory.mktemp("fuzz")
    shutil.copytree(ROOT / "scenarios" / "experiments", folder / "experiments")
    return folder


@pytest.fixture(scope="session")
def run(child: Child, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Give the results of a short run, and room to damage them."""
    return finished_run(child, tmp_path_factory.mktemp("run"), ROOT / "scenarios" / "three_blocks_nominal.toml")
