"""run.h5: all frames, in groups named after H5MD, readable after a kill.

A file that is killed in the middle of a plain write is often unreadable. Here all data sets exist, with fixed-length
types, before the file switches to single-writer-multiple-reader mode; every flush is followed by a new value of
`n_committed`, and a reader takes no more frames than that. A file closed normally opens in any mode; one left behind by
a kill opens with `swmr=True`, which the reader tries by itself.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError
from blocksim.scenario import PlacedBody, load_scenario, place_bodies
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import MEASURED, MOTION, frames_from_rows

UNITS = {
    "x": "m",
    "y": "m",
    "angle": "rad",
    "vx": "m s-1",
    "vy": "m s-1",
    "spin": "rad s-1",
    "contact_count": "1",
    "largest_overlap": "m",
}
ENERGY_UNIT = "J"
BLOCKS = "particles/blocks"
OBSERVABLES = "observables"
FLUSH_SECONDS = 0.25
CHUNK = 64


class FrameFile:
    """Writes frames as they come; use as a context manager."""

    def __init__(self, path: Path, placed: Sequence[PlacedBody], time_step: float, scenario_toml: str) -> None:
        """Create the file with all its data sets; raises OutputError when that fails."""
        self.path = path
        self.count = 0
        self.waiting: list[tuple[int, NDArray[np.float64], NDArray[np.float64]]] = []
        self.flushed_at = time.monotonic()
        try:
            self.file = h5py.File(path, "w", libver="latest")
            self._create(placed, time_step, scenario_toml)
            self.file.swmr_mode = True
        except OSError as error:
            message = f"{path}: cannot be written: {error}"
            raise OutputError(message) from error

    def _create(self, placed: Sequence[PlacedBody], time_step: float, scenario_toml: str) -> None:
        bodies = len(placed)
        self.file.create_group("h5md").attrs["version"] = np.array([1, 1])
        creator = self.file["h5md"].create_group("creator")
        creator.attrs["name"] = "blocksim"
        self._data_set("n_committed", (), np.int64)
        step = self._data_set(f"{BLOCKS}/step", (0,), np.int64)
        step.attrs["time_step"] = time_step
        step.attrs["time_step_unit"] = "s"
        for name in MOTION:
            self._data_set(f"{BLOCKS}/{name}", (0, bodies), np.float64).attrs["unit"] = UNITS[name]
        for name in MEASURED:
            self._data_set(f"{OBSERVABLES}/{name}", (0,), np.float64).attrs["unit"] = UNITS.get(name, ENERGY_UNIT)
        for name in ("size_x", "size_y", "depth", "mass"):
            values = np.array([getattr(body, name) for body in placed])
            self.file.create_dataset(f"{BLOCKS}/{name}", data=values).attrs["unit"] = "kg" if name == "mass" else "m"
        text = np.bytes_(scenario_toml.encode())
        self.file.create_dataset("parameters/scenario", data=text)

    def _data_set(self, name: str, shape: tuple[int, ...], kind: type) -> Any:
        chunks = (CHUNK, *shape[1:]) if shape else None
        most = (None, *shape[1:]) if shape else None
        return self.file.create_dataset(name, shape, dtype=kind, maxshape=most, chunks=chunks)

    def append(self, step: int, motion: NDArray[np.float64], measured: NDArray[np.float64]) -> None:
        """Take one frame; writes what has come together a few times a second. Raises OutputError."""
        self.waiting.append((step, motion, measured))
        if time.monotonic() - self.flushed_at > FLUSH_SECONDS:
            self.commit()

    def commit(self) -> None:
        """Bring all frames so far to the disk and then say how many there are. Raises OutputError (disk full …)."""
        try:
            if self.waiting:
                self._write_waiting()
            self.file.flush()
            self.file["n_committed"][()] = self.count
            self.file.flush()
        except OSError as error:
            message = f"{self.path}: writing failed: {error}"
            raise OutputError(message) from error
        self.flushed_at = time.monotonic()

    def _write_waiting(self) -> None:
        steps, motions, rows = zip(*self.waiting, strict=True)
        self._put(f"{BLOCKS}/step", np.array(steps))
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

    def close(self) -> None:
        """Commit and close the file normally. Raises OutputError."""
        try:
            self.commit()
        finally:
            try:
                self.file.close()
            except OSError as error:
                message = f"{self.path}: writing failed: {error}"
                raise OutputError(message) from error

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
        raise InvalidInputError(message)
    try:
        file = h5py.File(path, "r")
    except OSError:
        file = _open_left_behind(path)
    with file:
        yield file


def _open_left_behind(path: Path) -> Any:
    try:
        return h5py.File(path, "r", libver="latest", swmr=True)
    except OSError as error:
        message = f"{path}: not a readable HDF5 file: {error}"
        raise InvalidInputError(message) from error


def read_frames(path: Path, scenario_path: Path) -> Frames:
    """Return the committed frames of a run file; `scenario_path` is the resolved scenario beside it.

    Raises InvalidInputError when the file is not one of ours or damaged.
    """
    placed = place_bodies(load_scenario(scenario_path))
    with _opened(path) as file:
        try:
            count = int(file["n_committed"][()])
            steps = file[f"{BLOCKS}/step"][:count]
            time_step = float(file[f"{BLOCKS}/step"].attrs["time_step"])
            motion = np.stack([file[f"{BLOCKS}/{name}"][:count] for name in MOTION], axis=1)
            measured = np.stack([file[f"{OBSERVABLES}/{name}"][:count] for name in MEASURED], axis=1)
        except (KeyError, OSError, ValueError) as error:
            message = f"{path}: not a complete run file: {error}"
            raise InvalidInputError(message) from error
    if count == 0 or motion.shape[2] != len(placed):
        message = f"{path}: holds {count} frames of {motion.shape[2]} bodies; the scenario has {len(placed)} bodies"
        raise InvalidInputError(message)
    return frames_from_rows(placed, steps, time_step, motion, measured)
