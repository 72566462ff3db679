"""One checkpoint: everything that a run needs to continue with the same bits, in one file with its checksum.

The file is a line of JSON (the head: where the run stood and what decides its bits), then all arrays of the scene as
npy data of bytes, then the SHA-256 of all that. Nothing in it can be executed when it is read.
"""

import hashlib
import io
import math
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, BinaryIO, Literal, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from blocksim.errors import InvalidInputError
from blocksim.kernels.common.arrays import zeros
from blocksim.scenario import Scenario
from blocksim.scenario.resolved import deciding_values
from blocksim.simulation.atomic import writing
from blocksim.simulation.happened import Happened
from blocksim.simulation.provenance import code_hashes, code_version, machine
from blocksim.simulation.schemes import AnyScene
from blocksim.simulation.settled import Settled
from blocksim.world.free_memory import available_bytes, readable
from blocksim.world.scenes import arrays_of, with_parts

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
    settled: Settled | None = None  # how it came to rest before time zero, where it did
    resumed_from: tuple[int, ...] = ()  # steps at which earlier parts of the run were resumed
    events: tuple[Happened, ...] = ()  # that have happened so far


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


class Head(BaseModel, frozen=True):
    """What a checkpoint says before its arrays."""

    format: Literal["blocksim checkpoint 1"]
    position: Position
    origin: Origin
    arrays: tuple[ArrayType, ...]


class Stored(NamedTuple):
    """A checkpoint that was read and found to be whole."""

    path: Path
    head: Head
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
    head = Head(format=FORMAT, position=position, origin=origin, arrays=types)
    with writing(path) as file:
        hashed = _Hashed(file)
        hashed.write(head.model_dump_json().encode() + b"\n")
        for array in arrays:
            content = np.frombuffer(np.ascontiguousarray(array).tobytes(), dtype=np.uint8)
            npy.write_array(hashed, content, allow_pickle=False)
        file.write(hashed.digest())


def read_checkpoint(path: Path) -> Stored:
    """Read a checkpoint. Raises InvalidInputError for one that is damaged, or none of ours."""
    try:
        return _read(path)
    except (OSError, ValueError, MemoryError, ValidationError) as error:  # memory: of an array of a forged size
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
        raise InvalidInputError(f"{path}: not a complete checkpoint: {reason}") from error


def _read(path: Path) -> Stored:
    size, available = path.stat().st_size, available_bytes()
    if available is not None and COPIES * size > available:
        raise ValueError(f"it has {readable(size)}, but only {readable(available)} of memory are free")
    content = path.read_bytes()
    body, digest = content[:-DIGEST_BYTES], content[-DIGEST_BYTES:]
    if hashlib.sha256(body).digest() != digest:
        raise ValueError("its checksum does not match its content")
    file = io.BytesIO(body)
    head = Head.model_validate_json(file.readline())
    arrays = tuple(np.asarray(npy.read_array(file, allow_pickle=False)) for _ in head.arrays)
    if any(array.dtype != np.uint8 or array.ndim != 1 for array in arrays):
        raise ValueError("an array is not an array of bytes")
    return Stored(path, head, arrays)


def restored(stored: Stored, built: AnyScene) -> AnyScene:
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
