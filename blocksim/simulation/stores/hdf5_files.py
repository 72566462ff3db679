"""HDF5 files: opened safely whoever wrote them, and written safely whatever the disk does."""

import io
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario.input_files import check_regular, read_head
from blocksim.world.free_memory import available_bytes, readable

SUPERBLOCK = struct.Struct("<8s4B3QQI")  # signature; version, sizes, flags; base, extension, end; root; checksum
SIGNATURE = b"\x89HDF\r\n\x1a\n"
VERSION = 3
SIZE_OF_ADDRESS = 8
WRITING, SWMR = 1, 4  # flags: HDF5 file format specification, II.A
DAMAGE = (AttributeError, KeyError, MemoryError, OSError, OverflowError, RuntimeError, TypeError, ValueError)
"""What h5py raises for what HDF5 finds wrong."""
WORD = 0xFFFFFFFF
MOST_ENERGIES = 64
"""In `observables`; the schemes have a dozen."""
SHOWN = 200  # characters of what HDF5 says
NUMBERS = "if"  # kinds of numpy: whole and floating-point


class UnsafeError(ValueError):
    """A run file that is not as blocksim writes it; the text says where."""


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Give the file to read from. Raises as `check_regular`; InvalidInputError for no HDF5 file, or one cut off."""
    check_regular(path)  # again by name below: HDF5 opens most files by itself
    try:
        with path.open("rb", buffering=0) as raw:
            head = _head_as_closed(path, raw)
            with h5py.File(path if head is None else ClosedFileView(raw, head), "r") as file:
                yield file
    except DAMAGE as error:
        message = f"{path}: not a readable HDF5 file: {short_cause(error)}"
        raise InvalidInputError(message) from error


def is_left_open(path: Path) -> bool:
    """Return True if a file has a writer who has not closed it: a run that continues, or was killed."""
    try:
        head = read_head(path, SUPERBLOCK.size)
    except BlocksimError:
        return False
    return len(head) == SUPERBLOCK.size and head.startswith(SIGNATURE) and bool(head[11] & SWMR)


def _head_as_closed(path: Path, raw: io.FileIO) -> bytes | None:
    """Return the superblock that a file would have if it were closed, or None where it has that already.

    Raises InvalidInputError for a file that is cut off, or whose superblock is damaged.
    """
    head = raw.read(SUPERBLOCK.size)
    size = raw.seek(0, os.SEEK_END)
    if len(head) < SUPERBLOCK.size:
        return None
    signature, version, offsets, lengths, flags, base, extension, end, root, checksum = SUPERBLOCK.unpack(head)
    if signature != SIGNATURE or version != VERSION or not flags & SWMR:
        return None
    if size < end:
        message = f"{path}: not a complete run file: cut off at {size} of {end} bytes"
        raise InvalidInputError(message)
    if checksum != lookup3(head[:-4]) or offsets != SIZE_OF_ADDRESS:
        message = f"{path}: not a readable HDF5 file: its superblock is damaged"
        raise InvalidInputError(message)
    flags &= ~(WRITING | SWMR)
    closed = SUPERBLOCK.pack(signature, version, offsets, lengths, flags, base, extension, size, root, 0)[:-4]
    return closed + lookup3(closed).to_bytes(4, "little")


class ClosedFileView(io.RawIOBase):
    """A file with another beginning."""

    def __init__(self, raw: io.FileIO, head: bytes) -> None:
        """Take the file and what its first bytes are to be."""
        self.raw, self.head = raw, head

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def seekable(self) -> bool:
        """Say that it has places."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        return self.raw.seek(offset, whence)

    def tell(self) -> int:
        """Return the place."""
        return self.raw.tell()

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the place on."""
        view, place, count = memoryview(buffer).cast("B"), self.raw.tell(), 0
        while count < len(view) and (part := self.raw.read(len(view) - count)):
            view[count : count + len(part)] = part
            count += len(part)
        covered = max(0, min(len(self.head) - place, count))
        view[:covered] = self.head[place : place + covered]
        return count


def lookup3(data: bytes) -> int:
    """Return the checksum of HDF5's metadata: Jenkins' lookup3 with the initial value 0."""
    a = b = c = (0xDEADBEEF + len(data)) & WORD
    words = struct.unpack(f"<{-(-len(data) // 12) * 3}I", data.ljust(-(-len(data) // 12) * 12, b"\0"))
    for place in range(0, len(words), 3):
        a, b, c = ((one + two) & WORD for one, two in zip((a, b, c), words[place : place + 3], strict=True))
        if place + 3 < len(words):
            a, b, c = _mixed(a, b, c)
    for turn_b, turn_c, turn_a in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _turned(b, turn_b)) & WORD
        a = ((a ^ c) - _turned(c, turn_c)) & WORD
        b = ((b ^ a) - _turned(a, turn_a)) & WORD
    return ((c ^ b) - _turned(b, 24)) & WORD


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    for turns in ((4, 6, 8), (16, 19, 4)):
        a, c = ((a - c) & WORD) ^ _turned(c, turns[0]), (c + b) & WORD
        b, a = ((b - a) & WORD) ^ _turned(a, turns[1]), (a + c) & WORD
        c, b = ((c - b) & WORD) ^ _turned(b, turns[2]), (b + a) & WORD
    return a, b, c


def _turned(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & WORD


def data_set(file: Any, name: str, dimensions: int) -> Any:
    """Return a data set of plain numbers, reached by no links but its own groups. Raises UnsafeError, KeyError."""
    found = member(file, name)
    if not isinstance(found, h5py.Dataset):
        raise UnsafeError(f"{name}: not a data set")
    if found.is_virtual or found.external:
        raise UnsafeError(f"{name}: its values are in other files, which are not read")
    if found.dtype.kind not in NUMBERS or found.dtype.itemsize > 8 or found.dtype.shape:
        raise UnsafeError(f"{name}: holds {found.dtype}, not plain numbers")
    if found.ndim != dimensions:
        raise UnsafeError(f"{name}: has {found.ndim} dimensions, not {dimensions}")
    if found.id.get_create_plist().get_nfilters():
        raise UnsafeError(f"{name}: compressed, unlike any run file")
    return found


def group(file: Any, name: str) -> Any:
    """Return a group with a number of members that a run can have. Raises UnsafeError, KeyError."""
    found = member(file, name)
    if not isinstance(found, h5py.Group):
        raise UnsafeError(f"{name}: not a group")
    if len(found) > MOST_ENERGIES:
        raise UnsafeError(f"{name}: {len(found)} members; at most {MOST_ENERGIES} are read")
    return found


def has(file: Any, name: str) -> bool:
    """Return True if there is a member or a link of this name, which is not followed."""
    return bool(file.id.links.exists(name.encode()))


def member(file: Any, name: str) -> Any:
    """Return what a name means, where no part of it is a link to elsewhere. Raises UnsafeError, KeyError."""
    place = file
    for part in name.split("/"):
        if not isinstance(place, h5py.Group):
            raise UnsafeError(f"{name}: not in a group")
        if place.id.links.get_info(part.encode()).type != h5py.h5l.TYPE_HARD:  # h5py's own get() follows links first
            raise UnsafeError(f"{name}: a link to another place; links are not followed")
        place = place[part]
    return place


def refuse_too_many(path: Path, sets: dict[str, Any], rows: int, what: str = "frames") -> None:
    """Raise UnsafeError where the first `rows` of data sets cannot all be in the file, or not in the memory."""
    size, wanted = path.stat().st_size, 0
    for name, one in sets.items():
        if one.shape[0] < rows:
            raise UnsafeError(f"{name}: holds {one.shape[0]} {what}, not {rows}")
        row_bytes = one.dtype.itemsize * (one.shape[1] if one.ndim > 1 else 1)
        wanted += rows * row_bytes
    if wanted > size:
        raise UnsafeError(f"announces {readable(wanted)} of {what} in a file of {readable(size)}")
    available = available_bytes()
    if available is not None and 3 * wanted > available:  # as read, put together, and as frames
        raise UnsafeError(
            f"its {what} need about {readable(3 * wanted)} of memory; {readable(available)} are available"
        )


def short_cause(error: BaseException) -> str:
    """Return the message of HDF5 as one short line."""
    text = " ".join(str(error).split())
    return text if len(text) <= SHOWN else f"{text[:SHOWN]} ..."


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
