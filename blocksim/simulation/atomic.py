"""Small files that are either there and whole, or not there."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

from blocksim.errors import OutputError


def write_text(path: Path, text: str) -> None:
    """Write a file through a temporary one beside it; raises OutputError and leaves nothing behind when that fails."""
    temporary: str | None = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
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


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
