"""All frames of a run as one temporal VTKHDF file, which ParaView opens: every block a rectangle, ground and walls too.

After the VTKHDF format specification, version 2.0 (docs.vtk.org): an unstructured grid whose cells stay the same while
its points and the data of its cells have a part for every time. `Steps` says where each time's parts begin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.motion import displacement_and_velocity, motion_direction, motion_pieces
from blocksim.scenario.segments import wall_segments
from blocksim.simulation.atomic import replacing
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.hdf5_sink import SafeFile

VERSION = (2, 0)
QUAD = 9  # VTK's number of a cell with four corners
CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # counter-clockwise
BATCH = 1 << 16  # blocks times frames that are computed at once
CHUNK = 1 << 14  # rows of a data set that are packed together
PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
DATA = {"velocity_m_s": 3, "rotation_deg": 1, "spin_deg_s": 1}  # of the cells at every time, with components
BEYOND = 2.0  # diagonals of the largest block; so far the ground reaches beyond all blocks
THICKNESS = 0.25  # of the smallest side of all blocks
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Supports:
    """Ground and walls: corners (m, (q, 4, 2)) at rest; displacement (m) and velocity (m/s) at every frame, (n, 2)."""

    quads: Floats
    displacement: Floats
    velocity: Floats


def write_vtkhdf(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write all frames in which every number is finite and return their number.

    Points in m, z = 0. The cells of the blocks come first; ground and walls follow as cells of block number 0. Beside
    the VTK group the names of the blocks are kept, `blocksim/block_names`, in the order of the cells. Raises
    InvalidInputError when there is nothing to write, and OutputError.
    """
    chosen = _finite(frames)
    supports = Supports(support_quads(scenario, frames), *support_motion(scenario, frames.time))
    with replacing(path) as temporary, SafeFile(temporary) as safe:
        _write_grid(safe.file.create_group("VTKHDF"), frames, chosen, supports, safe.check)
        names = [name.encode() for name in frames.names]
        safe.file.create_dataset("blocksim/block_names", data=names, dtype=h5py.string_dtype())
    return len(chosen)


def _finite(frames: Frames) -> Indices:
    """Return the frames that can be shown; a failed run may end in others."""
    finite = np.isfinite(frames.time)
    for field in (frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin):
        finite &= np.isfinite(field).all(axis=1)
    chosen = np.flatnonzero(finite)
    if len(chosen) == 0 or len(frames.names) == 0:
        message = "no frame to export"
        raise InvalidInputError(message)
    return chosen


def _write_grid(group: Any, frames: Frames, chosen: Indices, supports: Supports, check: Callable[[], None]) -> None:
    blocks = len(frames.names)
    cells = blocks + len(supports.quads)
    group.attrs["Version"] = np.array(VERSION, dtype=np.int64)
    group.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    _write_cells(group, blocks, cells)
    _write_steps(group.create_group("Steps"), frames.time[chosen], cells)
    _write_times(group, frames, chosen, supports, check)


def _write_cells(group: Any, blocks: int, cells: int) -> None:
    """Write what stays the same: how points make cells, and the number of every block; 0 for what is none."""
    for name, count in (
        ("NumberOfPoints", 4 * cells),
        ("NumberOfCells", cells),
        ("NumberOfConnectivityIds", 4 * cells),
    ):
        group[name] = np.array([count], dtype=np.int64)
    group["Connectivity"] = np.arange(4 * cells, dtype=np.int64)
    group["Offsets"] = 4 * np.arange(cells + 1, dtype=np.int64)
    group["Types"] = np.full(cells, QUAD, dtype=np.uint8)
    numbers = np.zeros(cells, dtype=np.int64)
    numbers[:blocks] = np.arange(1, blocks + 1)
    group["CellData/block"] = numbers


def _write_steps(group: Any, times: Floats, cells: int) -> None:
    """Write the times (s) and where the parts of each of them begin."""
    count = len(times)
    first, zero = np.arange(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    group.attrs["NSteps"] = np.int64(count)
    group["Values"] = times
    group["NumberOfParts"] = zero + 1
    group["PartOffsets"] = zero
    group["PointOffsets"] = 4 * cells * first
    group["CellOffsets"] = zero[:, None]
    group["ConnectivityIdOffsets"] = zero[:, None]
    group["CellDataOffsets/block"] = zero
    for name in DATA:
        group[f"CellDataOffsets/{name}"] = cells * first


def _write_times(group: Any, frames: Frames, chosen: Indices, supports: Supports, check: Callable[[], None]) -> None:
    """Write what changes: points, and the data of the cells; `check` raises where the disk is full by now."""
    cells = len(frames.names) + len(supports.quads)
    points = _created(group, "Points", 4 * cells * len(chosen), 3)
    data = {name: _created(group, f"CellData/{name}", cells * len(chosen), size) for name, size in DATA.items()}
    size = max(1, BATCH // cells)
    for start in range(0, len(chosen), size):
        some = chosen[start : start + size]
        first, last = start * cells, (start + len(some)) * cells
        points[4 * first : 4 * last] = _corners(frames, some, supports)
        data["velocity_m_s"][first:last] = _velocities(frames, some, supports)
        data["rotation_deg"][first:last] = _with_zeros(np.degrees(frames.rotation[some]), supports)
        data["spin_deg_s"][first:last] = _with_zeros(np.degrees(frames.spin[some]), supports)
        check()


def _velocities(frames: Frames, some: Indices, supports: Supports) -> Floats:
    """Return the velocities (m/s) of all cells in some frames, (cells * frames, 3)."""
    blocks = np.stack([frames.vx[some], frames.vy[some]], axis=-1)
    others = np.repeat(supports.velocity[some][:, None], len(supports.quads), axis=1)
    return _in_space(np.concatenate([blocks, others], axis=1))


def _with_zeros(values: Floats, supports: Supports) -> Floats:
    """Return the values of blocks in some frames with zeros for what never turns, (cells * frames,)."""
    return np.pad(values, ((0, 0), (0, len(supports.quads)))).ravel()


def _in_space(plane: Floats) -> Floats:
    """Return vectors (..., 2) with a third component of zero, one after the other."""
    return np.pad(plane.reshape(-1, 2), ((0, 0), (0, 1)))


def _created(group: Any, name: str, rows: int, components: int) -> Any:
    shape = (rows,) if components == 1 else (rows, components)
    chunks = (min(rows, CHUNK), *shape[1:])
    return group.create_dataset(name, shape, dtype=np.float64, chunks=chunks, **PACKED)


def _corners(frames: Frames, some: Indices, supports: Supports) -> Floats:
    """Return the corners (m) of all cells in some frames, (4 * cells * frames, 3)."""
    local = CORNERS * np.stack([frames.size_x, frames.size_y], axis=-1)[:, None]
    cosine, sine = np.cos(frames.angle[some])[..., None], np.sin(frames.angle[some])[..., None]
    x = frames.x[some][..., None] + cosine * local[..., 0] - sine * local[..., 1]
    y = frames.y[some][..., None] + sine * local[..., 0] + cosine * local[..., 1]
    others = supports.quads + supports.displacement[some][:, None, None]
    return _in_space(np.concatenate([np.stack([x, y], axis=-1), others], axis=1))


def support_quads(scenario: Scenario, frames: Frames) -> Floats:
    """Return the corners (m, (q, 4, 2), counter-clockwise) of ground and walls at rest, in the frames' axes.

    Every straight piece of the ground is filled down to a common depth; a wall has a thickness behind its face.
    """
    thick = THICKNESS * float(min(frames.size_x.min(), frames.size_y.min()))
    line = _ground(scenario, frames)
    floor = float(line[:, 1].min()) - thick
    pieces = [(line[i], line[i + 1]) for i in range(len(line) - 1) if line[i + 1, 0] > line[i, 0]]
    ground = [[[x0, floor], [x1, floor], [x1, y1], [x0, y0]] for (x0, y0), (x1, y1) in pieces]
    return np.array([*ground, *_walls(scenario, thick)]).reshape(-1, 4, 2)


def support_motion(scenario: Scenario, times: Floats) -> tuple[Floats, Floats]:
    """Return displacement (m) and velocity (m/s) of ground and walls along x and y at these times (s), (n, 2) each."""
    if scenario.motion is None:
        return np.zeros((len(times), 2)), np.zeros((len(times), 2))
    along = motion_direction(scenario)
    displacement, velocity = displacement_and_velocity(motion_pieces(scenario), times)
    return np.multiply.outer(displacement, along), np.multiply.outer(velocity, along)


def _ground(scenario: Scenario, frames: Frames) -> Floats:
    """Return the line of the ground (m, (k, 2)) from left to right, beyond all blocks."""
    profile = np.array(scenario.ground.profile or ()).reshape(-1, 2)
    beyond = BEYOND * float(np.hypot(frames.size_x, frames.size_y).max())
    x = np.concatenate([profile[:, 0], frames.x[np.isfinite(frames.x)]])
    first, last = (profile[0, 1], profile[-1, 1]) if len(profile) else (0.0, 0.0)
    return np.concatenate([[[float(x.min()) - beyond, first]], profile, [[float(x.max()) + beyond, last]]])


def _walls(scenario: Scenario, thick: float) -> list[Floats]:
    quads = []
    for wall in wall_segments(scenario):
        start, end = np.array([wall.x0, wall.y0]), np.array([wall.x1, wall.y1])
        back = thick / wall.length * np.array([end[1] - start[1], start[0] - end[0]])  # the solid is on the right hand
        quads.append(np.array([start + back, end + back, end, start]))
    return quads
