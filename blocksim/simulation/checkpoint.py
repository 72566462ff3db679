"""Checkpoints: all that a run needs to continue with the same bits, when it is written, and where a run continues."""

import hashlib
import io
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.kernels.common.arrays import zeros
from blocksim.options import Option
from blocksim.scenario import Model, Scenario, resolution, units
from blocksim.simulation import files, instruments, provenance, results, safety
from blocksim.simulation.schemes import AnyScene
from blocksim.simulation.stores.hdf5 import read_probes, read_rows
from blocksim.world import build, free_memory

FORMAT: Literal["blocksim checkpoint 1"] = "blocksim checkpoint 1"
COPIES = 3  # of the content, while it is read: the file, its arrays, the scene
DIGEST_BYTES = hashlib.sha256().digest_size
COMPILERS = ("numba", "llvmlite", "numpy")


class Position(BaseModel, frozen=True):
    """Where a run stands, beside its arrays."""

    step: int  # steps done
    frames: int  # recorded so far, at output times
    frames_sha256: str  # of their bits
    start_energy: float  # J, that of the ledger
    solver_seconds: float  # of wall time, in all parts so far
    total_seconds: float = 0.0
    threads: int  # that it ran on; it can continue with any number
    settled: results.RestState | None = None  # how it came to rest before time zero, where it did
    joints: dict[str, safety.Safety] = {}  # then
    resumed_from: tuple[int, ...] = ()  # steps at which earlier parts of the run were resumed
    events: tuple[results.EventRecord, ...] = ()  # that have happened so far


class Origin(BaseModel, frozen=True):
    """All that decides the bits of a run, taken apart so that differences can be named."""

    scenario: dict[str, Any]  # as blocksim.scenario.resolution.deciding_values
    versions: dict[str, str]  # of blocksim and of what compiles it
    rooms: dict[str, str]  # hash of every folder of code that decides bits
    machine: str  # processor and system: the last digit of a sine may depend on them


class ArrayType(NamedTuple):
    """What an array consists of."""

    dtype: str
    shape: tuple[int, ...]


class CheckpointHead(BaseModel, frozen=True):
    """What a checkpoint says before its arrays."""

    format: Literal["blocksim checkpoint 1"]
    position: Position
    origin: Origin
    arrays: tuple[ArrayType, ...]


class StoredCheckpoint(NamedTuple):
    """A checkpoint that was read and found to be whole."""

    path: Path
    head: CheckpointHead
    arrays: tuple[NDArray[np.uint8], ...]


def origin_of(scenario: Scenario) -> Origin:
    """Return what a run of a scenario comes from, here and now."""
    return Origin(
        scenario=resolution.deciding_values(scenario),
        versions={"blocksim": provenance.code_version(), **{name: metadata.version(name) for name in COMPILERS}},
        rooms=provenance.code_hashes(),
        machine=provenance.machine(),
    )


def write_checkpoint(path: Path, scene: AnyScene, position: Position, origin: Origin) -> None:
    """Write a checkpoint, which takes the place of an older one when it is on the disk. Raises OutputError."""
    arrays = build.arrays_of(scene)
    types = tuple(ArrayType(str(array.dtype), array.shape) for array in arrays)
    head = CheckpointHead(format=FORMAT, position=position, origin=origin, arrays=types)
    digest = hashlib.sha256()
    with files.atomic_file(path) as file:
        for array in (None, *arrays):
            part = io.BytesIO()
            if array is None:
                part.write(head.model_dump_json().encode() + b"\n")
            else:
                npy.write_array(part, np.frombuffer(array.tobytes(), dtype=np.uint8), allow_pickle=False)
            digest.update(part.getbuffer())
            file.write(part.getbuffer())
        file.write(digest.digest())


def read_checkpoint(path: Path) -> StoredCheckpoint:
    """Read a checkpoint. Raises InvalidInputError for one that is damaged, or none of ours."""
    try:
        return _read(path)
    except (OSError, ValueError, MemoryError, ValidationError) as error:  # memory: of an array of a forged size
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
        raise InvalidInputError(f"{path}: not a complete checkpoint: {reason}") from error


def _read(path: Path) -> StoredCheckpoint:
    size, available = path.stat().st_size, free_memory.available_bytes()
    if available is not None and COPIES * size > available:
        needed, free = map(free_memory.readable, (size, available))
        raise ValueError(f"it has {needed}, but only {free} of memory are free")
    content = path.read_bytes()
    body, digest = content[:-DIGEST_BYTES], content[-DIGEST_BYTES:]
    if hashlib.sha256(body).digest() != digest:
        raise ValueError("its checksum does not match its content")
    file = io.BytesIO(body)
    head = CheckpointHead.model_validate_json(file.readline())
    arrays = tuple(np.asarray(npy.read_array(file, allow_pickle=False)) for _ in head.arrays)
    if any(array.dtype != np.uint8 or array.ndim != 1 for array in arrays):
        raise ValueError("an array is not an array of bytes")
    return StoredCheckpoint(path, head, arrays)


def restore_scene(stored: StoredCheckpoint, built: AnyScene) -> AnyScene:
    """Return the scene of a checkpoint; `built` is the same scene at time zero, whose types its arrays get.

    Raises InvalidInputError for arrays of another scene.
    """
    types, arrays = stored.head.arrays, stored.arrays
    if len(types) != len(build.arrays_of(built)):
        raise InvalidInputError(f"{stored.path}: its {len(types)} arrays do not fit this scene")
    scene: AnyScene = _filled(built, zip(types, arrays, strict=True), stored.path)
    return scene


def _filled(part: Any, contents: Iterator[tuple[ArrayType, NDArray[np.uint8]]], path: Path) -> Any:
    """Return a part of a scene with other contents; the size of an array may differ where lists have grown."""
    if part is None:
        return None
    if not isinstance(part, np.ndarray):
        return build.with_parts(part, [_filled(one, contents, path) for one in part])
    kind, content = next(contents)
    count = math.prod(kind.shape)
    is_alike = kind.dtype == str(part.dtype) and len(kind.shape) == part.ndim and min(kind.shape, default=0) >= 0
    if not is_alike or content.size != count * part.dtype.itemsize:
        raise InvalidInputError(f"{path}: an array {kind} does not fit this scene")
    array: NDArray[Any] = zeros(kind.shape, part.dtype).view(type(part))
    if count:
        array[...] = content.view(part.dtype).reshape(kind.shape)
    return array


CHECKPOINT_SECONDS = 60.0
NEVER = sys.maxsize  # steps
SECONDS = units.Quantity(units.TIME, above=0.0)


@dataclass(frozen=True)
class CheckpointPolicy:
    """When a run writes checkpoints, and after which wall time it stops by itself.

    Checkpoints are written at whatever comes first. A run that is stopped writes one anyway.
    """

    checkpoint_seconds: Annotated[
        float,
        Option(
            "Wall time between checkpoints (default: 60 s).",
            flags=("--checkpoint-every",),
            metavar="TIME",
            read=SECONDS.read,
            show_default=False,
        ),
    ] = CHECKPOINT_SECONDS  # of wall time between two
    checkpoint_steps: Annotated[int | None, Option("Steps between checkpoints.", metavar="N", least=1)] = None
    checkpoint_time: Annotated[
        float | None, Option("Simulated time between checkpoints.", metavar="TIME", read=SECONDS.read)
    ] = None  # s
    wall_time: Annotated[
        float | None,
        Option('Stop after this wall time, e.g. "90 min", as Ctrl-C does.', metavar="TIME", read=SECONDS.read),
    ] = None  # s
    time_over: float = 0.0  # s of them that are over before the run begins

    def periods(self, step: float) -> tuple[int, ...]:
        """Return the numbers of steps (s) after which checkpoints are due."""
        simulated = None if self.checkpoint_time is None else max(1, round(self.checkpoint_time / step))
        return tuple(period for period in (self.checkpoint_steps, simulated) if period is not None)


DEFAULTS = CheckpointPolicy()


@dataclass(frozen=True)
class Past:
    """What the parts of a run before this one have left."""

    seconds: float = 0.0  # of wall time
    resumed_from: tuple[int, ...] = ()
    checkpoint: Path | None = None  # from which this part continues
    step: int | None = None  # of that checkpoint
    settled: results.RestState | None = None  # how it came to rest before time zero, where it did
    joints: dict[str, safety.Safety] = field(default_factory=dict)  # then


@dataclass
class CheckpointWriter:
    """Writes the checkpoints of one run into its folder."""

    folder: Path
    origin: Origin
    sync: Callable[[], None]  # brings all frames so far to the disk
    periods: tuple[int, ...] = ()  # in steps
    seconds: float = CHECKPOINT_SECONDS  # of wall time between two
    past: Past = Past()

    def __post_init__(self) -> None:
        """Write nothing yet; the checkpoint that the run continues from is the last one to be replaced."""
        self.paths = sorted(
            (self.folder / name for name in files.CHECKPOINTS), key=lambda path: path == self.past.checkpoint
        )
        self.last_step = self.past.step
        self.began = self.written_at = time.monotonic()

    def next_step(self, done: int) -> int:
        """Return the step after `done` at which the loop has to stop for a checkpoint."""
        return min(((done // period + 1) * period for period in self.periods), default=NEVER)

    def is_due(self, done: int) -> bool:
        """Return True if one is to be written now."""
        return any(done % period == 0 for period in self.periods) or (
            time.monotonic() - self.written_at >= self.seconds
        )

    def write(self, scene: AnyScene, position: Position) -> None:
        """Write one, once the frames before it are on the disk. Raises OutputError.

        `position` is what the time loop knows; what earlier parts have left is added.
        """
        if position.step == self.last_step:
            return
        self.sync()
        whole = {"settled": self.past.settled, "joints": self.past.joints, "resumed_from": self.past.resumed_from}
        total = self.past.seconds + time.monotonic() - self.began
        position = position.model_copy(update={**whole, "total_seconds": total})
        write_checkpoint(self.paths[0], scene, position, self.origin)
        self.paths.reverse()
        self.last_step, self.written_at = position.step, time.monotonic()


MOST_NAMED = 6  # differences in a message
REMEDY = "--overwrite starts again"
STARTS_ANEW = "the run starts again"
REMEDIES = f"{REMEDY}, --out DIR keeps both"


@dataclass(frozen=True)
class Resumption:
    """Where a run continues, and what its user should know about that."""

    checkpoint: StoredCheckpoint | None = None  # None: at the start
    remarks: tuple[str, ...] = ()  # that the summary keeps as warnings
    notes: tuple[str, ...] = ()


def find_resumption(folder: Path, scenario: Scenario) -> Resumption:
    """Return where the run of a scenario can continue in a folder: at the checkpoint of the most steps that is whole.

    Raises InvalidInputError where another scenario or another version of the code has begun there, with what differs,
    or where no checkpoint is whole; OutputExistsError where the folder holds something else.
    """
    if not folder.exists() or not any(folder.iterdir()):
        which = "an unfinished run of another scenario or code version is in"
        beside = {path.parent for name in files.CHECKPOINTS for path in folder.parent.glob(f"*/{name}")} - {folder}
        others = (place for place in sorted(beside) if not (place / files.DONE).is_file())
        return Resumption(notes=tuple(f"nothing to resume in {folder}; {which} {other}" for other in others))
    files.check_folder(folder)
    paths = [folder / name for name in files.CHECKPOINTS if (folder / name).is_file()]
    if not paths:
        path = folder / files.SCENARIO
        try:
            begun = Model.stored(path).scenario
        except BlocksimError:  # killed before it was written, or damaged: there is nothing here to lose
            begun = scenario
        _refuse_other(path, "scenario", resolution.deciding_values(begun), resolution.deciding_values(scenario))
        return Resumption(remarks=(f"{folder}: no checkpoint saved; {STARTS_ANEW}",))
    remarks: list[str] = []
    whole: list[StoredCheckpoint] = []
    for path in paths:
        try:
            whole.append(read_checkpoint(path))
        except InvalidInputError as error:
            remarks.append(str(error))
    whole.sort(key=lambda stored: stored.head.position.step)
    if not whole:
        raise InvalidInputError("\n".join([*remarks, f"{folder}: no checkpoint is complete; {REMEDY}"]))
    newest, origin = whole[-1], origin_of(scenario)
    was, position = newest.head.origin, newest.head.position
    _refuse_other(newest.path, "scenario", was.scenario, origin.scenario)
    _refuse_other(newest.path, "version of the code", was.versions, origin.versions)
    rooms = [f"blocksim/{room}" for room in origin.rooms if was.rooms.get(room) != origin.rooms[room]]
    if rooms:
        what = f"of another version of the code: it differs in {', '.join(rooms)}"
        raise InvalidInputError(f"{newest.path}: {what}; {REMEDIES}")
    if remarks:
        remarks.append(f"resuming from the other checkpoint, {newest.path.name}")
    if was.machine != origin.machine:
        remarks.append(f"this part runs on another machine than before ({was.machine}): the last digits may differ")
    note = f"resuming at step {position.step} ({position.frames} frames recorded): {folder}"
    return Resumption(newest, tuple(remarks), (note,))


def take_over(stored: StoredCheckpoint, model: Model, recorder: instruments.Recorder) -> None:
    """Let a recorder begin with the frames at output times, and samples of probes, that earlier parts have left.

    Raises what reading them raises, and InvalidInputError where some before the checkpoint are missing, or are not as
    they were recorded.
    """
    position, path = stored.head.position, stored.path.parent / files.FRAMES
    _, rows = read_rows(path, recorder.systems)
    recorder.take_over(rows)
    count = recorder.count_until(position.step)
    before = f"before step {position.step}, at which {stored.path.name} resumes; {REMEDY}"
    if count != position.frames:
        raise InvalidInputError(f"{path}: holds {count} of the {position.frames} frames {before}")
    if recorder.digest_until(position.step) != position.frames_sha256:
        raise InvalidInputError(
            f"{path}: changed after the interruption: the {count} frames before step {position.step} do not "
            f"match the SHA-256 in {stored.path.name}; {REMEDY}"
        )
    kept = read_probes(path, model) if recorder.probes.all else {}
    for probe in recorder.probes.all:
        if probe.name not in kept or not probe.take_over(kept[probe.name], position.step):
            raise InvalidInputError(f"{path}: samples of probe {probe.name} are missing {before}")


def _refuse_other(path: Path, what: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Raise InvalidInputError, which names what differs, where a run would continue to other bits."""
    before, after = dict(_flat(old)), dict(_flat(new))
    pairs = [(key, before.get(key), after.get(key)) for key in dict.fromkeys([*before, *after])]
    changed = [
        " ".join([key, *("none" if one is None else str(one) for one in (was, "->", now))])
        for key, was, now in pairs
        if was != now
    ]
    if changed:
        more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
        listed = ", ".join(changed[:MOST_NAMED]) + more
        raise InvalidInputError(f"{path}: of another {what}: {listed}; {REMEDIES}")


def _flat(data: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield all values with their keys, as --set names them."""
    entries: Iterable[tuple[object, object]] = ()
    if isinstance(data, Mapping):
        entries = data.items()
    elif isinstance(data, list | tuple):
        entries = enumerate(data)
    else:
        yield key, data
    for name, value in entries:
        yield from _flat(value, f"{key}.{name}" if key else str(name))
