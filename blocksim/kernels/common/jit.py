"""The one place that decides how kernels are compiled and where the machine code is kept.

numba's disk cache looks only at the file of the cached function itself: after an edit of a law in another file the
old physics would run silently. Here the cache folder is named by a hash of *all* kernel sources and of the numba,
llvmlite and numpy versions, so any edit of any kernel file starts an empty cache.
"""

import contextlib
import functools
import hashlib
import logging
import multiprocessing
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import llvmlite
import numba
import numpy as np
from numba import config as numba_config
from numba import types as numba_types
from numba.core.registry import CPUDispatcher

from blocksim.kernels.common.cache import KernelCache
from blocksim.kernels.common.compiler import InnerCompiler, LeanCompiler
from blocksim.kernels.common.ownership import trouble_with

Function = TypeVar("Function", bound=Callable[..., object])

# IEEE arithmetic as written (no fastmath: the same input gives the same bits) and division by zero as in IEEE (no
# exception can leave a kernel). Nothing allocates, so reference counts of arrays, two atomic operations an array and
# call, are switched off; together with inlining of the hot path that made a step five times faster than the defaults.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}

config: Any = numba_config  # its settings are attributes made at run time
types: Any = numba_types
njit: Any = numba.njit  # _nrt is an option that its types leave out

log = logging.getLogger("blocksim")

KERNEL_FOLDER = Path(__file__).resolve().parents[1]


def source_hash(folder: Path = KERNEL_FOLDER) -> str:
    """Return a hash of every Python source below `folder`, with the versions of what compiles it."""
    versions = f"numba {numba.__version__} llvmlite {llvmlite.__version__} numpy {np.__version__}"
    digest = hashlib.sha256(versions.encode())
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Return the folder for compiled kernels: `BLOCKSIM_CACHE_DIR`, else the user's cache folder."""
    chosen = os.environ.get("BLOCKSIM_CACHE_DIR")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "blocksim"


def _cache_roots() -> Iterator[Path]:
    with contextlib.suppress(RuntimeError):  # an unknown user without HOME has no folder
        yield cache_root()
    with contextlib.suppress(OSError):  # there may be no folder for temporary files either
        yield Path(tempfile.gettempdir()) / f"blocksim-{os.getuid() if hasattr(os, 'getuid') else 'user'}"


@functools.cache
def cache_folder() -> Path | None:
    """Return the cache folder of this exact source, or None where nothing can be kept."""
    troubles: list[str] = []
    for root in _cache_roots():
        with contextlib.suppress(OSError):
            folder, trouble = _made(root)
            if not trouble:
                _tell_refusal(next(iter(troubles), ""), f"kept in {root}")
                return folder
            troubles.append(trouble)
    _tell_refusal(next(iter(troubles), ""), "not kept, and every run compiles them")
    return None


def _made(root: Path) -> tuple[Path, str]:
    """Return the folder of this source below a root, and why others could write to it; raises OSError.

    The path has no links: they may lead elsewhere tomorrow.
    """
    folder = root
    for folder in (root, root / source_hash()):
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        if trouble := trouble_with(folder):
            return folder, trouble
        with tempfile.TemporaryFile(dir=folder):  # raises where nothing can be written
            pass
    return folder.resolve(), ""


def _tell_refusal(trouble: str, instead: str) -> None:
    """Report why the folder that was asked for does not serve, unless the process that began this one has."""
    if trouble and multiprocessing.parent_process() is None:
        log.warning("%s; compiled kernels are %s", trouble, instead)


def is_compiled() -> bool:
    """Return True if a compiled time loop of this exact source lies in the cache (or nothing has to be compiled)."""
    folder = cache_folder()
    return bool(config.DISABLE_JIT) or (folder is not None and any(folder.rglob("step.advance_alone-*.nbc")))


def is_marked(name: str) -> bool:
    """Return True if `mark` has been called with this name for this exact source."""
    folder = cache_folder()
    return bool(config.DISABLE_JIT) or (folder is not None and (folder / name).is_file())


def mark(name: str) -> None:
    """Note beside the compiled kernels that something is among them; where nothing can be kept, do nothing."""
    folder = cache_folder()
    if folder is not None and not config.DISABLE_JIT:
        with contextlib.suppress(OSError):
            (folder / name).touch()


def _compiled(function: Function, kind: str, **options: object) -> Function:
    """Compile a function; `kind` tells apart on the disk what is compiled from it in several ways."""
    compiled: Any = njit(**OPTIONS, **options)(function)
    folder = cache_folder()
    if folder is not None and not config.DISABLE_JIT:
        with contextlib.suppress(OSError):  # a function without a source file
            stamp = (kind, _stamp(function))
            compiled._cache = KernelCache(function, folder, stamp)  # noqa: SLF001 - as enable_caching does
    wrapped: Function = compiled
    return wrapped


def _stamp(function: Callable[..., object]) -> object:
    """Return what identifies the source of a function; of those here the folder's name does. Raises OSError."""
    source = Path(function.__code__.co_filename)
    if source.is_relative_to(KERNEL_FOLDER):
        return None
    state = source.stat()
    return str(source), state.st_mtime_ns, state.st_size


def plain_type(one: Any) -> Any:
    """Return the type that a number is passed as: constants and short integers as integers of 8 bytes."""
    one = types.unliteral(one)
    is_short = isinstance(one, types.Integer) and one.bitwidth < types.int64.bitwidth
    return types.int64 if is_short else one


class _Inner(CPUDispatcher):
    """A function compiled once for all kernels that call it; their machine code has it, and it has none of its own.

    numba would compile it again for every constant, and every width of integer, that it is called with: nearly half of
    all code. Where Python calls one as well, as tests do, it is compiled for that then.
    """

    choices: dict[str, Any]  # the options that the compiler was given

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Look for the compiled version that serves a call, and have it compiled where there is none."""
        named = {name: plain_type(one) for name, one in kws.items()}
        return super().get_call_template(tuple(plain_type(one) for one in args), named)

    @functools.cached_property
    def for_python(self) -> Any:
        """Return the function as Python calls it, with machine code."""
        return _compiled(self.py_func, "entry", **self.choices)

    def __call__(self, *args: Any, **kws: Any) -> Any:
        """Call the function from Python."""
        return self.for_python(*args, **kws)


def _inner(function: Function, **options: object) -> Function:
    """Compile a function that kernels call."""
    if config.DISABLE_JIT:
        return function
    compiler = LeanCompiler if Path(function.__code__.co_filename).is_relative_to(KERNEL_FOLDER) else InnerCompiler
    compiled: Any = _compiled(function, "inner", **options, no_cpython_wrapper=True, pipeline_class=compiler)
    compiled.__class__ = _Inner
    compiled.choices = options
    inner: Function = compiled
    return inner


def kernel(function: Function) -> Function:
    """Compile a function of the hot path: inlined where it is called, cached on disk by the hash of all sources."""
    return _inner(function, forceinline=True)


def rare_kernel(function: Function) -> Function:
    """Compile a function that most steps do not call; kept out of the hot path, which it would only lengthen."""
    return _inner(function, forceinline=False)  # said here, as numba would take it over from the first caller


def entry_kernel(function: Function) -> Function:
    """Compile a function that Python calls; other threads can run meanwhile."""
    return _compiled(function, "entry", nogil=True)
