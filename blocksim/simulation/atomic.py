"""Small files that are either there and whole, or not there."""

import contextlib
import errno
import fcntl
import hashlib
import os
import re
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from blocksim.errors import OutputError

DIGITS = 8  # in the names of files that are being written
PERMISSIONS = 0o666  # of new files, less what the umask takes away
NO_SUCH_SYNC = {errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM}  # file systems that cannot do it to folders


@contextlib.contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a name beside a file, with its suffix, to write to; in the end the new file takes the place of the old one.

    It has the permissions of the old one, else those that the user's umask leaves. What a writer of the same file left
    half written when it was killed goes. Raises OutputError when writing fails; whatever happens on the way, the old
    file stays and nothing else is left.
    """
    temporary: Path | None = None
    handle = -1
    try:
        _remove_leftovers(path)
        while temporary is None:  # not `tempfile`, which takes away what the umask would leave, and defaults of folders
            name = path.with_name(f".{path.name}.{secrets.token_hex(DIGITS // 2)}{path.suffix}")
            handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL, PERMISSIONS)
            with contextlib.suppress(OSError):  # file systems without locks
                fcntl.flock(handle, fcntl.LOCK_EX)  # so that others see that the writer lives
            if name.exists():
                temporary = name
            else:
                os.close(handle)  # taken for a leftover before it was locked
        old = permissions_of(path)
        mode = stat.S_IMODE(os.fstat(handle).st_mode) if old is None else old
        if old is not None:
            with contextlib.suppress(OSError):  # a group that one is not in
                os.fchown(handle, -1, path.stat().st_gid)
            os.fchmod(handle, old | stat.S_IWUSR)  # before it holds anything
        yield temporary
        temporary.chmod(mode)
        temporary.replace(path)
        try:  # a file whose name is not on the disk is lost when the power fails
            sync_file(path.parent)
        except OSError as error:
            if error.errno not in NO_SUCH_SYNC:
                raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            os.close(handle)  # only now: with it goes the lock


def permissions_of(path: Path) -> int | None:
    """Return the permissions of a file, None where there is none, or a link."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return None
    return stat.S_IMODE(mode) if stat.S_ISREG(mode) else None


def _remove_leftovers(path: Path) -> None:
    """Remove what was half written of a file by those that do not live any more; where files have no locks, nothing."""
    form = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{{DIGITS}}}{re.escape(path.suffix)}")
    with os.scandir(path.parent) as entries:
        leftovers = [entry.path for entry in entries if form.fullmatch(entry.name)]
    for leftover in leftovers:
        with contextlib.suppress(OSError):  # its writer lives, or it has gone
            handle = os.open(leftover, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.unlink(leftover)  # noqa: PTH108 - a name from scandir
            finally:
                os.close(handle)


def sync_file(path: Path) -> None:
    """Wait until what was written to a file is on the disk, where it outlives a power failure. Raises OSError."""
    if os.name != "posix":  # elsewhere that takes a file that is open for writing
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Give a file that takes the place of `path` at the end, when it is on the disk. Raises what `replacing` raises."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file through a temporary one beside it; raises OutputError and leaves nothing behind when that fails."""
    with atomic_file(path) as file:
        file.write(content)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `write_bytes` does."""
    write_bytes(path, text.encode())


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
