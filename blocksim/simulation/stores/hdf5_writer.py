"""Writes run.h5 so that it stays readable after a kill, and whole after a full disk.

A file that is killed in the middle of a plain write is often unreadable. Here all data sets exist, with fixed-length
types, before the file switches to single-writer-multiple-reader mode, and only then does it get its name; every flush
is followed by a new value of `n_committed`. HDF5 cannot recover from a write that fails, so space is reserved before.
"""

import contextlib
import itertools
import math
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from operator import attrgetter, itemgetter
from pathlib import Path
from types import TracebackType
from typing import Self

import h5py
import numpy as np

from blocksim.errors import OutputError
from blocksim.scenario import PlacedBody
from blocksim.simulation import atomic, recorder
from blocksim.simulation.probes import NO_PROBES, Probes
from blocksim.simulation.stores import hdf5 as layout
from blocksim.world.memory import chunk_rows
from blocksim.world.systems.blocks import blocks_placed
from blocksim.world.systems.system import SystemInScene

FLUSH_SECONDS = 0.25
APART = 10.0  # times what the last flush took: a tenth of a run at most
RESERVE = 1 << 18  # bytes


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
        kept: Iterable[recorder.Frame] = (),
        others: Sequence[SystemInScene] = (),
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
        chunk = chunk_rows(max(one.count for one in self.systems))
        self.sets = [*layout.sets_of_frames(self.systems, ledger, time_step, chunk, contacts=contacts)]
        self.probes = probes
        self.probe_sets = {
            name: [
                layout.DataSet(f"{layout.PROBES}/{name}/{layout.PROBE_STEP}", "1", attrgetter("step"), np.int64),
                layout.DataSet(f"{layout.PROBES}/{name}/{layout.PROBE_TIME}", "s", attrgetter("time")),
                *(layout.DataSet(f"{layout.PROBES}/{name}/{of}", unit, itemgetter(of)) for of, unit in units),
            ]
            for name, units in ((name, one.units.items()) for name, one in probes.series().items())
        }
        self.count = 0
        self.is_broken = False
        self.waiting: list[recorder.Frame] = []
        self.flushed_at = -np.inf
        self.flush_seconds = 0.0
        unnamed = path.with_name(f".{path.name}.new")
        with self._locate_errors():
            try:  # before HDF5 does: room for a small file
                unnamed.write_bytes(bytes(RESERVE))
            finally:
                unnamed.unlink(missing_ok=True)
            self.file = h5py.File(unnamed, "w", libver="latest")
            try:
                self._reserve(len(scenario_toml))
                self._create(scenario_toml)
                self.file[layout.STEP].attrs["time_step"] = time_step  # s
                self.file.swmr_mode = True
                self.waiting.extend(kept)
                if self.waiting:  # and with them the samples of probes
                    self.sync()
                unnamed.chmod(atomic.permissions_of(path) or atomic.permissions_of(unnamed) or atomic.PERMISSIONS)
                unnamed.replace(path)
            except BaseException:
                with contextlib.suppress(OSError, RuntimeError):
                    self.file.close()
                unnamed.unlink(missing_ok=True)
                raise

    def _create(self, scenario_toml: str) -> None:
        """Create all data sets, those that grow empty."""
        h5md = self.file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1])
        h5md.create_group("creator").attrs["name"] = "blocksim"
        self.file.create_dataset(layout.COMMITTED, (), dtype=np.int64).attrs["unit"] = "1"
        self.file.create_group(layout.OBSERVABLES, track_order=True)  # readers list the energies as the scheme does
        for name, probe in self.probes.series().items():
            group = self.file.create_group(f"{layout.PROBES}/{name}", track_order=True)
            group.attrs["kind"] = probe.kind
            group.create_dataset(layout.COMMITTED, (), dtype=np.int64).attrs["unit"] = "1"
        for one in itertools.chain(self.sets, *self.probe_sets.values()):
            # a scene may have no blocks; a chunk of nothing cannot be
            chunks, most = (one.chunk, *(size or 1 for size in one.row)), (None, *(size or None for size in one.row))
            data_set = self.file.create_dataset(one.name, (0, *one.row), dtype=one.kind, maxshape=most, chunks=chunks)
            data_set.attrs["unit"] = one.unit
        for system, elements in ((present.system, present.elements) for present in self.systems):
            place = f"{layout.PARTICLES}/{system.name}"
            for constant, values in zip(system.constants, elements.constants, strict=True):
                data_set = self.file.create_dataset(f"{place}/{constant.name}", data=values)
                data_set.attrs["unit"] = constant.stored_unit
            if elements.outlines is not None:  # (b, k, 2) of every element, the last corner repeated
                self.file.create_dataset(f"{place}/outlines", data=elements.outlines).attrs["unit"] = "m"
        text = self.file.create_dataset(layout.SCENARIO_TEXT, data=np.bytes_(scenario_toml.encode()))
        text.attrs["unit"] = "TOML"

    def _reserve(self, size: int) -> None:
        """Make sure of the space on the disk, and of what HDF5 adds: after a write that fails it cannot continue."""
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self.file.id.get_vfd_handle(), self.file.id.get_filesize(), size + RESERVE)

    def append(self, frame: recorder.Frame) -> None:
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
        samples = {name: series for name, series in self.probes.taken().items() if len(series)}
        with self._locate_errors():
            added = [(one, one.of(self.waiting)) for one in self.sets if self.waiting]
            for name, series in samples.items():
                added.extend((one, one.of(series)) for one in self.probe_sets[name])
            if added:  # room for chunks that are begun, too
                self._reserve(
                    sum(
                        (len(values) + 2 * one.chunk) * math.prod(one.row) * int(np.dtype(one.kind).itemsize)
                        for one, values in added
                    )
                )
                for one, values in added:
                    data_set = self.file[one.name]
                    count = data_set.shape[0]
                    before = data_set[count - 1] if one.is_sum and count else 0
                    data_set.resize(count + len(values), axis=0)
                    data_set[count:] = before + values if one.is_sum else values
                self.count += len(self.waiting)
                self.waiting.clear()
                self.file.flush()
            for name in samples:
                group = self.file[f"{layout.PROBES}/{name}"]
                group[layout.COMMITTED][()] = group[layout.PROBE_STEP].shape[0]
            self.file[layout.COMMITTED][()] = self.count
            self.file.flush()
        self.flushed_at = time.monotonic()
        self.flush_seconds = self.flushed_at - began

    def sync(self) -> None:
        """Commit, and wait until it is on the disk, where it outlives a power failure. Raises OutputError."""
        self.commit()
        with self._locate_errors():
            os.fsync(self.file.id.get_vfd_handle())

    @contextmanager
    def _locate_errors(self) -> Iterator[None]:
        """Turn what HDF5 raises into one line; nothing more is written then."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            self.is_broken = True
            number = getattr(error, "errno", None)
            raise OutputError(f"{self.path}: cannot be written: {os.strerror(number) if number else error}") from error

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, whatever happened; who asks for the second time to stop at once does not wait for frames."""
        self.is_broken |= kind is not None and not issubclass(kind, Exception)
        self.close()

    def close(self) -> None:
        """Commit, close the file normally, wait for the disk. Raises OutputError, once."""
        if self.is_broken:
            with contextlib.suppress(OSError, RuntimeError):
                self.file.close()
            return
        self.commit()
        with self._locate_errors():
            self.file.close()
            with self.path.open("r+b") as file:  # cut off what was reserved, which HDF5 knows nothing of
                *_, end, _, _ = layout.SUPERBLOCK.unpack(file.read(layout.SUPERBLOCK.size))
                file.truncate(end)
            atomic.sync_file(self.path)  # no mark of a finished run may outlive its frames
