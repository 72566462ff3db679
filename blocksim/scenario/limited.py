"""Files that others may have made, read up to a size: a file of any size must not take all memory."""

import errno
import os
from pathlib import Path

from blocksim.errors import InputMissingError, InvalidInputError

MEGABYTE = 1_000_000


def read_limited(path: Path, limit: int) -> bytes:
    """Return what a file holds, at most `limit` bytes.

    Raises InputMissingError where there is no file or it cannot be read, InvalidInputError where it is larger, or is
    no file but a folder, a pipe or a device, which may never end.
    """
    try:
        with open(path, "rb", opener=_at_once) as file:
            if not path.is_file():
                message = f"{path}: not a file"
                raise InvalidInputError(message)
            content = file.read(limit + 1)
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        raise _unreadable(path, error) from None
    if len(content) > limit:
        message = f"{path}: {_too_large(limit)}"
        raise InvalidInputError(message)
    return content


def refuse_large(path: Path, limit: int) -> None:
    """Look whether a file that a library will open by itself is one, and not too large. Raises as `read_limited`."""
    try:
        size, is_file = path.stat().st_size, path.is_file()
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if not is_file or size > limit:
        message = f"{path}: {_too_large(limit) if is_file else 'not a file'}"
        raise InvalidInputError(message)


def _too_large(limit: int) -> str:
    return f"larger than {limit / MEGABYTE:g} MB, which is the most that is read"


def _at_once(name: str, flags: int) -> int:
    """Open a file without waiting for somebody at the other end of a pipe."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _unreadable(path: Path, error: OSError | ValueError) -> InputMissingError | InvalidInputError:
    reason = getattr(error, "strerror", None) or str(error)
    if getattr(error, "errno", None) == errno.EISDIR:
        return InvalidInputError(f"{path}: not a file")
    return InputMissingError(f"{path}: cannot be read: {reason}")
