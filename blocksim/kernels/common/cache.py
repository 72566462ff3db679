"""The files in which compiled kernels are kept: each with its checksum, verified before anything in it is executed.

numba's own cache trusts its files: a flipped byte of machine code kills the process, and one that was cut off, as after
a power failure, ends every run until somebody removes it. It also keeps a list of files for each function, and two
processes that add to one at the same time may leave a list that names the code of another version. Here every version
of a function has a file of its own, named after what it was compiled for and holding that as well. A file that is not
whole, or that another user may have written, is reported; what it held is compiled again and replaces it.
"""

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba import types as numba_types
from numba.core import serialize
from numba.core.caching import FunctionCache

from blocksim.kernels.common.compiler import rebuilt
from blocksim.kernels.common.ownership import is_own

DIGEST_BYTES = hashlib.sha256().digest_size
NAME_DIGITS = 16
SUFFIX = ".nbc"

types: Any = numba_types
dumps: Any = serialize.dumps  # comes without type hints

log = logging.getLogger("blocksim")  # a line on standard error, unless somebody wants it elsewhere


class KernelCache(FunctionCache):
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
