"""All frames of a run as one temporal VTKHDF file, which ParaView opens: every block a rectangle.

After the VTKHDF format specification, version 2.0 (docs.vtk.org): an unstructured grid whose cells stay the same while
its points and the data of its cells have a part for every time. `Steps` says where each time's parts begin.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError
from blocksim.simulation.atomic import replacing
from blocksim.simulation.frames import Frames

VERSION = (2, 0)
QUAD = 9  # VTK's number of a cell with four corners
CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # counter-clockwise
BATCH = 1 << 16  # blocks times frames that are computed at once
CHUNK = 1 << 14  # rows of a data set that are packed together
PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
DATA = {"velocity_m_s": 3, "rotation_deg": 1, "spin_deg_s": 1}  # of the blocks at every time, with components
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


def write_vtkhdf(path: Path, frames: Frames) -> int:
    """Write all frames in which every number is finite and return their number.

    Points in m, z = 0. Beside the VTK group the names of the blocks are kept, `blocksim/block_names`, in the order of
    the cells. Raises InvalidInputError when there is nothing to write, and OutputError.
    """
    chosen = _finite(frames)
    with replacing(path) as temporary:
        try:
            with h5py.File(temporary, "w") as file:
                _write_grid(file.create_group("VTKHDF"), frames, chosen)
                names = [name.encode() for name in frames.names]
                file.create_dataset("blocksim/block_names", data=names, dtype=h5py.string_dtype())
        except RuntimeError as error:  # what HDF5 raises when a disk is full
            message = f"{path}: cannot be written: {error}"
            raise OutputError(message) from error
    return len(chosen)


def _finite(frames: Frames) -> Indices:
    """Return the frames that can be shown; a failed run may end in others."""
    finite = np.isfinite(frames.time)
    for field in (frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin):
        finite &= np.isfinite(field).all(axis=1)
    chosen = np.flatnonzero(finite)
    if len(chosen) == 0 or len(frames.names) == 0:
        message = "there is no frame to export"
        raise InvalidInputError(message)
    return chosen


def _write_grid(group: Any, frames: Frames, chosen: Indices) -> None:
    blocks = len(frames.names)
    group.attrs["Version"] = np.array(VERSION, dtype=np.int64)
    group.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    _write_cells(group, blocks)
    _write_steps(group.create_group("Steps"), frames.time[chosen], blocks)
    _write_times(group, frames, chosen)


def _write_cells(group: Any, blocks: int) -> None:
    """Write what stays the same: how points make cells, and the number of every block."""
    for name, count in (
        ("NumberOfPoints", 4 * blocks),
        ("NumberOfCells", blocks),
        ("NumberOfConnectivityIds", 4 * blocks),
    ):
        group[name] = np.array([count], dtype=np.int64)
    group["Connectivity"] = np.arange(4 * blocks, dtype=np.int64)
    group["Offsets"] = 4 * np.arange(blocks + 1, dtype=np.int64)
    group["Types"] = np.full(blocks, QUAD, dtype=np.uint8)
    group["CellData/block"] = np.arange(1, blocks + 1, dtype=np.int64)


def _write_steps(group: Any, times: Floats, blocks: int) -> None:
    """Write the times (s) and where the parts of each of them begin."""
    count = len(times)
    first, zero = np.arange(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    group.attrs["NSteps"] = np.int64(count)
    group["Values"] = times
    group["NumberOfParts"] = zero + 1
    group["PartOffsets"] = zero
    group["PointOffsets"] = 4 * blocks * first
    group["CellOffsets"] = zero[:, None]
    group["ConnectivityIdOffsets"] = zero[:, None]
    group["CellDataOffsets/block"] = zero
    for name in DATA:
        group[f"CellDataOffsets/{name}"] = blocks * first


def _write_times(group: Any, frames: Frames, chosen: Indices) -> None:
    """Write what changes: points, and the data of the cells."""
    blocks = len(frames.names)
    points = _created(group, "Points", 4 * blocks * len(chosen), 3)
    data = {name: _created(group, f"CellData/{name}", blocks * len(chosen), size) for name, size in DATA.items()}
    size = max(1, BATCH // blocks)
    for start in range(0, len(chosen), size):
        some = chosen[start : start + size]
        first, last = start * blocks, (start + len(some)) * blocks
        points[4 * first : 4 * last] = _corners(frames, some)
        velocity = np.stack([frames.vx[some], frames.vy[some], np.zeros_like(frames.vx[some])], axis=-1)
        data["velocity_m_s"][first:last] = velocity.reshape(-1, 3)
        data["rotation_deg"][first:last] = np.degrees(frames.rotation[some]).ravel()
        data["spin_deg_s"][first:last] = np.degrees(frames.spin[some]).ravel()


def _created(group: Any, name: str, rows: int, components: int) -> Any:
    shape = (rows,) if components == 1 else (rows, components)
    chunks = (min(rows, CHUNK), *shape[1:])
    return group.create_dataset(name, shape, dtype=np.float64, chunks=chunks, **PACKED)


def _corners(frames: Frames, some: Indices) -> Floats:
    """Return the corners (m) of all blocks in some frames, (4 * blocks * frames, 3)."""
    local = CORNERS * np.stack([frames.size_x, frames.size_y], axis=-1)[:, None]
    cosine, sine = np.cos(frames.angle[some])[..., None], np.sin(frames.angle[some])[..., None]
    x = frames.x[some][..., None] + cosine * local[..., 0] - sine * local[..., 1]
    y = frames.y[some][..., None] + sine * local[..., 0] + cosine * local[..., 1]
    return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
