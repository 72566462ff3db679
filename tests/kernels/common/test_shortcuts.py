"""Shortcuts through numba give the same code, and are left again."""

from typing import Any

import pytest
from numba import types
from numba.core import funcdesc
from numba.core.types import abstract, functions

from blocksim.kernels.common.compiler import shortcuts
from blocksim.kernels.common.jit import config, njit


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
