"""The one place that decides how kernels are compiled and where the machine code is kept.

numba's disk cache looks only at the file of the cached function itself: after an edit of a law in another file the
old physics would run silently. Here the cache folder is named by a hash of *all* kernel sources and of the numba,
llvmlite and numpy versions, so any edit of any kernel file starts an empty cache.

The files in which compiled kernels are kept: each with its checksum, verified before anything in it is executed.

numba's own cache trusts its files: a flipped byte of machine code kills the process, and one that was cut off, as after
a power failure, ends every run until somebody removes it. It also keeps a list of files for each function, and two
processes that add to one at the same time may leave a list that names the code of another version. Here every version
of a function has a file of its own, named after what it was compiled for and holding that as well. A file that is not
whole, or that another user may have written, is reported; what it held is compiled again and replaces it.

Who may change what is kept on the disk: compiled kernels are executed, so only this user may have written them.

Systems without owners, such as Windows, keep a user's cache in a folder of that user; nothing is looked at there.
"""

import contextlib
import functools
import hashlib
import logging
import multiprocessing
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import config as numba_config, types as numba_types

from blocksim.kernels.common.compiler import (
    PLAIN,
    VERSIONS,
    CPUDispatcher,
    FunctionCache,
    InnerCompiler,
    LeanCompiler,
    dumps,
    import_array_functions,
    rebuilt,
)

HAS_OWNERS = hasattr(os, "getuid")
UNMAPPED = 65534  # owner of what lies outside a container, whoever that is there
"""What Linux tells as the owner of files whose owner has no number in a user namespace."""


def is_own(state: os.stat_result) -> bool:
    """Return True if a file or folder belongs to this user, and no other may write to it."""
    return not HAS_OWNERS or (state.st_uid == os.getuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def trouble_with(folder: Path) -> str:
    """Return why others could put something of theirs into a folder, or another one in its place; else nothing.

    A sticky folder on the way, as /tmp is, keeps others from renaming what is in it. Raises OSError.
    """
    if not HAS_OWNERS:
        return ""
    folder = folder.resolve()
    if not is_own(folder.stat()):
        return f"{folder}: other users may write there"
    for parent in folder.parents:
        state = parent.stat()
        if state.st_uid not in {os.getuid(), 0, UNMAPPED} or (
            _others_write(state) and not state.st_mode & stat.S_ISVTX
        ):
            return f"{folder}: other users may write to {parent}"
    return ""


def _others_write(state: os.stat_result) -> bool:
    if state.st_mode & stat.S_IWOTH:
        return True
    return bool(state.st_mode & stat.S_IWGRP) and not _is_group_of_one(state.st_gid)


def _is_group_of_one(number: int) -> bool:
    """Return True for the group that many systems give each user, with nobody else in it."""
    import grp  # noqa: PLC0415 - not there without owners
    import pwd  # noqa: PLC0415 - not on Windows

    with contextlib.suppress(KeyError):
        user, group = pwd.getpwuid(os.getuid()), grp.getgrgid(number)
        return number == user.pw_gid != 0 and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
    return False


DIGEST_BYTES = hashlib.sha256().digest_size
NAME_DIGITS = 16
SUFFIX = ".nbc"


class KernelCache(FunctionCache):  # type: ignore[misc]  # Any
    """What numba asks for compiled versions of one function, and gives them to."""

    def __init__(self, function: Callable[..., object], folder: Path, stamp: object) -> None:
        """Keep them below a folder; they are valid for this `stamp` of all that the bytecode does not say."""
        self._py_func = function
        self.stamp = stamp
        code = function.__code__
        self.folder = folder / function.__module__
        where = f"{Path(code.co_filename).stem}.{function.__qualname__}-{code.co_firstlineno}"
        self.name = f"{where.replace('<', '').replace('>', '')}.py{sys.version_info[0]}{sys.version_info[1]}"
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self.folder)

    def flush(self) -> None:
        """Forget all versions."""
        with contextlib.suppress(OSError):
            for path in self.folder.glob(f"{self.name}.*{SUFFIX}"):
                path.unlink(missing_ok=True)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled version for a signature, None where there is none that is whole."""
        import_array_functions()
        target_context.refresh()
        key = self._key(sig, target_context.codegen())
        content = _read(self._path(key))
        if not self._enabled or content is None:
            return None
        found, parts = pickle.loads(content)  # noqa: S301 - our own, by its checksum, in a folder of this user
        return rebuilt(target_context, parts) if found == key else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled version; where there is no room, do nothing."""
        if not self._enabled or data.library.has_dynamic_globals or any(not one.can_cache for one in data.lifted):
            return
        key = self._key(sig, data.codegen)
        content = dumps((key, data._reduce()))  # noqa: SLF001 - as numba does
        with contextlib.suppress(OSError):
            _write(self._path(key), content)

    def _key(self, sig: Any, codegen: Any) -> tuple[object, ...]:
        """Return what a version is compiled for: types, processor, bytecode; and all other sources."""
        index_key: Any = self._index_key
        return (self.stamp, *_sources(sig), *index_key(sig, codegen))

    def _path(self, key: tuple[object, ...]) -> Path:
        digest = hashlib.sha256(repr(key).encode()).hexdigest()[:NAME_DIGITS]
        return self.folder / f"{self.name}.{digest}{SUFFIX}"


def _sources(sig: Any) -> Iterator[tuple[str, int, int]]:
    """Yield file, time and size of what declares systems outside the package: their kernels are compiled in here."""
    for one in sorted({one.__module__ for one in _named_tuples(sig) if not one.__module__.startswith("blocksim.")}):
        source = Path(sys.modules[one].__file__ or "")
        state = source.stat()
        yield str(source), state.st_mtime_ns, state.st_size


def _named_tuples(kinds: Any) -> Iterator[type]:
    """Yield the classes of all named tuples among types of arguments, and inside them."""
    for kind in kinds:
        if isinstance(kind, types.BaseNamedTuple):
            yield kind.instance_class
        if isinstance(kind, types.BaseTuple):
            yield from _named_tuples(kind.types)


def _read(path: Path) -> bytes | None:
    """Return what a file holds, None where there is none, or none that is whole."""
    try:
        with path.open("rb") as file:
            if not (is_own(path.parent.stat()) and is_own(os.fstat(file.fileno()))):
                _tell_others(path.parents[1])
                return None
            stored = file.read()
    except FileNotFoundError:
        return None
    except OSError:
        stored = b""
    content = stored[DIGEST_BYTES:]
    if stored[:DIGEST_BYTES] == hashlib.sha256(content).digest():
        return content
    _tell_damage(path.parents[1])
    return None


def _write(path: Path, content: bytes) -> None:
    """Write a file with its checksum, which gets its name when it is whole. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f"{path.name}.tmp.", delete=False) as file:
        temporary = Path(file.name)
        try:
            file.write(hashlib.sha256(content).digest())
            file.write(content)
            file.flush()
            temporary.replace(path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise


@functools.cache
def _tell_others(folder: Path) -> None:
    """Report files that others may have written, once a process."""
    log.warning("%s: compiled code that other users may write found; recompiling it (less than a minute) ...", folder)


@functools.cache
def _tell_damage(folder: Path) -> None:
    """Report damage, once a process."""
    log.warning("%s: damaged compiled code found; recompiling it (less than a minute) ...", folder)


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
    digest = hashlib.sha256(f"{VERSIONS}{' plain' * PLAIN}".encode())
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
    folder = cache_folder()
    if PLAIN:  # with numba's own cache, in the folder of exactly these sources
        config.CACHE_DIR = str(folder or "")
        plain: Function = njit(**OPTIONS, **options, cache=folder is not None)(function)
        return plain
    compiled: Any = njit(**OPTIONS, **options)(function)
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


class _Inner(CPUDispatcher):  # type: ignore[misc]  # Any
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
    if PLAIN:
        return _compiled(function, "inner", **options)
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
