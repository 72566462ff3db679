"""Shortcuts through numba while many kernels are compiled: the same code, in less time.

Most of the time numba and llvmlite compute what they have computed before: how an operator acts on two numbers, the
hash of a type with hundreds of fields, the size of a structure. And names of functions spell out the types of all
arguments, 20 kB each for a scene, in every module that calls them: here they have a digest of that.

This uses private parts of numba, so pyproject.toml names the versions that it was tried with.
"""

import contextlib
import functools
import hashlib
from collections.abc import Callable, Iterator
from typing import Any

from llvmlite import binding
from numba.core import base, event, funcdesc, itanium_mangler, targetconfig
from numba.core.types import abstract, functions

mangling: Any = itanium_mangler  # these come without type hints
options: Any = targetconfig.ConfigStack

NAME_DIGITS = 24


def _no_timer(*_: Any) -> Any:
    """Stand for a timer, of which numba installs one more for every level of calls."""
    return contextlib.nullcontext()


def _short_name(name: str, kinds: Any, *, abi_tags: Any = (), uid: Any = None) -> str:
    """Return the name of a compiled function, with a digest of the types of its arguments."""
    spelled = ",".join(str(kind) for kind in kinds)
    digest = hashlib.sha256(spelled.encode()).hexdigest()[:NAME_DIGITS]
    return str(mangling.mangle(name, (f"t{digest}",), abi_tags=abi_tags, uid=uid))


def _known_hashes(original: Callable[[Any], int]) -> Callable[[Any], int]:
    """Return how types are hashed, each once."""
    known: dict[int, tuple[int, Any]] = {}

    def hashed(kind: Any) -> int:
        found = known.get(id(kind))
        if found is None:
            found = known[id(kind)] = (original(kind), kind)  # which keeps it, and its address
        return found[0]

    return hashed


def _known_calls(original: Callable[..., Any]) -> Callable[..., Any]:
    """Return how calls of operators and functions of numba are resolved, each once."""
    known: dict[Any, Any] = {}

    def resolved(function: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return original(function, context, args, kws)
        key = (id(function), id(context), tuple(args), options.top_or_none())
        found = known.get(key)
        if found is None:
            found = known[key] = (original(function, context, args, kws), function, context)
        return found[0]

    return resolved


def _known_sizes(original: Callable[..., int]) -> Callable[..., int]:
    """Return how sizes of structures are found, each once: llvmlite has a module parsed for every question."""
    known: dict[tuple[int, str], int] = {}

    def size(context: Any, kind: Any) -> int:
        key = (id(context), str(kind))
        if key not in known:
            known[key] = original(context, kind)
        return known[key]

    return size


def _same_flags(one: Any, other: Any) -> Any:
    """Return True if two sets of options are the same."""
    if type(one) is not type(other):
        return NotImplemented
    return one._values == other._values or one.values() == other.values()  # noqa: SLF001


def _replacements() -> list[tuple[Any, str, Any]]:
    calls: Any = functions.BaseFunction
    kinds: Any = abstract.Type
    context: Any = base.BaseContext
    flags: Any = targetconfig.TargetConfig
    return [
        (event, "install_timer", _no_timer),
        (funcdesc, "default_mangler", _short_name),
        (kinds, "__hash__", _known_hashes(kinds.__hash__)),
        (calls, "get_call_type", _known_calls(calls.get_call_type)),
        (context, "get_abi_sizeof", _known_sizes(context.get_abi_sizeof)),
        (flags, "__eq__", _same_flags),
        (flags, "__hash__", lambda _: 0),  # there are but a few
        (binding, "get_process_triple", functools.cache(binding.get_process_triple)),
        (binding, "get_host_cpu_name", functools.cache(binding.get_host_cpu_name)),
    ]


@contextlib.contextmanager
def shortcuts() -> Iterator[None]:
    """Take all shortcuts."""
    with contextlib.ExitStack() as stack:
        for owner, name, other in _replacements():
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, other)
        yield
