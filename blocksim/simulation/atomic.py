"""Small files that are either there and whole, or not there."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

from blocksim.errors import OutputError


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file through a temporary one beside it; raises OutputError and leaves nothing behind when that fails."""
    temporary: str | None = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                Path(temporary).unlink()
        message = f"{path}: cannot be written: {error.strerror}"
        raise OutputError(message) from error


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `write_bytes` does."""
    write_bytes(path, text.encode())


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
