"""Threads that advance one world together wait here: none leaves before all have arrived.

Every thread runs the same loop over its own share (partition.py) and decides the same, from numbers that are written
only between two meetings; so a meeting is all that threads need to exchange.
"""

import platform
import sys
from typing import Any

from numba import types
from numba.extending import intrinsic

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.compiler import ir

WORD_BYTES = 8
SPINS = 100  # examines the number of meetings, some 2 us, before the core is offered to others
IS_WINDOWS = sys.platform.startswith("win")
HAS_PAUSE = platform.machine().lower() in ("x86_64", "amd64")

# offers the core to another thread
give_way: Any = types.ExternalFunction("SwitchToThread" if IS_WINDOWS else "sched_yield", types.int32())


def _word(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Return the pointer to one word of an array."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.gep(array.data, [arguments[1]])


def _add_one(_: Any, words: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw("add", _word(context, builder, signature, arguments), one, "seq_cst")

    return types.int64(words, types.intp), generate


def _read(_: Any, words: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_word(context, builder, signature, arguments), "seq_cst", WORD_BYTES)

    return types.int64(words, types.intp), generate


def _write(_: Any, words: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store_atomic(arguments[2], _word(context, builder, signature, arguments), "seq_cst", WORD_BYTES)
        return context.get_dummy_value()

    return types.none(words, types.intp, types.int64), generate


def _relax(_: Any) -> Any:
    def generate(context: Any, builder: Any, *_: Any) -> Any:
        if HAS_PAUSE:
            kind = ir.FunctionType(ir.VoidType(), [])
            builder.call(builder.module.declare_intrinsic("llvm.x86.sse2.pause", (), kind), [])
        return context.get_dummy_value()

    return types.none(), generate


# (words, index): add one to a word, as one operation, and return what it was
add_one: Any = intrinsic(_add_one)
# (words, index): a word as other threads have written it
read: Any = intrinsic(_read)
# (words, index, value): write a word, after everything that this thread has written before
write: Any = intrinsic(_write)
# (): tell the processor that this thread only waits, so that one beside it on the same core is faster
relax: Any = intrinsic(_relax)


@jit.rare_kernel
def wait_for_all(team: arrays.Integers) -> None:
    """Wait until as many threads as the team has are here."""
    meeting = read(team, arrays.MEETINGS)
    if add_one(team, arrays.ARRIVED) == team[arrays.TEAM_SIZE] - 1:
        write(team, arrays.ARRIVED, 0)
        write(team, arrays.MEETINGS, meeting + 1)
        return
    spins = 0
    while read(team, arrays.MEETINGS) == meeting:
        spins += 1
        if spins < SPINS:
            relax()
        else:
            give_way()


@jit.kernel
def barrier(team: arrays.Integers) -> None:
    """Wait for the others of the team, if there are any."""
    if team[arrays.TEAM_SIZE] > 1:
        wait_for_all(team)
