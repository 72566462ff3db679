"""Files of compiled kernels that are damaged, exchanged or cannot be written never end a run, nor are they executed."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.kernels.common import jit

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("compiler")

DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda content: content[:-100],
    "empty": lambda _: b"",
    "zeros": lambda content: bytes(len(content)),
    "bit": lambda content: content[:-2000] + bytes([content[-2000] ^ 1]) + content[-1999:],
}


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep what is compiled in a folder of this test's own."""
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path / "kernels")
    jit._tell_damage.cache_clear()
    jit._tell_others.cache_clear()
    return tmp_path / "kernels"


def double() -> Any:
    """Return a kernel as a new process has it: without any version."""

    def twice(number: float) -> float:
        return 2 * number

    kernel: Any = jit.entry_kernel(twice)
    return kernel


def loads_and_compilations(kernel: Any) -> tuple[int, int]:
    return sum(kernel.stats.cache_hits.values()), sum(kernel.stats.cache_misses.values())


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_file_is_reported_compiled_anew_and_whole_again(
    kept: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert double()(1.5) == 3.0
    (file,) = files(kept)
    whole = file.read_bytes()
    file.write_bytes(DAMAGE[damage](whole))
    again = double()
    with caplog.at_level(logging.WARNING, "blocksim"):
        assert again(1.5) == 3.0
    assert loads_and_compilations(again) == (0, 1)
    assert [record.getMessage() for record in caplog.records] == [
        f"{kept}: damaged compiled code found; recompiling it (less than a minute) ..."
    ]
    assert files(kept) == [file]
    third = double()
    assert third(1.5) == 3.0
    assert loads_and_compilations(third) == (1, 0)


OTHERS: dict[str, Callable[[Path], None]] = {
    "writable for all": lambda file: file.chmod(0o666),
    "writable for the group": lambda file: file.chmod(0o660),
    "folder writable for all": lambda file: file.parent.chmod(0o777),
}


@pytest.mark.parametrize("others", OTHERS)
def test_file_that_others_may_write_is_not_executed(kept: Path, others: str, caplog: pytest.LogCaptureFixture) -> None:
    assert double()(1.5) == 3.0
    (file,) = files(kept)
    OTHERS[others](file)
    again = double()
    with caplog.at_level(logging.WARNING, "blocksim"):
        assert again(1.5) == 3.0
    assert loads_and_compilations(again) == (0, 1)
    assert [record.getMessage() for record in caplog.records] == [
        f"{kept}: compiled code that other users may write found; recompiling it (less than a minute) ..."
    ]


def test_code_of_another_version_is_not_executed(kept: Path) -> None:
    one: Any = double()
    one(1.5)
    (of_floats,) = files(kept)
    one(2)
    (of_integers,) = set(files(kept)) - {of_floats}
    of_integers.write_bytes(of_floats.read_bytes())  # as two processes left it that wrote one list of files
    again = double()
    assert (again(2), type(again(2))) == (4, int)
    assert loads_and_compilations(again) == (0, 1)


def test_cache_that_cannot_be_written_does_not_end_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path / "file" / "cache")
    assert double()(1.5) == 3.0


def test_full_disk_leaves_no_half_of_a_file(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", fail)
    assert double()(1.5) == 3.0
    assert files(kept) == []


def test_user_without_a_home_folder_can_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(jit, "cache_root", fail)
    assert jit.cache_folder.__wrapped__() is not None


def test_kernel_starts_without_the_blas_that_a_function_of_the_user_still_finds(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("""
import sys
import numba, numpy as np
from blocksim.kernels.common import jit

@jit.entry_kernel
def double(number):
    return 2.0 * number

assert double(1.5) == 3.0
assert "scipy.linalg" not in sys.modules
assert numba.njit(lambda a, b: a @ b)(np.eye(2), np.ones(2)).tolist() == [1.0, 1.0]
assert "scipy.linalg" in sys.modules
""")
    environment = {**os.environ, "BLOCKSIM_CACHE_DIR": str(tmp_path / "cache")}
    subprocess.run([sys.executable, script], check=True, timeout=120, env=environment)
