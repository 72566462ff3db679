"""Checkpoints: all that a run needs to continue with the same bits, when it is written, and where a run continues."""

import hashlib
import io
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Literal, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.kernels.common.arrays import zeros
from blocksim.options import Option
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.resolved import deciding_values
from blocksim.scenario.units import TIME, Quantity
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import atomic_file
from blocksim.simulation.folder import CHECKPOINTS
from blocksim.simulation.provenance import code_hashes, code_version, machine
from blocksim.simulation.recorder import Recorder, Rows, rows_of_frames
from blocksim.simulation.result import EventRecord, RestState
from blocksim.simulation.schemes import AnyScene
from blocksim.simulation.stores.hdf5 import read_probes, read_systems
from blocksim.world.build import arrays_of, with_parts
from blocksim.world.free_memory import available_bytes, readable

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
    settled: RestState | None = None  # how it came to rest before time zero, where it did
    resumed_from: tuple[int, ...] = ()  # steps at which earlier parts of the run were resumed
    events: tuple[EventRecord, ...] = ()  # that have happened so far


class Origin(BaseModel, frozen=True):
    """All that decides the bits of a run, taken apart so that differences can be named."""

    scenario: dict[str, Any]  # as blocksim.scenario.resolved.deciding_values
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

    @property
    def position(self) -> Position:
        """Where the run stood."""
        return self.head.position


def origin_of(scenario: Scenario) -> Origin:
    """Return what a run of a scenario comes from, here and now."""
    return Origin(
        scenario=deciding_values(scenario),
        versions={"blocksim": code_version(), **{name: metadata.version(name) for name in COMPILERS}},
        rooms=code_hashes(),
        machine=machine(),
    )


def write_checkpoint(path: Path, scene: AnyScene, position: Position, origin: Origin) -> None:
    """Write a checkpoint, which takes the place of an older one when it is on the disk. Raises OutputError."""
    arrays = arrays_of(scene)
    types = tuple(ArrayType(str(array.dtype), array.shape) for array in arrays)
    head = CheckpointHead(format=FORMAT, position=position, origin=origin, arrays=types)
    with atomic_file(path) as file:
        hashed = _Hashed(file)
        hashed.write(head.model_dump_json().encode() + b"\n")
        for array in arrays:
            content = np.frombuffer(np.ascontiguousarray(array).tobytes(), dtype=np.uint8)
            npy.write_array(hashed, content, allow_pickle=False)
        file.write(hashed.digest())


def read_checkpoint(path: Path) -> StoredCheckpoint:
    """Read a checkpoint. Raises InvalidInputError for one that is damaged, or none of ours."""
    try:
        return _read(path)
    except (OSError, ValueError, MemoryError, ValidationError) as error:  # memory: of an array of a forged size
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
        raise InvalidInputError(f"{path}: not a complete checkpoint: {reason}") from error


def _read(path: Path) -> StoredCheckpoint:
    size, available = path.stat().st_size, available_bytes()
    if available is not None and COPIES * size > available:
        raise ValueError(f"it has {readable(size)}, but only {readable(available)} of memory are free")
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
    if len(types) != len(arrays_of(built)):
        raise InvalidInputError(f"{stored.path}: its {len(types)} arrays do not fit this scene")
    scene: AnyScene = _filled(built, zip(types, arrays, strict=True), stored.path)
    return scene


def _filled(part: Any, arrays: Iterator[tuple[ArrayType, NDArray[np.uint8]]], path: Path) -> Any:
    if part is None:
        return None
    if isinstance(part, np.ndarray):
        return _array_like(part, *next(arrays), path)
    return with_parts(part, [_filled(one, arrays, path) for one in part])


def _array_like(built: NDArray[Any], kind: ArrayType, content: NDArray[np.uint8], path: Path) -> NDArray[Any]:
    """Return an array of the type of `built` with other content; its size may differ where lists have grown."""
    count = math.prod(kind.shape)
    is_alike = kind.dtype == str(built.dtype) and len(kind.shape) == built.ndim and min(kind.shape, default=0) >= 0
    if not is_alike or content.size != count * built.dtype.itemsize:
        raise InvalidInputError(f"{path}: an array {kind} does not fit this scene")
    array: NDArray[Any] = zeros(kind.shape, built.dtype).view(type(built))
    if count:
        array[...] = content.view(built.dtype).reshape(kind.shape)
    return array


class _Hashed:
    """A file to be written to, with the checksum of what was."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.hash = hashlib.sha256()

    def write(self, content: bytes) -> int:
        self.hash.update(content)
        return self.file.write(content)

    def digest(self) -> bytes:
        return self.hash.digest()


CHECKPOINT_SECONDS = 60.0
NEVER = sys.maxsize  # steps
SECONDS = Quantity(TIME, above=0.0)


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
    settled: RestState | None = None  # how it came to rest before time zero, where it did

    @classmethod
    def of(cls, path: Path, position: Position) -> "Past":
        """Return the past of a run that continues from a checkpoint."""
        parts = (*position.resumed_from, position.step)
        return cls(position.total_seconds, parts, path, position.step, position.settled)


NO_PAST = Past()


@dataclass
class CheckpointWriter:
    """Writes the checkpoints of one run into its folder."""

    folder: Path
    origin: Origin
    sync: Callable[[], None]  # brings all frames so far to the disk
    periods: tuple[int, ...] = ()  # in steps
    seconds: float = CHECKPOINT_SECONDS  # of wall time between two
    past: Past = NO_PAST

    def __post_init__(self) -> None:
        """Write nothing yet; the checkpoint that the run continues from is the last one to be replaced."""
        self.paths = sorted((self.folder / name for name in CHECKPOINTS), key=lambda path: path == self.past.checkpoint)
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
        whole = {"settled": self.past.settled, "resumed_from": self.past.resumed_from}
        total = self.past.seconds + time.monotonic() - self.began
        position = position.model_copy(update={**whole, "total_seconds": total})
        write_checkpoint(self.paths[0], scene, position, self.origin)
        self.paths.reverse()
        self.last_step, self.written_at = position.step, time.monotonic()


MOST_NAMED = 6  # differences in a message
NONE = "none"
REMEDY = "--overwrite starts again"
REMEDIES = f"{REMEDY}, --out DIR keeps both"
STARTS_ANEW = "the run starts again"


@dataclass(frozen=True)
class Resumption:
    """Where a run continues, and what its user should know about that."""

    checkpoint: StoredCheckpoint | None = None  # None: at the start
    remarks: tuple[str, ...] = ()


NEW = Resumption()


def find_resumption(folder: Path, scenario: Scenario) -> Resumption:
    """Return where the run of a scenario can continue in a folder.

    Raises InvalidInputError where another scenario or another version of the code has begun there, with what differs,
    or where no checkpoint is whole; OutputExistsError where the folder holds something else.
    """
    if not folder.exists() or not any(folder.iterdir()):
        return NEW
    files.check_folder(folder)
    paths = [folder / name for name in files.CHECKPOINTS if (folder / name).is_file()]
    if not paths:
        _refuse_other_start(folder, scenario)
        return Resumption(remarks=(f"{folder}: no checkpoint saved; {STARTS_ANEW}",))
    return _newest_good(paths, scenario)


def remarks_on(found: Resumption, folder: Path) -> Iterator[str]:
    """Yield what the user of a run that is to be resumed should know, a line each."""
    yield from found.remarks
    if found.checkpoint is not None:
        position = found.checkpoint.position
        yield f"resuming at step {position.step} ({position.frames} frames recorded): {folder}"
    if found is NEW:
        for other in files.unfinished_siblings(folder):
            yield f"nothing to resume in {folder}; an unfinished run of another scenario or code version is in {other}"


def stored_frames(folder: Path, recorder: Recorder) -> Rows:
    """Return the frames at output times that an earlier part of a run has left. Raises what reading them raises.

    Frames after the checkpoint are among them, as the run would only repeat them; that of the moment at which it was
    stopped is not.
    """
    rows = rows_of_frames(read_systems(folder / files.FRAMES, recorder.systems))
    return rows.chosen(np.array([recorder.is_output_time(step) for step in rows.steps.tolist()]))


def check_frames(stored: StoredCheckpoint, recorder: Recorder) -> None:
    """Raise InvalidInputError where frames before a checkpoint are missing, or are not as they were recorded.

    `recorder` has taken over all frames that there are.
    """
    position = stored.position
    path, count = stored.path.parent / files.FRAMES, recorder.count_until(position.step)
    if count != position.frames:
        raise InvalidInputError(
            f"{path}: holds {count} of the {position.frames} frames before step {position.step}, at which "
            f"{stored.path.name} resumes; {REMEDY}"
        )
    if recorder.digest_until(position.step) != position.frames_sha256:
        raise InvalidInputError(
            f"{path}: changed after the interruption: the {count} frames before step {position.step} do not "
            f"match the SHA-256 in {stored.path.name}; {REMEDY}"
        )


def take_over_probes(stored: StoredCheckpoint, scenario: Scenario, recorder: Recorder) -> None:
    """Begin with the samples of probes before a checkpoint. Raises InvalidInputError where some are missing."""
    if recorder.probes.all:
        path = stored.path.parent / files.FRAMES
        missing = recorder.probes.take_over(read_probes(path, scenario), stored.position.step)
        if missing:
            where = f"before step {stored.position.step}, at which {stored.path.name} resumes"
            raise InvalidInputError(f"{path}: samples of probe {missing[0]} are missing {where}; {REMEDY}")


def _newest_good(paths: list[Path], scenario: Scenario) -> Resumption:
    """Return the checkpoint of the most steps among those that are whole."""
    remarks: list[str] = []
    whole: list[StoredCheckpoint] = []
    for path in paths:
        try:
            whole.append(read_checkpoint(path))
        except InvalidInputError as error:
            remarks.append(str(error))
    whole.sort(key=lambda stored: stored.position.step)
    if not whole:
        raise InvalidInputError("\n".join([*remarks, f"{paths[0].parent}: no checkpoint is complete; {REMEDY}"]))
    newest, origin = whole[-1], origin_of(scenario)
    refuse_other(newest.path, newest.head.origin, origin)
    if remarks:
        remarks.append(f"resuming from the other checkpoint, {newest.path.name}")
    if newest.head.origin.machine != origin.machine:
        was = newest.head.origin.machine
        remarks.append(f"this part runs on another machine than before ({was}): the last digits may differ")
    return Resumption(newest, tuple(remarks))


def _refuse_other_start(folder: Path, scenario: Scenario) -> None:
    """Raise InvalidInputError where the unfinished run in a folder is of another scenario."""
    path = folder / files.SCENARIO
    try:
        begun = load_stored(path)
    except BlocksimError:  # killed before it was written, or damaged: there is nothing in this folder to lose
        return
    refuse_other_scenario(path, deciding_values(begun), deciding_values(scenario))


def refuse_other(path: Path, old: Origin, new: Origin) -> None:
    """Raise InvalidInputError, which names what differs, where a run would continue to other bits."""
    refuse_other_scenario(path, old.scenario, new.scenario)
    changed = [*_changed(old.versions, new.versions)]
    if changed:
        raise InvalidInputError(f"{path}: of another version of the code: {_listed(changed)}; {REMEDIES}")
    rooms = [room for room in new.rooms if old.rooms.get(room) != new.rooms[room]]
    if rooms:
        where = _listed([f"blocksim/{room}" for room in rooms])
        raise InvalidInputError(f"{path}: of another version of the code: it differs in {where}; {REMEDIES}")


def refuse_other_scenario(path: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Raise InvalidInputError, which names the keys, where two scenarios differ in what decides the motion."""
    changed = [*_changed(dict(_flat(old)), dict(_flat(new)))]
    if changed:
        raise InvalidInputError(f"{path}: of another scenario: {_listed(changed)}; {REMEDIES}")


def _flat(data: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield all values with their keys, as --set names them."""
    entries: Sequence[tuple[object, object]] = ()
    if isinstance(data, Mapping):
        entries = [*data.items()]
    elif isinstance(data, list | tuple):
        entries = [*enumerate(data)]
    else:
        yield key, data
    for name, value in entries:
        yield from _flat(value, f"{key}.{name}" if key else str(name))


def _changed(old: Mapping[str, object], new: Mapping[str, object]) -> Iterator[str]:
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key), new.get(key)
        if before != after:
            yield f"{key} {_shown(before)} -> {_shown(after)}"


def _shown(value: object) -> str:
    return NONE if value is None else str(value)


def _listed(changed: Sequence[str]) -> str:
    more = len(changed) - MOST_NAMED
    return ", ".join(changed[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
