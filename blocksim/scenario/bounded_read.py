"""Files that others may have made: regular files only, read up to a size.

A pipe or a device may never end, a file of any size must not take all memory, and a link in a result folder may lead to
a private file. A link that the user names (`links=True`) is followed.
"""

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from blocksim.errors import InputMissingError, InvalidInputError

MEGABYTE = 1_000_000
IS_LINK = "a link; links in result folders are not followed"
KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe; save its content in a file first"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


class NoSuchFileError(InputMissingError):
    """Nothing of this name exists."""


def is_folder(path: Path) -> bool:
    """Return True for a folder, or a link to one; False also for a name that no file can have."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def open_regular(path: Path, *, links: bool = False) -> BinaryIO:
    """Open a regular file for reading, without waiting for the other end of a pipe.

    Raises InputMissingError where there is no file or it cannot be read, InvalidInputError where it is a folder, a pipe
    or a device, or, without `links`, where its last part is a link.
    """
    try:
        check_regular(path, links=links)
        file = open(path, "rb", opener=_opener(links=links))  # noqa: SIM115 - the caller closes it
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        raise unreadable(path, error) from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):  # replaced in the meantime
        file.close()
        raise InvalidInputError(f"{path}: not a file")
    return file


def check_regular(path: Path, *, links: bool = False) -> int:
    """Return the size (bytes) of a regular file that a library will open by itself. Raises as `open_regular`."""
    try:
        found = path.stat(follow_symlinks=links)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from None
    if stat.S_ISLNK(found.st_mode):
        raise InvalidInputError(f"{path}: {IS_LINK}")
    if not stat.S_ISREG(found.st_mode):
        kind = next((what for is_kind, what in KINDS if is_kind(found.st_mode)), "")
        raise InvalidInputError(f"{path}: not a file{kind and ', but '}{kind}")
    return found.st_size


def read_limited(path: Path, limit: int, *, links: bool = False) -> bytes:
    """Return what a file holds, at most `limit` bytes. Raises as `open_regular`, InvalidInputError for a larger one."""
    content = read_head(path, limit + 1, links=links)
    if len(content) > limit:
        raise InvalidInputError(f"{path}: {_too_large(limit)}")
    return content


def read_head(path: Path, count: int, *, links: bool = False) -> bytes:
    """Return the first bytes of a file, at most `count`. Raises as `open_regular`."""
    with open_regular(path, links=links) as file:
        try:
            return file.read(count)
        except OSError as error:
            raise unreadable(path, error) from None


def refuse_large(path: Path, limit: int) -> None:
    """Check that a file that a library will open by itself is regular, and not too large. Raises as `read_limited`."""
    if check_regular(path) > limit:
        raise InvalidInputError(f"{path}: {_too_large(limit)}")


def unreadable(path: Path, error: OSError | ValueError) -> InputMissingError | InvalidInputError:
    """Return the error to raise for a file that cannot be opened or read."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return NoSuchFileError(f"{path}: no such file")
    if number == errno.EISDIR:
        return InvalidInputError(f"{path}: not a file, but a folder")
    reason = getattr(error, "strerror", None) or str(error)
    return InputMissingError(f"{path}: cannot be read: {reason}")


def _opener(*, links: bool) -> Callable[[str, int], int]:
    extra = getattr(os, "O_NONBLOCK", 0) | (0 if links else getattr(os, "O_NOFOLLOW", 0))
    return lambda name, flags: os.open(name, flags | extra)


def _too_large(limit: int) -> str:
    return f"larger than {limit / MEGABYTE:g} MB, the limit for this file"
