"""The cache of compiled kernels: never stale, reused, not needed, and no file of it that is damaged is executed."""

import logging
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from numba.core import funcdesc
from numba.core.types import abstract, functions

from blocksim.kernels.common import jit
from blocksim.kernels.common.arrays import PAIR, Record, zeros
from blocksim.kernels.common.compiler import INNER, InnerLibrary, shortcuts

PACKAGE = Path(jit.__file__).parents[2]


@pytest.fixture
def copied_kernels(tmp_path: Path) -> Path:
    """Return a folder with a copy of the kernels that a test may edit."""
    folder = tmp_path / "copy"
    (folder / "blocksim").mkdir(parents=True)
    (folder / "blocksim" / "__init__.py").touch()
    shutil.copytree(PACKAGE / "kernels", folder / "blocksim" / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.fixture
def fresh_folder_choice() -> Iterator[None]:
    """Forget the chosen cache folder before and after a test."""
    jit.cache_folder.cache_clear()
    yield
    jit.cache_folder.cache_clear()


REFUSED: dict[str, tuple[int, int]] = {
    "group": (0o770, 0o755),
    "all, sticky": (0o1777, 0o755),
    "all, a folder above": (0o700, 0o777),
    "another user": (0o700, 0o755),
}


@pytest.fixture
def chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Choose a cache folder, inside another one; the temporary folder is there as well."""
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(tmp_path / "above" / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)  # a worker process tells nothing
    (tmp_path / "above" / "cache").mkdir(parents=True)
    return tmp_path / "above" / "cache"


@pytest.mark.usefixtures("fresh_folder_choice")
@pytest.mark.parametrize("whose", REFUSED)
def test_cache_folder_that_others_may_write_is_refused_with_a_line(
    chosen: Path, whose: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(jit, "_is_group_of_one", lambda _: False)
    for folder, mode in zip((chosen, chosen.parent), REFUSED[whose], strict=True):
        folder.chmod(mode)
    instead, other = f"kept in {tempfile.gettempdir()}", os.getuid() + 1
    if whose == "another user":
        instead = "not kept"
        monkeypatch.setattr(os, "getuid", lambda: other)
    with caplog.at_level(logging.WARNING, "blocksim"):
        found = jit.cache_folder()
    assert (found is None) == (whose == "another user")
    assert found is None or found.is_relative_to(tempfile.gettempdir())
    assert list(chosen.iterdir()) == []
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith(f"{chosen}: other users may write ")
    assert f"; compiled kernels are {instead}" in line


@pytest.mark.usefixtures("fresh_folder_choice")
@pytest.mark.parametrize("way", ["sticky folder above", "link"])
def test_cache_folder_that_only_this_user_may_write_serves(
    chosen: Path, way: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    if way == "link":
        (chosen.parent.parent / "link").symlink_to(chosen.parent)
        monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(chosen.parent.parent / "link" / "cache"))
    else:
        chosen.parent.chmod(0o1777)
    assert jit.cache_folder() == chosen / jit.source_hash()
    assert caplog.records == []


def test_compiled_code_of_another_user_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "source" / "module" / "code.nbc"
    jit._write(file, b"code")
    assert jit._read(file) == b"code"
    fstat, other = os.fstat, os.getuid() + 1

    def of_another(number: int) -> os.stat_result:
        state = fstat(number)
        return os.stat_result((*state[:4], other, *state[5:]))

    monkeypatch.setattr(os, "fstat", of_another)
    assert jit._read(file) is None


@pytest.mark.usefixtures("fresh_folder_choice", "compiler")
def test_without_a_writable_folder_the_temporary_one_serves_and_without_that_kernels_are_compiled_and_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    file_in_the_way = tmp_path / "file" / "cache"  # below which nobody can write, not even root
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(file_in_the_way))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    folder = jit.cache_folder()
    assert folder is not None
    assert folder.is_relative_to(tmp_path / "temporary")
    assert folder.name == jit.source_hash()
    jit.cache_folder.cache_clear()
    monkeypatch.setattr(tempfile, "tempdir", str(file_in_the_way))
    assert jit.cache_folder() is None
    assert not jit.is_compiled()
    jit.mark("seen")
    assert not jit.is_marked("seen")
    assert double()(3.0) == 6.0


def test_cache_is_where_the_desktop_keeps_caches_unless_told_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BLOCKSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert jit.cache_root() == Path("/somewhere/blocksim")


def test_hash_sees_every_source_below_the_folder(copied_kernels: Path) -> None:
    folder = copied_kernels / "blocksim" / "kernels"
    assert jit.source_hash(folder) == jit.source_hash()
    seen = {jit.source_hash(folder)}
    deepest = folder / "explicit" / "models" / "smoothed.py"
    for path in (folder / "common" / "shapes.py", deepest):
        path.write_text(path.read_text() + "# edited\n")
        seen.add(jit.source_hash(folder))
    deepest.rename(deepest.with_name("smooth.py"))
    seen.add(jit.source_hash(folder))
    assert len(seen) == 4


@pytest.mark.usefixtures("fresh_folder_choice", "compiler")
def test_marks_and_compiled_kernels_are_found_for_this_source_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(tmp_path))
    below = tmp_path / jit.source_hash() / "kernels"
    assert not jit.is_marked("seen")
    assert not jit.is_compiled()
    jit.mark("seen")
    below.mkdir(parents=True)
    (below / "step.advance_alone-1.py311.1.nbc").touch()
    assert jit.is_marked("seen")
    assert jit.is_compiled()
    assert not jit.is_marked("unseen")
    monkeypatch.setattr(jit, "source_hash", lambda: "another")
    jit.cache_folder.cache_clear()
    assert not jit.is_marked("seen")
    assert not jit.is_compiled()


@pytest.mark.usefixtures("compiler")
def test_kernel_is_compiled_once_whatever_integers_it_is_called_with(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: None)

    @jit.rare_kernel
    def twice(number: int) -> int:
        return 2 * number

    @jit.entry_kernel
    def add_up(pair: Record) -> int:
        return twice(3) + twice(pair.a) + twice(pair.near) + twice(pair.axis)

    pair = zeros(1, PAIR)[0]
    pair.a, pair.near, pair.axis = 4_000_000_000, 60_000, 200
    assert add_up(pair) == 2 * (3 + 4_000_000_000 + 60_000 + 200)
    assert [str(one) for (one,) in twice.overloads] == ["int64"]  # type: ignore[attr-defined]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda content: content[:-100],
    "bit": lambda content: content[:-2000] + bytes([content[-2000] ^ 1]) + content[-1999:],
}
OTHERS: dict[str, Callable[[Path], None]] = {
    "writable for all": lambda file: file.chmod(0o666),
    "folder writable for all": lambda file: file.parent.chmod(0o777),
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

    return jit.entry_kernel(twice)


def loads_and_compilations(kernel: Any) -> tuple[int, int]:
    return sum(kernel.stats.cache_hits.values()), sum(kernel.stats.cache_misses.values())


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("wrong", [*DAMAGE, *OTHERS])
def test_file_that_is_damaged_or_that_others_may_write_is_reported_and_compiled_anew(
    kept: Path, wrong: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert double()(1.5) == 3.0
    (file,) = files(kept)
    if wrong in DAMAGE:
        file.write_bytes(DAMAGE[wrong](file.read_bytes()))
    else:
        OTHERS[wrong](file)
    again = double()
    with caplog.at_level(logging.WARNING, "blocksim"):
        assert again(1.5) == 3.0
    assert loads_and_compilations(again) == (0, 1)
    what = "damaged compiled code" if wrong in DAMAGE else "compiled code that other users may write"
    told = f"{kept}: {what} found; recompiling it (less than a minute) ..."
    assert [record.getMessage() for record in caplog.records] == [told]
    assert files(kept) == [file]
    if wrong in DAMAGE:  # and it is whole again
        third = double()
        assert third(1.5) == 3.0
        assert loads_and_compilations(third) == (1, 0)


@pytest.mark.usefixtures("compiler")
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


@pytest.mark.usefixtures("compiler")
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


def chain() -> tuple[Any, Any, Any]:
    """Return kernels as a new process has them: two and the one that calls them."""

    @jit.kernel
    def square(number: float) -> float:
        return number * number

    @jit.rare_kernel
    def successor(number: float) -> float:
        return number + 1.0

    @jit.entry_kernel
    def two(number: float) -> float:
        return square(number) + square(successor(number))

    return square, successor, two


def library_of(kernel: Any) -> Any:
    (compiled,) = kernel.overloads.values()
    return compiled.library


@pytest.mark.usefixtures("compiler")
def test_inner_kernels_are_kept_without_machine_code_and_serve_callers_of_later_processes(kept: Path) -> None:
    square, successor, two = chain()
    assert two(3.0) == 25.0
    for kernel in (square, successor):
        library = library_of(kernel)
        assert isinstance(library, InnerLibrary)
        assert library.serialize_using_object_code()[1] == INNER
        assert not library.codegen._engine.is_symbol_defined(kernel.overloads.popitem()[1].fndesc.mangled_name)
    for file in kept.rglob("*two*"):
        file.unlink()
    square, successor, two = chain()
    assert two(3.0) == 25.0
    assert [loads_and_compilations(kernel)[0] for kernel in (square, successor, two)] == [1, 1, 0]


@pytest.mark.usefixtures("compiler", "kept")
def test_inner_kernel_that_python_calls_is_compiled_and_kept_for_that_beside_what_its_callers_need() -> None:
    square, _, two = chain()
    assert (square(3.0), two(3.0), square(number=4.0)) == (9.0, 25.0, 16.0)
    assert isinstance(library_of(square), InnerLibrary)
    assert not isinstance(library_of(square.for_python), InnerLibrary)
    square, _, _ = chain()
    assert square(3.0) == 9.0
    assert loads_and_compilations(square.for_python) == (1, 0)
    assert not square.overloads, "its callers' version has been loaded for nothing"


def fail_in_shortcuts() -> None:
    with shortcuts():
        raise OSError("no room on the disk")


@pytest.mark.usefixtures("compiler")
def test_numba_is_as_before_after_shortcuts_even_where_compiling_fails() -> None:
    kinds, calls = abstract.Type, functions.BaseFunction
    before = (kinds.__hash__, calls.get_call_type, funcdesc.default_mangler)
    with shortcuts():
        assert kinds.__hash__ is not before[0]
    with pytest.raises(OSError, match="no room"):
        fail_in_shortcuts()
    assert before == (kinds.__hash__, calls.get_call_type, funcdesc.default_mangler)


ROOT = Path(__file__).parents[3]
RUN = """
import sys, blocksim
from blocksim.kernels.common import compiler
for name in ("three_blocks", "three_blocks_nonsmooth"):
    scenario = blocksim.load(f"scenarios/{name}.toml", {"contact.stiffness_scale": 0.001, "time.end": 0.2})
    print(blocksim.run(scenario).summary.final_state_sha256)
print(compiler.PLAIN)
"""


def answer(**environment: str) -> list[str]:
    """Return what a process prints."""
    command, more = [sys.executable, "-c", RUN], {**os.environ, **environment}
    return subprocess.run(command, cwd=ROOT, env=more, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.long
def test_plain_numba_gives_the_same_bits(tmp_path: Path) -> None:
    plain = answer(BLOCKSIM_PLAIN_NUMBA="1", BLOCKSIM_CACHE_DIR=str(tmp_path))
    usual = answer(BLOCKSIM_PLAIN_NUMBA="0")
    assert [*plain[:2], plain[2], usual[2]] == [*usual[:2], "True", "False"]
    assert any(tmp_path.rglob("*.nbi"))  # the next run finds them
