"""Writes run.h5 so that it stays readable after a kill, and whole after a full disk.

A file that is killed in the middle of a plain write is often unreadable. Here all data sets exist, with fixed-length
types, before the file switches to single-writer-multiple-reader mode, and only then does it get its name; every flush
is followed by a new value of `n_committed`. HDF5 cannot recover from a write that fails, so space is reserved before.
"""

import contextlib
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import OutputError
from blocksim.scenario import PlacedBody
from blocksim.simulation.atomic import PERMISSIONS, permissions_of, sync_file
from blocksim.simulation.contacts import Rows
from blocksim.simulation.probes import NO_PROBES, Probes
from blocksim.simulation.recorder import Frame
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores.hdf5_contacts import append_contacts, bytes_of_contacts, create_contacts
from blocksim.simulation.stores.hdf5_open import SIGNATURE, SUPERBLOCK, VERSION
from blocksim.simulation.stores.hdf5_probes import append_probes, bytes_of_probes, commit_probes, create_probes
from blocksim.world.memory import chunk_rows
from blocksim.world.systems.blocks import blocks_placed
from blocksim.world.systems.system import Present

FLUSH_SECONDS = 0.25
APART = 10.0  # times what the last flush took: a tenth of a run at most
RESERVE = 1 << 18  # bytes


def _try_room(path: Path) -> None:
    """Raise OSError, and leave nothing, where a small file cannot be written."""
    try:
        path.write_bytes(bytes(RESERVE))
    finally:
        path.unlink(missing_ok=True)


def _give_back(path: Path) -> None:
    """Cut off what was reserved at the end of a closed file, which HDF5 knows nothing of. Raises OSError."""
    with path.open("r+b") as file:
        head = file.read(SUPERBLOCK.size)
        if len(head) == SUPERBLOCK.size:
            signature, version, *_, end, _, _ = SUPERBLOCK.unpack(head)
            if (signature, version) == (SIGNATURE, VERSION) and SUPERBLOCK.size < end < path.stat().st_size:
                file.truncate(end)


class FrameFile:
    """Writes frames as they come; use as a context manager."""

    def __init__(
        self,
        path: Path,
        placed: Sequence[PlacedBody],
        time_step: float,
        scenario_toml: str,
        *,
        ledger: Sequence[str],
        kept: Iterable[Frame] = (),
        others: Sequence[Present] = (),
        contacts: bool = False,
        probes: Probes = NO_PROBES,
    ) -> None:
        """Create the file with all its data sets, `ledger` names the energies; raises OutputError when that fails.

        It begins with the frames that are `kept` from an earlier part of the run. Only with those on the disk it takes
        the place of an older file. `others` are the systems beside the blocks. With `contacts` every frame has to bring
        its contacts. The samples that `probes` hold are taken from them and written with the frames.
        """
        self.path = path
        self.systems = (blocks_placed(placed), *others)
        self.units = layout.measured_units(ledger)
        self.has_contacts = contacts
        self.probes = probes
        self.time_step = time_step
        self.count = 0
        self.chunk_rows = chunk_rows(max(one.count for one in self.systems))
        self.is_broken = False
        self.waiting: list[Frame] = []
        self.flushed_at = -np.inf
        self.flush_seconds = 0.0
        numbers = sum(len(one.system.quantities) * one.count for one in self.systems)
        self.row_bytes = 8 * (2 + numbers + len(self.units))
        unnamed = path.with_name(f".{path.name}.new")
        with self._telling_trouble():
            _try_room(unnamed)
            self.file = h5py.File(unnamed, "w", libver="latest")
            try:
                self._reserve(len(scenario_toml))
                self._create(scenario_toml)
                self.file.swmr_mode = True
                self._begin_with(kept)
                unnamed.chmod(permissions_of(path) or permissions_of(unnamed) or PERMISSIONS)
                unnamed.replace(path)
            except BaseException:
                self._abandon(unnamed)
                raise

    def _begin_with(self, kept: Iterable[Frame]) -> None:
        self.waiting.extend(kept)
        if self.waiting:  # and with them the samples of probes
            self.commit()
            self.sync()

    def _abandon(self, unnamed: Path) -> None:
        """Leave nothing where there is no room, or no time."""
        with contextlib.suppress(OSError, RuntimeError):
            self.file.close()
        unnamed.unlink(missing_ok=True)

    def _create(self, scenario_toml: str) -> None:
        h5md = self.file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1])
        h5md.create_group("creator").attrs["name"] = "blocksim"
        self.file.create_dataset(layout.COMMITTED, (), dtype=np.int64).attrs["unit"] = "1"
        self._growing(layout.STEP, np.int64, "1")
        self._growing(layout.TIME, np.float64, "s")
        for present in self.systems:
            for place, one in zip(layout.places_of(present.system), present.system.quantities, strict=True):
                self._growing(place, np.float64, one.stored_unit, present.count)
        self.file.create_group(layout.OBSERVABLES, track_order=True)  # readers list the energies as the scheme does
        for name, unit in self.units.items():
            self._growing(f"{layout.OBSERVABLES}/{name}", np.float64, unit)
        if self.has_contacts:
            create_contacts(self.file, self.chunk_rows)
        create_probes(self.file, self.probes.series().values())
        for present in self.systems:
            for one, values in zip(present.system.constants, present.elements.constants, strict=True):
                place = f"{layout.PARTICLES}/{present.system.name}/{one.name}"
                self.file.create_dataset(place, data=values).attrs["unit"] = one.stored_unit
            if present.elements.outlines is not None:
                place = f"{layout.PARTICLES}/{present.system.name}/{layout.OUTLINES}"
                self.file.create_dataset(place, data=present.elements.outlines).attrs["unit"] = "m"
        text = self.file.create_dataset(layout.SCENARIO_TEXT, data=np.bytes_(scenario_toml.encode()))
        text.attrs["unit"] = layout.TEXT_UNIT
        self.file[layout.STEP].attrs["time_step"] = self.time_step  # s

    def _growing(self, name: str, kind: type, unit: str, *row: int) -> None:
        # a scene may have no blocks; a chunk of nothing cannot be
        chunks, most = (self.chunk_rows, *(one or 1 for one in row)), (None, *(one or None for one in row))
        data_set = self.file.create_dataset(name, (0, *row), dtype=kind, maxshape=most, chunks=chunks)
        data_set.attrs["unit"] = unit

    def _reserve(self, size: int) -> None:
        """Make sure of the space on the disk, and of what HDF5 adds: after a write that fails it cannot continue."""
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self.file.id.get_vfd_handle(), self.file.id.get_filesize(), size + RESERVE)

    def append(self, frame: Frame) -> None:
        """Take one frame; writes what has come together a few times a second. Raises OutputError."""
        self.waiting.append(frame)
        self.keep_up()

    def keep_up(self) -> None:
        """Write what has come together, a few times a second; less often where that takes long. Raises OutputError."""
        if time.monotonic() - self.flushed_at > max(FLUSH_SECONDS, APART * self.flush_seconds):
            self.commit()

    def commit(self) -> None:
        """Bring all frames so far to the disk and then say how many there are. Raises OutputError (disk full …)."""
        began = time.monotonic()
        samples = self.probes.taken().values()
        with self._telling_trouble():
            if self.waiting or any(map(len, samples)):
                room = (len(self.waiting) + 2 * self.chunk_rows) * self.row_bytes + self._contact_bytes()
                self._reserve(room + bytes_of_probes(samples))
                append_probes(self.file, samples)
                self._write_waiting()
                self.file.flush()
            commit_probes(self.file, samples)
            self.file[layout.COMMITTED][()] = self.count
            self.file.flush()
        self.flushed_at = time.monotonic()
        self.flush_seconds = self.flushed_at - began

    def sync(self) -> None:
        """Commit, and wait until it is on the disk, where it outlives a power failure. Raises OutputError."""
        self.commit()
        with self._telling_trouble():
            os.fsync(self.file.id.get_vfd_handle())

    def _write_waiting(self) -> None:
        if not self.waiting:
            return
        steps, states, rows, _ = zip(*self.waiting, strict=True)
        self._put(layout.STEP, np.array(steps))
        self._put(layout.TIME, np.array(steps) * self.time_step)
        for present, some in zip(self.systems, zip(*states, strict=True), strict=True):
            for place, values in zip(layout.places_of(present.system), np.stack(some, axis=1), strict=True):
                self._put(place, values)
        for name, values in zip(self.units, np.stack(rows, axis=1), strict=True):
            self._put(f"{layout.OBSERVABLES}/{name}", values)
        if self.has_contacts:
            append_contacts(self.file, self._waiting_contacts())
        self.count += len(self.waiting)
        self.waiting.clear()

    def _waiting_contacts(self) -> list[Rows]:
        return [frame.contacts for frame in self.waiting if frame.contacts is not None]

    def _contact_bytes(self) -> int:
        return bytes_of_contacts(self._waiting_contacts()) if self.has_contacts else 0

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
        """Commit, close the file normally, wait for the disk. Raises OutputError, once."""
        if self.is_broken:
            with contextlib.suppress(OSError, RuntimeError):
                self.file.close()
            return
        self.commit()
        with self._telling_trouble():
            self.file.close()
            _give_back(self.path)
            sync_file(self.path)  # no mark of a finished run may outlive its frames

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, whatever happened; who asks for the second time to stop at once does not wait for frames."""
        self.is_broken |= kind is not None and not issubclass(kind, Exception)
        self.close()
