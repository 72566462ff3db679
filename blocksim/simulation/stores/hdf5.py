"""run.h5: the table of its data sets, opened safely whoever wrote it, read, and written.

A file that is killed in the middle of a plain write is often unreadable. Here all data sets exist, with fixed-length
types, before the file switches to single-writer-multiple-reader mode, and only then does it get its name; every flush
is followed by a new value of `n_committed`. HDF5 cannot recover from a write that fails, so space is reserved before.
"""

import ctypes
import errno
import io
import itertools
import math
import os
import re
import struct
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from operator import attrgetter, itemgetter
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError
from blocksim.scenario import Model, input_files
from blocksim.simulation import files, instruments, trajectory
from blocksim.world.free_memory import available_bytes, chunk_rows, readable
from blocksim.world.systems import blocks, others_of
from blocksim.world.systems.system import System, SystemInScene

PARTICLES, OBSERVABLES, CONTACTS, PROBES = "particles", "observables", "contacts", "probes"
COMMITTED = "n_committed"
STEP, TIME, ENDS = f"{PARTICLES}/blocks/step", f"{PARTICLES}/blocks/time", f"{CONTACTS}/end"
SCENARIO_TEXT = "parameters/scenario"
PROBE_STEP, PROBE_TIME = "step", "time"
COUNTED_UNITS = {"contact_count": "1", "largest_overlap": "m"}
Values = NDArray[Any]


@dataclass(frozen=True)
class DataSet:
    """A data set that grows while a run continues, by rows of frames or of samples of a probe."""

    name: str
    unit: str
    of: Callable[[Any], Values]  # its rows in frames, or in a ProbeSeries
    kind: Any = np.float64
    row: tuple[int, ...] = ()  # shape of a row
    chunk: int = instruments.CHUNK_ROWS  # rows
    is_sum: bool = False  # what it counts goes on from its last row


def places_of(system: System) -> list[str]:
    """Return the data sets of what frames keep of a system, in the order of its `quantities`."""
    return [f"{PARTICLES}/{system.name}/{one.name}" for one in system.quantities]


def sets_of_frames(
    systems: Sequence[SystemInScene], ledger: Iterable[str], time_step: float, chunk: int, *, contacts: bool
) -> Iterator[DataSet]:
    """Yield the data sets of frames with steps of `time_step` (s), in chunks of so many rows.

    Each `of` takes a list of frames. `ledger` names the energies. Contacts are among them where these are recorded.
    """
    yield DataSet(STEP, "1", lambda frames: np.array([one.step for one in frames]), np.int64, chunk=chunk)
    yield DataSet(TIME, "s", lambda frames: np.array([one.step for one in frames]) * time_step, chunk=chunk)
    for n, present in enumerate(systems):
        for k, (place, one) in enumerate(zip(places_of(present.system), present.system.quantities, strict=True)):
            yield DataSet(
                place,
                one.unit.replace("/s", " s-1"),  # as H5MD writes it
                partial(lambda n, k, frames: np.stack([frame.states[n][k] for frame in frames]), n, k),
                row=(present.count,),
                chunk=chunk,
            )
    for k, (name, unit) in enumerate({**dict.fromkeys(ledger, "J"), **COUNTED_UNITS}.items()):
        of = partial(lambda k, frames: np.array([one.measured[k] for one in frames]), k)
        yield DataSet(f"{OBSERVABLES}/{name}", unit, of, chunk=chunk)
    if contacts:
        yield DataSet(
            ENDS,
            "1",
            lambda frames: np.cumsum([0 if one.contacts is None else len(one.contacts) for one in frames]),
            np.int64,
            chunk=chunk,
            is_sum=True,
        )
        yield from sets_of_contacts()


def sets_of_contacts() -> Iterator[DataSet]:
    """Yield the data sets with a row a contact."""
    none = np.zeros(0, trajectory.CONTACT_ROW)
    for name, unit in {**dict.fromkeys(trajectory.BODIES, "1"), **trajectory.UNITS}.items():
        yield DataSet(
            f"{CONTACTS}/{name}",
            unit,
            partial(
                lambda name, frames: np.concatenate(
                    [(none if one.contacts is None else one.contacts)[name] for one in frames]
                ),
                name,
            ),
            trajectory.CONTACT_ROW[name],
        )


DAMAGE = (AttributeError, KeyError, MemoryError, OSError, OverflowError, RuntimeError, TypeError, ValueError)
"""What h5py raises for what HDF5 finds wrong."""
SUPERBLOCK = struct.Struct("<8s4B3QQI")  # signature; version, sizes, flags; base, extension, end; root; checksum
SIGNATURE = b"\x89HDF\r\n\x1a\n"
VERSION = 3
WRITING, SWMR = 1, 4  # flags: HDF5 file format specification, II.A
WORD = 0xFFFFFFFF
MOST_MEMBERS = 64  # of a group; the schemes have a dozen energies
LONGEST_CAUSE = 200  # characters of what HDF5 says
PAUSES = (0.05, 0.2)  # s


class UnsafeError(ValueError):
    """A run file that is not as blocksim writes it; the text says where."""


@contextmanager
def refuse_damage(path: Path, what: str) -> Iterator[None]:
    """Raise InvalidInputError for what h5py raises for a file that is `what`, in one short line."""
    try:
        yield
    except DAMAGE as error:
        raise InvalidInputError(f"{path}: {what}: {_cause(error)}") from error


def _cause(error: Exception) -> str:
    """Return what the system says, which HDF5 wraps in a text of its own, else the beginning of that, in a line."""
    found = re.search(r"errno = (\d+)", str(error))
    number = getattr(error, "errno", None) or (int(found[1]) if found else 0)
    if number == errno.ENOLCK:
        return f"{os.strerror(number)}; where the file system has none, set HDF5_USE_FILE_LOCKING=FALSE"
    text = os.strerror(number) if number else " ".join(str(error).split())
    return text if len(text) <= LONGEST_CAUSE else f"{text[:LONGEST_CAUSE]} ..."


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Give the file to read from. Raises as `check_regular`; InvalidInputError for no HDF5 file, or one cut off.

    One that its writer has not closed is read as if it were: HDF5 itself refuses it, or reads damage for ever.
    """
    input_files.check_regular(path)  # again by name below: HDF5 opens most files by itself
    with refuse_damage(path, "not a readable HDF5 file"), ClosedFileView(path) as raw:
        head = raw.read(SUPERBLOCK.size)
        if not _is_open(head):
            with h5py.File(path, "r") as file:
                yield file
            return
        size = raw.seek(0, os.SEEK_END)
        signature, version, offsets, lengths, flags, base, extension, end, root, checksum = SUPERBLOCK.unpack(head)
        if size < end:
            raise InvalidInputError(f"{path}: not a complete run file: cut off at {size} of {end} bytes")
        if checksum != lookup3(head[:-4]) or offsets != 8:
            raise InvalidInputError(f"{path}: not a readable HDF5 file: its superblock is damaged")
        flags &= ~(WRITING | SWMR)
        closed = SUPERBLOCK.pack(signature, version, offsets, lengths, flags, base, extension, size, root, 0)[:-4]
        raw.head = closed + lookup3(closed).to_bytes(4, "little")
        with h5py.File(raw, "r") as file:
            yield file


def _is_open(head: bytes) -> bool:
    """Return True for the superblock of a file whose writer has not closed it: a run continues, or was killed."""
    return len(head) == SUPERBLOCK.size and head.startswith(SIGNATURE) and head[8] == VERSION and bool(head[11] & SWMR)


class ClosedFileView(io.FileIO):
    """A file with another beginning."""

    head = b""

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the place on."""
        view, place, count = memoryview(buffer).cast("B"), self.tell(), 0
        while count < len(view) and (part := self.read(len(view) - count)):
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
            for turns in ((4, 6, 8), (16, 19, 4)):
                a, c = ((a - c) & WORD) ^ _turned(c, turns[0]), (c + b) & WORD
                b, a = ((b - a) & WORD) ^ _turned(a, turns[1]), (a + c) & WORD
                c, b = ((c - b) & WORD) ^ _turned(b, turns[2]), (b + a) & WORD
    for turn_b, turn_c, turn_a in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _turned(b, turn_b)) & WORD
        a = ((a ^ c) - _turned(c, turn_c)) & WORD
        b = ((b ^ a) - _turned(a, turn_a)) & WORD
    return ((c ^ b) - _turned(b, 24)) & WORD


def _turned(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & WORD


def data_set(file: Any, name: str, dimensions: int) -> Any:
    """Return a data set of plain numbers, reached by no links but its own groups. Raises UnsafeError, KeyError."""
    node = member(file, name)
    if not isinstance(node, h5py.Dataset):
        raise UnsafeError(f"{name}: not a data set")
    if node.is_virtual or node.external:
        raise UnsafeError(f"{name}: its values are in other files, which are not read")
    if node.dtype.kind not in "if" or node.dtype.itemsize > 8 or node.dtype.shape:
        raise UnsafeError(f"{name}: holds {node.dtype}, not plain numbers")
    if node.ndim != dimensions:
        raise UnsafeError(f"{name}: has {node.ndim} dimensions, not {dimensions}")
    if node.id.get_create_plist().get_nfilters():
        raise UnsafeError(f"{name}: compressed, unlike any run file")
    return node


def group(file: Any, name: str) -> Any:
    """Return a group with a number of members that a run can have. Raises UnsafeError, KeyError."""
    node = member(file, name)
    if not isinstance(node, h5py.Group):
        raise UnsafeError(f"{name}: not a group")
    if len(node) > MOST_MEMBERS:
        raise UnsafeError(f"{name}: {len(node)} members; at most {MOST_MEMBERS} are read")
    return node


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


def read_probes(path: Path, model: Model) -> dict[str, instruments.ProbeSeries]:
    """Return the samples of all probes of a scenario in a run file, by name.

    Raises InputMissingError, or InvalidInputError for a damaged file or one without these probes.
    """
    names = [*model.probes]
    if not names:
        return {}
    with open_hdf5(path) as file, refuse_damage(path, "its probes cannot be read"):
        return {name: _samples(path, file, name) for name in names}


def _samples(path: Path, file: Any, name: str) -> instruments.ProbeSeries:
    place = f"{PROBES}/{name}"
    count = int(data_set(file, f"{place}/{COMMITTED}", 0)[()])
    sets = {one: data_set(file, f"{place}/{one}", 1) for one in group(file, place) if one != COMMITTED}
    if count < 0:
        raise ValueError(f"{place} holds {count} samples")
    refuse_too_many(path, {f"{place}/{one}": data for one, data in sets.items()}, count, "samples")
    kind, steps = str(file[place].attrs["kind"]), np.asarray(sets.pop(PROBE_STEP)[:count], dtype=np.int64)
    if (np.diff(steps) <= 0).any():
        raise ValueError(f"{place}/{PROBE_STEP} does not increase")
    times = np.asarray(sets.pop(PROBE_TIME)[:count], dtype=np.float64)
    columns = {one: np.asarray(data[:count], dtype=np.float64) for one, data in sets.items()}
    units = {one: str(data.attrs["unit"]) for one, data in sets.items()}
    return instruments.ProbeSeries(name, kind, steps, times, columns, units)


def read_frames(path: Path, model: Model) -> trajectory.Frames:
    """Return the committed frames of a run file; `model` is that of the scenario that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty.
    """
    systems = (blocks.block_system(model.bodies), *others_of(model))
    time_step, rows = read_rows(path, systems)
    return instruments.frames_from_rows(systems, time_step, rows)


def read_rows(path: Path, systems: Sequence[SystemInScene]) -> tuple[float, instruments.FrameRows]:
    """Return step (s) and committed frames of a run file of these systems, blocks first. Raises as `read_frames`.

    What a run that continues writes at this moment may look like damage: a file without an end is tried a few times.
    """
    pauses = iter(PAUSES)
    while True:
        try:
            with open_hdf5(path) as file, refuse_damage(path, "not a complete run file"):
                return _read(path, file, systems)
        except InvalidInputError:
            pause = next(pauses, None)
            if pause is None or not _is_open(input_files.read_head(path, SUPERBLOCK.size)):
                raise
            time.sleep(pause)


def _read(path: Path, file: Any, systems: Sequence[SystemInScene]) -> tuple[float, instruments.FrameRows]:
    """Return step (s) and rows of all committed frames, after looking at what would be read."""
    count = int(data_set(file, COMMITTED, 0)[()])
    ledger = tuple(name for name in group(file, OBSERVABLES) if name not in COUNTED_UNITS)
    table = sets_of_frames(systems, ledger, math.nan, 1, contacts=False)
    sets = {one.name: data_set(file, one.name, 1 + len(one.row)) for one in table if one.name != TIME}
    for present in systems:
        node = {sets[place].shape[1] for place in places_of(present.system)}
        if node != {present.count}:
            what = "bodies" if present is systems[0] else present.system.name
            raise ValueError(f"holds {'/'.join(map(str, sorted(node)))} {what}, not {present.count}")
    if count <= 0:
        raise ValueError("holds no frame: the run was killed before its first one, or has just started")
    refuse_too_many(path, sets, count)
    values = {name: one[:count] for name, one in sets.items()}
    measured = [values[f"{OBSERVABLES}/{name}"] for name in (*ledger, *COUNTED_UNITS)]
    steps, stored = values[STEP], sets[STEP].attrs["time_step"]
    if np.ndim(stored):
        raise ValueError(f"its time step of {stored} s is invalid")
    time_step = float(stored)
    if steps.dtype.kind != "i" or steps.min() < 0:
        raise ValueError("its step numbers are invalid")
    if not (math.isfinite(time_step * float(steps.max())) and time_step > 0.0):
        raise ValueError(f"its time step of {time_step:g} s is invalid")
    states = tuple(
        np.stack([values[place] for place in places_of(one.system)], axis=1, dtype=np.float64) for one in systems
    )
    contacts = _contacts(path, file, count, systems[0].count)
    return time_step, instruments.FrameRows(
        steps, states, np.stack(measured, axis=1, dtype=np.float64), ledger, contacts
    )


def _contacts(path: Path, file: Any, frames: int, bodies: int) -> trajectory.Contacts | None:
    """Return the contacts of the first frames of a file, None where none were stored.

    Raises KeyError or ValueError where columns are missing, do not go together or name no body.
    """
    if not file.id.links.exists(CONTACTS.encode()):
        return None
    ends = data_set(file, ENDS, 1)[:frames].astype(np.int64)
    if len(ends) != frames or (np.diff(ends, prepend=0) < 0).any():
        raise ValueError(f"{ENDS} does not count the contacts of {frames} frames")
    count = int(ends[-1]) if frames else 0
    sets = {one.name: data_set(file, one.name, 1) for one in sets_of_contacts()}
    refuse_too_many(path, sets, count, "contacts")
    rows = np.zeros(count, trajectory.CONTACT_ROW)
    for name, one in sets.items():
        rows[name.removeprefix(f"{CONTACTS}/")] = one[:count]
    for name, least in zip(trajectory.BODIES, (0, trajectory.SUPPORT), strict=True):
        if count and not (least <= rows[name].min() and rows[name].max() < bodies):
            raise ValueError(f"{CONTACTS}/{name} names bodies that are not among the {bodies}")
    return trajectory.Contacts(ends, rows)


APART = 10.0  # times what the last flush took: a tenth of a run at most
RESERVE = 1 << 18  # bytes


class FrameFile(AbstractContextManager["FrameFile"]):
    """Writes frames as they come; use as a context manager."""

    def __init__(self, path: Path, recorder: instruments.Recorder, scenario_toml: str, ledger: Sequence[str]) -> None:
        """Create the file with all its data sets, `ledger` names the energies; raises OutputError when that fails.

        It begins with the frames that the recorder holds from an earlier part of the run. Only with those on the disk
        it takes the place of an older file. The samples that probes hold are taken from them, written with the frames.
        """
        self.path, self.systems, self.probes = path, recorder.systems, recorder.probes
        time_step, chunk = recorder.time_step, chunk_rows(max(one.count for one in self.systems))
        self.sets = [*sets_of_frames(self.systems, ledger, time_step, chunk, contacts=recorder.with_contacts)]
        self.probe_sets = {
            name: [
                DataSet(f"{PROBES}/{name}/{PROBE_STEP}", "1", attrgetter("step"), np.int64),
                DataSet(f"{PROBES}/{name}/{PROBE_TIME}", "s", attrgetter("time")),
                *(DataSet(f"{PROBES}/{name}/{of}", unit, itemgetter(of)) for of, unit in units),
            ]
            for name, units in ((name, one.units.items()) for name, one in self.probes.series().items())
        }
        self.count = 0
        # open all the time: one that is closed writes its last chunks, and where that fails HDF5 crashes afterwards
        self.data_sets: dict[str, h5py.Dataset] = {}
        self.is_broken = self.has_failed = False
        self.waiting: list[instruments.Frame] = []
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
                self.file[STEP].attrs["time_step"] = time_step  # s
                self.file.swmr_mode = True
                self.waiting.extend(recorder.held)
                if self.waiting:  # and with them the samples of probes
                    self.sync()
                unnamed.chmod(files.permissions_of(path) or files.permissions_of(unnamed) or files.PERMISSIONS)
                unnamed.replace(path)
            except BaseException as error:
                if not isinstance(error, OSError | RuntimeError | OutputError):
                    self.file.close()
                unnamed.unlink(missing_ok=True)
                raise

    def _create(self, scenario_toml: str) -> None:
        """Create all data sets, those that grow empty."""
        h5md = self.file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1])
        h5md.create_group("creator").attrs["name"] = "blocksim"
        self._create_data_set(COMMITTED, "1", shape=(), dtype=np.int64)
        self.file.create_group(OBSERVABLES, track_order=True)  # readers list the energies as the scheme does
        for name, probe in self.probes.series().items():
            group = self.file.create_group(f"{PROBES}/{name}", track_order=True)
            group.attrs["kind"] = probe.kind
            self._create_data_set(f"{PROBES}/{name}/{COMMITTED}", "1", shape=(), dtype=np.int64)
        for one in itertools.chain(self.sets, *self.probe_sets.values()):
            # a scene may have no blocks; a chunk of nothing cannot be
            chunks, most = (one.chunk, *(size or 1 for size in one.row)), (None, *(size or None for size in one.row))
            form = {"shape": (0, *one.row), "dtype": one.kind, "maxshape": most, "chunks": chunks}
            self._create_data_set(one.name, one.unit, **form)
        for present in self.systems:
            for constant, values in present.constants():
                name = f"{PARTICLES}/{present.system.name}/{constant.name}"
                self._create_data_set(name, constant.unit.replace("/s", " s-1"), data=values)
        self._create_data_set(SCENARIO_TEXT, "TOML", data=np.bytes_(scenario_toml.encode()))

    def _create_data_set(self, name: str, unit: str, **form: Any) -> None:
        self.data_sets[name] = self.file.create_dataset(name, **form)
        self.data_sets[name].attrs["unit"] = unit

    def _reserve(self, size: int) -> None:
        """Make sure of the space on the disk, and of what HDF5 adds: after a write that fails it cannot continue."""
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self.file.id.get_vfd_handle(), self.file.id.get_filesize(), size + RESERVE)

    def append(self, frame: instruments.Frame) -> None:
        """Take one frame; writes what has come together a few times a second. Raises OutputError."""
        self.waiting.append(frame)
        self.keep_up()

    def keep_up(self) -> None:
        """Write what has come together, a few times a second; less often where that takes long. Raises OutputError."""
        if time.monotonic() - self.flushed_at > max(0.25, APART * self.flush_seconds):
            self.commit()

    def commit(self) -> None:
        """Bring all frames so far to the disk and then say how many there are. Raises OutputError (disk full …)."""
        began = time.monotonic()
        samples = {name: series for name, series in self.probes.series().items() if len(series)}
        for probe in self.probes.all:
            probe.rows.clear()
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
                    data_set = self.data_sets[one.name]
                    count = data_set.shape[0]
                    before = data_set[count - 1] if one.is_sum and count else 0
                    data_set.resize(count + len(values), axis=0)
                    data_set[count:] = before + values if one.is_sum else values
                self.count += len(self.waiting)
                self.waiting.clear()
                self.file.flush()
            for name in samples:
                steps = self.data_sets[f"{PROBES}/{name}/{PROBE_STEP}"]
                self.data_sets[f"{PROBES}/{name}/{COMMITTED}"][()] = steps.shape[0]
            self.data_sets[COMMITTED][()] = self.count
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
            self.is_broken = self.has_failed = True
            # HDF5 may crash where what it could not write is closed, at exit too
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self))
            raise OutputError(f"{self.path}: cannot be written: {_cause(error)}") from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, whatever happened; who asks for the second time to stop at once does not wait for frames."""
        self.is_broken |= kind is not None and not issubclass(kind, Exception)
        self.close()

    def close(self) -> None:
        """Commit, close the file normally, wait for the disk. Raises OutputError, once."""
        if self.is_broken:
            if not self.has_failed:
                with suppress(OSError, RuntimeError):
                    self.file.close()
            return
        self.commit()
        with self._locate_errors():
            self.file.close()
            with self.path.open("r+b") as file:  # cut off what was reserved, which HDF5 knows nothing of
                *_, end, _, _ = SUPERBLOCK.unpack(file.read(SUPERBLOCK.size))
                file.truncate(end)
            files.sync_file(self.path)  # no mark of a finished run may outlive its frames
