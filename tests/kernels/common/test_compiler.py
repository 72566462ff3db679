"""Inner kernels have no machine code of their own, and shortcuts through numba give the same code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from numba import types
from numba.core import funcdesc
from numba.core.types import abstract, functions

from blocksim.kernels.common import jit
from blocksim.kernels.common.compiler import INNER, InnerLibrary, shortcuts
from blocksim.kernels.common.jit import config, njit

if TYPE_CHECKING:
    from pathlib import Path


pytestmark = pytest.mark.usefixtures("compiler")


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep what is compiled in a folder of this test's own."""
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    return tmp_path


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


def loads(kernel: Any) -> int:
    return sum(kernel.stats.cache_hits.values())


def library_of(kernel: Any) -> Any:
    (compiled,) = kernel.overloads.values()
    return compiled.library


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
    assert (loads(square), loads(successor), loads(two)) == (1, 1, 0)


@pytest.mark.usefixtures("kept")
def test_inner_kernel_that_python_calls_is_compiled_and_kept_for_that_beside_what_its_callers_need() -> None:
    square, _, two = chain()
    assert (square(3.0), two(3.0), square(number=4.0)) == (9.0, 25.0, 16.0)
    assert isinstance(library_of(square), InnerLibrary)
    assert not isinstance(library_of(square.for_python), InnerLibrary)
    square, _, _ = chain()
    assert square(3.0) == 9.0
    assert loads(square.for_python) == 1
    assert not square.overloads, "its callers' version has been loaded for nothing"


def fail_in_shortcuts() -> None:
    with shortcuts():
        raise OSError("no room on the disk")


def test_numba_is_as_before_after_shortcuts_even_where_compiling_fails() -> None:
    kinds, calls = abstract.Type, functions.BaseFunction
    before = (kinds.__hash__, calls.get_call_type, funcdesc.default_mangler)
    with shortcuts():
        assert kinds.__hash__ is not before[0]
    with pytest.raises(OSError, match="no room"):
        fail_in_shortcuts()
    assert before == (kinds.__hash__, calls.get_call_type, funcdesc.default_mangler)


def test_names_are_short_and_those_of_other_types_differ() -> None:
    records = [
        types.Array(types.Record([(name, {"type": types.float64, "offset": 0})], 8, False), 1, "C") for name in "ab"
    ]
    with shortcuts():
        mangled: Any = funcdesc.default_mangler
        names = {mangled("one.two", (kind,), abi_tags=("c8",), uid=3) for kind in records}
        names |= {mangled("one.two", (records[0],), abi_tags=("c8",), uid=uid) for uid in (3, 4)}
    assert len(names) == 3
    assert all(len(name) < 60 for name in names)


@pytest.mark.skipif(config.DISABLE_JIT, reason="is about the compiler")
def test_operators_are_resolved_anew_for_other_types() -> None:
    def twice(x: float) -> float:
        return x + x

    with shortcuts():
        doubled = njit(twice)
        assert [type(doubled(x)) for x in (1, 1.0, 1j)] == [int, float, complex]
