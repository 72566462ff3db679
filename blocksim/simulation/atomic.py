"""Small files that are either there and whole, or not there."""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from blocksim.errors import OutputError


@contextlib.contextmanager
def writing(path: Path) -> Iterator[BinaryIO]:
    """Give a temporary file beside `path` that takes its place at the end; what is read there is never half a file.

    Raises OutputError, and leaves nothing behind when anything fails.
    """
    temporary: str | None = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                Path(temporary).unlink()
        if not isinstance(error, OSError):
            raise
        message = f"{path}: cannot be written: {error.strerror}"
        raise OutputError(message) from error


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file through a temporary one beside it; raises OutputError and leaves nothing behind when that fails."""
    with writing(path) as file:
        file.write(content)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `write_bytes` does."""
    write_bytes(path, text.encode())


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
