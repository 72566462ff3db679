"""A file for HDF5 to write to that never fails in its hands: HDF5 cannot recover from a write that does.

After a failed write, as on a full disk, the library ends the process with a segmentation fault when it closes the file.
So what does not fit on the disk is kept in memory, for the little that is still to come, and the writer asks between
its own steps whether all is well.
"""

import io
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py


class Sink(io.RawIOBase):
    """The file object that HDF5 reads and writes; `trouble` is the first error of the disk."""

    def __init__(self, path: Path) -> None:
        """Open a file that is there, for writing. Raises OSError."""
        super().__init__()
        self.raw = path.open("r+b", buffering=0)
        self.trouble: OSError | None = None
        self.beyond: list[tuple[int, bytes]] = []  # what is not on the disk, in the order in which it was written
        self.place = 0
        self.size = os.fstat(self.raw.fileno()).st_size

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def writable(self) -> bool:
        """Say that it can be written."""
        return True

    def seekable(self) -> bool:
        """Say that it has places."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place (bytes)."""
        self.place = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self.place, os.SEEK_END: self.size}[whence]
        return self.place

    def tell(self) -> int:
        """Return the place (bytes)."""
        return self.place

    def truncate(self, size: int | None = None) -> int:
        """Cut the file, or make it longer."""
        self.size = self.place if size is None else size
        if self.trouble is None:
            try:
                self.raw.truncate(self.size)
            except OSError as error:
                self.trouble = error
        return self.size

    def write(self, data: Any) -> int:
        """Write all bytes, to the disk or, where that has failed, into memory."""
        content = bytes(data)
        if self.trouble is None:
            try:
                _write_at(self.raw.fileno(), content, self.place)
            except OSError as error:
                self.trouble = error
        if self.trouble is not None:
            self.beyond.append((self.place, content))
        self.place += len(content)
        self.size = max(self.size, self.place)
        return len(content)

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the place on, with zeros where nothing was written."""
        view = memoryview(buffer).cast("B")
        content = bytearray(os.pread(self.raw.fileno(), len(view), self.place))
        content.extend(bytes(len(view) - len(content)))
        for start, part in self.beyond:
            first, last = max(start, self.place), min(start + len(part), self.place + len(view))
            if first < last:
                content[first - self.place : last - self.place] = part[first - start : last - start]
        view[:] = content
        self.place += len(view)
        return len(view)

    def close(self) -> None:
        """Close the file; that of HDF5 has to be closed before."""
        self.raw.close()
        super().close()


def _write_at(handle: int, content: bytes, place: int) -> None:
    left = memoryview(content)
    while left:
        count = os.pwrite(handle, left, place)
        left, place = left[count:], place + count


class SafeFile:
    """An HDF5 file to be written, whatever the disk does; use as a context manager."""

    def __init__(self, path: Path) -> None:
        """Begin in an empty file that is there. Raises OSError."""
        self.sink = Sink(path)
        self.file = h5py.File(self.sink, "w")

    def check(self) -> None:
        """Raise OSError where something could not be written so far."""
        if self.sink.trouble is not None:
            raise self.sink.trouble

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file and bring it to the disk. Raises OSError where that fails, or something before has."""
        try:
            self.file.close()
            if kind is None:
                self.check()
                os.fsync(self.sink.raw.fileno())
        finally:
            self.sink.close()
