"""run.h5: all frames, in groups named after H5MD, readable after a kill.

A file that is killed in the middle of a plain write is often unreadable. Here all data sets exist, with fixed-length
types, before the file switches to single-writer-multiple-reader mode, and only then does it get its name; every flush
is followed by a new value of `n_committed`, and a reader takes no more frames than that. A file closed normally opens
in any mode; one left behind by a kill opens with `swmr=True`, which the reader does by itself. Every data set says its
unit in the attribute `unit`.
"""

import contextlib
import os
import struct
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InputMissingError, InvalidInputError, OutputError
from blocksim.kernels.energy import LEDGER_ROW
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import MEASURED, MOTION, frames_from_rows

BLOCKS = "particles/blocks"
OBSERVABLES = "observables"
COMMITTED = "n_committed"
MOTION_UNITS = dict(zip(MOTION, ("m", "m", "rad", "m s-1", "m s-1", "rad s-1"), strict=True))
MEASURED_UNITS = {**dict.fromkeys(LEDGER_ROW, "J"), "contact_count": "1", "largest_overlap": "m"}
BODY_UNITS = {"size_x": "m", "size_y": "m", "depth": "m", "mass": "kg", "inertia": "kg m2"}
TEXT_UNIT = "TOML"
SUPERBLOCK = struct.Struct("<8sBxxB16xQ")  # signature, version, consistency flags, end of file
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SUPERBLOCK_VERSION = 3
SWMR_FLAG = 4
FLUSH_SECONDS = 0.25
MOST_CHUNK_ROWS = 64
CHUNK_VALUES = 1 << 17  # a megabyte
RESERVE = 1 << 18  # bytes


def _try_room(path: Path) -> None:
    """Raise OSError, and leave nothing, where a small file cannot be written."""
    try:
        path.write_bytes(bytes(RESERVE))
    finally:
        path.unlink(missing_ok=True)


class FrameFile:
    """Writes frames as they come; use as a context manager."""

    def __init__(self, path: Path, placed: Sequence[PlacedBody], time_step: float, scenario_toml: str) -> None:
        """Create the file with all its data sets; raises OutputError when that fails."""
        self.path = path
        self.time_step = time_step
        self.count = 0
        self.chunk_rows = min(MOST_CHUNK_ROWS, max(1, CHUNK_VALUES // len(placed)))
        self.is_broken = False
        self.waiting: list[tuple[int, NDArray[np.float64], NDArray[np.float64]]] = []
        self.flushed_at = -np.inf
        self.row_bytes = 8 * (2 + len(MOTION) * len(placed) + len(MEASURED))
        unnamed = path.with_name(f".{path.name}.new")
        with self._telling_trouble():
            _try_room(unnamed)
            self.file = h5py.File(unnamed, "w", libver="latest")
            self._reserve(len(scenario_toml))
            self._create(placed, scenario_toml)
            self.file.swmr_mode = True
            unnamed.replace(path)

    def _create(self, placed: Sequence[PlacedBody], scenario_toml: str) -> None:
        h5md = self.file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1])
        h5md.create_group("creator").attrs["name"] = "blocksim"
        self.file.create_dataset(COMMITTED, (), dtype=np.int64).attrs["unit"] = "1"
        self._growing(f"{BLOCKS}/step", np.int64, "1")
        self._growing(f"{BLOCKS}/time", np.float64, "s")
        for name, unit in MOTION_UNITS.items():
            self._growing(f"{BLOCKS}/{name}", np.float64, unit, len(placed))
        for name, unit in MEASURED_UNITS.items():
            self._growing(f"{OBSERVABLES}/{name}", np.float64, unit)
        for name, unit in BODY_UNITS.items():
            values = np.array([getattr(body, name) for body in placed])
            self.file.create_dataset(f"{BLOCKS}/{name}", data=values).attrs["unit"] = unit
        text = self.file.create_dataset("parameters/scenario", data=np.bytes_(scenario_toml.encode()))
        text.attrs["unit"] = TEXT_UNIT
        self.file[f"{BLOCKS}/step"].attrs["time_step"] = self.time_step  # s

    def _growing(self, name: str, kind: type, unit: str, *row: int) -> None:
        data_set = self.file.create_dataset(
            name, (0, *row), dtype=kind, maxshape=(None, *row), chunks=(self.chunk_rows, *row)
        )
        data_set.attrs["unit"] = unit

    def _reserve(self, size: int) -> None:
        """Make sure of the space on the disk, and of what HDF5 adds: after a write that fails it cannot go on."""
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self.file.id.get_vfd_handle(), self.file.id.get_filesize(), size + RESERVE)

    def append(self, step: int, motion: NDArray[np.float64], measured: NDArray[np.float64]) -> None:
        """Take one frame; writes what has come together a few times a second. Raises OutputError."""
        self.waiting.append((step, motion, measured))
        if time.monotonic() - self.flushed_at > FLUSH_SECONDS:
            self.commit()

    def commit(self) -> None:
        """Bring all frames so far to the disk and then say how many there are. Raises OutputError (disk full …)."""
        with self._telling_trouble():
            if self.waiting:
                self._reserve((len(self.waiting) + 2 * self.chunk_rows) * self.row_bytes)
                self._write_waiting()
                self.file.flush()
            self.file[COMMITTED][()] = self.count
            self.file.flush()
        self.flushed_at = time.monotonic()

    def _write_waiting(self) -> None:
        steps, motions, rows = zip(*self.waiting, strict=True)
        self._put(f"{BLOCKS}/step", np.array(steps))
        self._put(f"{BLOCKS}/time", np.array(steps) * self.time_step)
        for name, values in zip(MOTION, np.stack(motions, axis=1), strict=True):
            self._put(f"{BLOCKS}/{name}", values)
        for name, values in zip(MEASURED, np.stack(rows, axis=1), strict=True):
            self._put(f"{OBSERVABLES}/{name}", values)
        self.count += len(self.waiting)
        self.waiting.clear()

    def _put(self, name: str, values: NDArray[Any]) -> None:
        data_set = self.file[name]
        data_set.resize(self.count + len(values), axis=0)
        data_set[self.count :] = values

    @contextmanager
    def _telling_trouble(self) -> Iterator[None]:
        """Turn what HDF5 raises into one line; nothing more is written then."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            self.is_broken = True
            number = getattr(error, "errno", None)
            reason = os.strerror(number) if number else str(error)
            message = f"{self.path}: cannot be written: {reason}"
            raise OutputError(message) from error

    def close(self) -> None:
        """Commit and close the file normally. Raises OutputError, unless trouble was told already."""
        if self.is_broken:
            with contextlib.suppress(OSError, RuntimeError):
                self.file.close()
            return
        self.commit()
        with self._telling_trouble():
            self.file.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, whatever happened."""
        self.close()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    if not path.is_file():
        message = f"{path}: no such file"
        raise InputMissingError(message)
    try:
        file = h5py.File(path, "r", **({"libver": "latest", "swmr": True} if _is_left_open(path) else {}))
    except OSError as error:
        message = f"{path}: not a readable HDF5 file: {error}"
        raise InvalidInputError(message) from error
    with file:
        yield file


def _is_left_open(path: Path) -> bool:
    """Tell whether a writer has not closed the file: it was killed, or is still at work.

    Looked up in the superblock (HDF5 file format specification, II.A), because HDF5 tries for ever to read a damaged
    file in SWMR mode. Raises InvalidInputError for a file that is cut off.
    """
    with path.open("rb") as file:
        head = file.read(SUPERBLOCK.size)
        size = file.seek(0, os.SEEK_END)
    if len(head) < SUPERBLOCK.size:
        return False
    signature, version, flags, end = SUPERBLOCK.unpack(head)
    is_open = signature == SIGNATURE and version == SUPERBLOCK_VERSION and bool(flags & SWMR_FLAG)
    if is_open and size < end:
        message = f"{path}: not a complete run file: cut off at {size} of {end} bytes"
        raise InvalidInputError(message)
    return is_open


def read_frames(path: Path, scenario: Scenario) -> Frames:
    """Return the committed frames of a run file; `scenario` is the one that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty.
    """
    placed = place_bodies(scenario)
    with _opened(path) as file:
        try:
            count = int(file[COMMITTED][()])
            steps = file[f"{BLOCKS}/step"][:count]
            time_step = float(file[f"{BLOCKS}/step"].attrs["time_step"])
            motion = np.stack([file[f"{BLOCKS}/{name}"][:count] for name in MOTION], axis=1)
            measured = np.stack([file[f"{OBSERVABLES}/{name}"][:count] for name in MEASURED], axis=1)
        except (KeyError, OSError, RuntimeError, TypeError, ValueError) as error:
            message = f"{path}: not a complete run file: {error}"
            raise InvalidInputError(message) from error
    if count == 0 or motion.shape != (count, len(MOTION), len(placed)) or len(measured) != count:
        message = (
            f"{path}: holds {len(motion)} frames, {count} announced, of {motion.shape[-1]} bodies, not {len(placed)}"
        )
        raise InvalidInputError(message)
    return frames_from_rows(placed, steps, time_step, motion, measured)
