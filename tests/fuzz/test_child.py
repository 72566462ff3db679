"""The process that commands run in: what it tells of memory is theirs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.fuzz.child import KERNEL, MOST_BYTES, Child, _forget_memory, _most_memory

ROOT = Path(__file__).parents[2]


def test_memory_of_the_tests_is_not_taken_for_that_of_a_command(tmp_path: Path) -> None:
    held = np.ones(MOST_BYTES // 8 + 1)
    with Child(ROOT) as child:
        left = child.call(tmp_path, "--version")
    assert held.nbytes > MOST_BYTES
    assert 10**6 < left.memory < MOST_BYTES / 2


def test_memory_of_one_command_is_not_taken_for_that_of_the_next() -> None:
    if not KERNEL.is_dir():
        pytest.skip("only Linux forgets")
    held = np.ones(MOST_BYTES // 8)
    _forget_memory()
    before = _most_memory()
    size = held.nbytes
    del held
    _forget_memory()
    assert before - _most_memory() > size / 2
