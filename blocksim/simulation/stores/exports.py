"""Frames in the formats of other programs: CSV, VTKHDF, GeoJSON and DXF."""

import csv
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.extras import load_module
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.structures.polygons import DXF, DXF_APPLICATION, DXF_INTEGER, DXF_TEXT
from blocksim.simulation.atomic import atomic_path, write_text
from blocksim.simulation.folder import DXF_PROPERTY, GEOJSON_MARK
from blocksim.simulation.frames import BODIES, UNITS, Contacts, Frames
from blocksim.simulation.probes import TABLE_UNITS
from blocksim.simulation.stores.hdf5_files import SafeFile
from blocksim.world.systems.blocks import BLOCKS, are_removed, distinct, local_corners, placed_points, supports_track
from blocksim.world.systems.system import Floats, System, Track

FRAME_COLUMNS = ("time_s", "block", *(one.column for one in BLOCKS.outputs))
CONTACT_NUMBERS = sorted(UNITS, key=lambda name: "m1N".index(UNITS[name]))  # lengths, directions, forces
CONTACT_COLUMNS = ("time_s", *BODIES, *(f"{name}{TABLE_UNITS[UNITS[name]][0]}" for name in CONTACT_NUMBERS))
NOBODY = ""
"""Name of what is no block: the ground, or a wall."""
Row = list[float | str]


def write_frames_csv(path: Path, frames: Frames) -> int:
    """Write all frames and return their number; every system beside the blocks into a table beside this one.

    Rotation is the angle turned since the start, not wrapped. Raises OutputError, and leaves an older file as it was
    then.
    """
    for track in frames.tracks:
        columns = track.columns()
        heads = ("time_s", track.system.element, *columns)
        _write(table_of(path, track.system), heads, _frame_rows(frames.time, track, [*columns.values()]))
    return len(frames)


def table_of(path: Path, system: System) -> Path:
    """Return the table of a system: that which was named for the blocks, or one beside it."""
    return path if system is BLOCKS else path.with_name(f"{path.stem}_{system.name}{path.suffix}")


def write_contacts_csv(path: Path, frames: Frames, contacts: Contacts) -> int:
    """Write all contacts and return their number.

    Bodies are named as in the table of frames; the cell of the ground or a wall is empty. Raises OutputError, and
    leaves an older file as it was then.
    """
    rows = (row for frame in range(len(contacts)) for row in _contact_rows(frames, contacts, frame))
    _write(path, CONTACT_COLUMNS, rows)
    return len(contacts.rows)


def _write(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def _frame_rows(times: Floats, track: Track, columns: Sequence[Floats]) -> Iterator[Row]:
    """Yield the rows of all frames, one per element."""
    for frame, time in enumerate(times.tolist()):
        for name, *values in zip(track.names, *(column[frame].tolist() for column in columns), strict=True):
            yield [time, name, *(value if math.isfinite(value) else "" for value in values)]


def _contact_rows(frames: Frames, contacts: Contacts, frame: int) -> Iterator[Row]:
    """Yield the rows of one frame, one per contact."""
    rows = contacts.at(frame)
    time = float(frames.time[frame])
    names = np.array([*frames.names, NOBODY], dtype=object)  # the support has number -1
    bodies = (names[rows[name]] for name in BODIES)
    columns = [TABLE_UNITS[UNITS[name]][1] * rows[name] for name in CONTACT_NUMBERS]
    for one, other, *values in zip(*bodies, *(column.tolist() for column in columns), strict=True):
        yield [time, one, other, *(value if math.isfinite(value) else "" for value in values)]


UNFIT_FOR_LAYERS = re.compile(r"[<>/\\\":;?*|=']")
CONTROLS = re.compile(r"[\x00-\x1f\x7f]")  # would end a line of the file
MOST_LETTERS = 60  # of a name, 4 bytes each at most: extended data have 255
METRES = 6  # DXF's number of the unit


class _Block(NamedTuple):
    """A block at the end: its corners (m, (k, 2)) and how it was placed."""

    corners: Floats
    body: PlacedBody
    rotation: float  # rad, since the start


def write_geojson(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write the outlines (m) of the last frame and return the number of blocks; properties are block, fixed and name.

    Raises InvalidInputError when there is no block to write, and OutputError.
    """
    blocks = [*_last_blocks(frames, scenario)]
    features = [
        {
            "type": "Feature",
            "properties": {
                "name": one.body.name,
                "block": one.body.block,
                "fixed": one.body.fixed,
                "rotation_deg": float(np.degrees(one.rotation)),
            },
            "geometry": {"type": "Polygon", "coordinates": [[*one.corners.tolist(), one.corners[0].tolist()]]},
        }
        for one in blocks
    ]
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    write_text(path, f'{{{GEOJSON_MARK}, "type": "FeatureCollection", "features": [\n{lines}\n]}}\n')
    return len(blocks)


def write_dxf(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write the outlines (m) of the last frame, each in the layer of its block, and return the number of blocks.

    Extended data of BLOCKSIM have the name of each and whether it is fixed; `read_drawing` takes them up again.
    Raises UnavailableError without the package for it, else as `write_geojson`.
    """
    ezdxf = load_module("ezdxf", f"writing {path.name}", DXF)
    blocks = [*_last_blocks(frames, scenario)]
    document = ezdxf.new("R2010", units=METRES)
    document.header.custom_vars.append(*DXF_PROPERTY)
    document.appids.new(DXF_APPLICATION)
    space = document.modelspace()
    for one in blocks:
        layer = {"layer": UNFIT_FOR_LAYERS.sub("_", one.body.block)}
        line = space.add_lwpolyline(one.corners.tolist(), close=True, dxfattribs=layer)
        name = CONTROLS.sub("_", one.body.name)[:MOST_LETTERS]
        line.set_xdata(DXF_APPLICATION, [(DXF_TEXT, name), (DXF_INTEGER, int(one.body.fixed))])
    with atomic_path(path) as temporary:
        document.saveas(temporary)
    return len(blocks)


def _last_blocks(frames: Frames, scenario: Scenario) -> Iterator[_Block]:
    """Yield the blocks of the last frame in which all of them are somewhere, without those that were removed."""
    somewhere = np.isfinite([frames.x, frames.y, frames.angle]).all(axis=(0, 2))
    if not somewhere.any():
        message = "no frame to export"
        raise InvalidInputError(message)
    if not frames.names:
        message = "no block to export"
        raise InvalidInputError(message)
    last = int(np.flatnonzero(somewhere)[-1])
    local = local_corners(frames.size_x, frames.size_y, frames.outlines)
    places = placed_points(local, frames.x[last], frames.y[last], frames.angle[last])
    for number, body in enumerate(place_bodies(scenario)):
        if not are_removed(frames.vx[last, number]):
            corners = places[number, : len(distinct(local[number]))]
            yield _Block(corners, body, float(frames.rotation[last, number]))


VERSION = (2, 0)
QUAD, POLYGON = 9, 7  # VTK's numbers of cells
BATCH = 1 << 16  # blocks times frames that are computed at once
CHUNK = 1 << 14  # rows of a data set that are packed together
PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
PLACE, VELOCITY, VELOCITY_DATA = ("x", "y"), ("vx", "vy"), "velocity_m_s"
WAY_DATA = "displacement_m"  # from the first frame
Indices = NDArray[np.intp]


def write_vtkhdf(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write all frames in which every number is finite and return their number.

    Points in m, z = 0. Cells are the outlines of all systems, blocks first; all others have block number 0, ground and
    walls come last. What a system does not have is zero. Beside the VTK group the names of the blocks are kept,
    `blocksim/block_names`, in the order of the cells. Raises InvalidInputError when there is nothing to write, and
    OutputError.
    """
    chosen = _finite(frames)
    tracks = (*frames.tracks, supports_track(scenario, frames.tracks[0], frames.time))
    with atomic_path(path) as temporary, SafeFile(temporary) as safe:
        _write_grid(safe.file.create_group("VTKHDF"), tracks, frames.time[chosen], chosen, safe.check)
        names = [name.encode() for name in frames.names]
        safe.file.create_dataset("blocksim/block_names", data=names, dtype=h5py.string_dtype())
    return len(chosen)


def _finite(frames: Frames) -> Indices:
    """Return the frames that can be shown; a failed run may end in others."""
    finite = np.isfinite(frames.time)
    for track in frames.tracks:
        finite &= np.isfinite(track.values).all(axis=(1, 2))
    chosen = np.flatnonzero(finite)
    if len(chosen) == 0 or not any(track.values.size for track in frames.tracks):
        message = "no frame to export"
        raise InvalidInputError(message)
    return chosen


def _write_grid(group: Any, tracks: Sequence[Track], times: Floats, chosen: Indices, check: Callable[[], None]) -> None:
    corners = np.concatenate([_corners_of(one) for one in tracks])
    data = _data_of(tracks)
    group.attrs["Version"] = np.array(VERSION, dtype=np.int64)
    group.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    _write_cells(group, len(tracks[0].names), corners)
    _write_steps(group.create_group("Steps"), times, corners, data)
    _write_times(group, tracks, chosen, corners, data, check)


def _corners_of(track: Track) -> NDArray[np.int64]:
    """Return how many corners each element has."""
    outlines = track.present.elements.outlines
    if outlines is None:
        count = track.system.outlines(track, np.zeros(1, dtype=np.intp)).shape[2]
        return np.full(len(track.names), count, dtype=np.int64)
    return np.asarray(1 + (outlines[:, 1:] != outlines[:, :-1]).any(axis=-1).sum(axis=1), dtype=np.int64)


def _points_of(track: Track, some: Indices) -> Floats:
    """Return the corners (m) of all elements in some frames one after the other, (f, p, 2)."""
    outlines = track.system.outlines(track, some)
    if track.present.elements.outlines is None:
        return outlines.reshape(len(some), -1, 2)
    return np.asarray(outlines[:, np.arange(outlines.shape[2]) < _corners_of(track)[:, None]])


def _data_of(tracks: Sequence[Track]) -> dict[str, int]:
    """Return the data of cells at every time, with their components: what systems show beside their places."""
    shown = (one for track in tracks for one in track.system.outputs if one.name not in (*PLACE, *VELOCITY))
    return {VELOCITY_DATA: 3, WAY_DATA: 3, **{one.column: 1 for one in shown}}


def _write_cells(group: Any, blocks: int, corners: NDArray[np.int64]) -> None:
    """Write what stays the same: how points make cells, and the number of every block; 0 for what is none."""
    cells, points = len(corners), int(corners.sum())
    for name, count in (
        ("NumberOfPoints", points),
        ("NumberOfCells", cells),
        ("NumberOfConnectivityIds", points),
    ):
        group[name] = np.array([count], dtype=np.int64)
    group["Connectivity"] = np.arange(points, dtype=np.int64)
    group["Offsets"] = np.concatenate([[0], np.cumsum(corners)]).astype(np.int64)
    group["Types"] = np.where(corners == 4, QUAD, POLYGON).astype(np.uint8)
    numbers = np.zeros(cells, dtype=np.int64)
    numbers[:blocks] = np.arange(1, blocks + 1)
    group["CellData/block"] = numbers


def _write_steps(group: Any, times: Floats, corners: NDArray[np.int64], data: Iterable[str]) -> None:
    """Write the times (s) and where the parts of each of them begin."""
    count = len(times)
    first, zero = np.arange(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    group.attrs["NSteps"] = np.int64(count)
    group["Values"] = times
    group["NumberOfParts"] = zero + 1
    group["PartOffsets"] = zero
    group["PointOffsets"] = int(corners.sum()) * first
    group["CellOffsets"] = zero[:, None]
    group["ConnectivityIdOffsets"] = zero[:, None]
    group["CellDataOffsets/block"] = zero
    for name in data:
        group[f"CellDataOffsets/{name}"] = len(corners) * first


def _write_times(
    group: Any,
    tracks: Sequence[Track],
    chosen: Indices,
    corners: NDArray[np.int64],
    sizes: Mapping[str, int],
    check: Callable[[], None],
) -> None:
    """Write what changes: points, and the data of the cells; `check` raises where the disk is full by now."""
    cells, count = len(corners), int(corners.sum())
    points = _created(group, "Points", count * len(chosen), 3)
    data = {name: _created(group, f"CellData/{name}", cells * len(chosen), size) for name, size in sizes.items()}
    size = max(1, BATCH // cells)
    for start in range(0, len(chosen), size):
        some = chosen[start : start + size]
        first, last = start * cells, (start + len(some)) * cells
        outlines = np.concatenate([_points_of(one, some) for one in tracks], axis=1)
        points[start * count : (start + len(some)) * count] = _in_space(outlines)
        for name, values in data.items():
            values[first:last] = _cell_data(tracks, name, some)
        check()


def _cell_data(tracks: Sequence[Track], name: str, some: Indices) -> Floats:
    """Return the data of all cells in some frames, (cells * frames,) or (cells * frames, 3)."""
    if name == VELOCITY_DATA:
        return _in_space(np.concatenate([_velocities(one.some(some)) for one in tracks], axis=1))
    if name == WAY_DATA:
        return _in_space(np.concatenate([_ways(one, some) for one in tracks], axis=1))
    parts = [_shown(one, name, some) for one in tracks]
    return np.concatenate(parts, axis=1).ravel()


def _shown(track: Track, name: str, some: Indices) -> Floats:
    """Return what a system shows under a name in some frames, (f, b), zero where it has nothing of the kind."""
    found = next((one for one in track.system.outputs if one.column == name), None)
    return np.zeros((len(some), len(track.names))) if found is None else found.factor * found.of(track.some(some))


def _ways(track: Track, some: Indices) -> Floats:
    """Return how far (m) elements have come since the first frame, (f, b, 2)."""
    if {one.name for one in track.system.quantities} >= set(PLACE):
        return np.stack([track[name][some] - track[name][0] for name in PLACE], axis=-1)
    first = np.zeros(1, dtype=np.intp)
    return np.asarray((track.system.outlines(track, some) - track.system.outlines(track, first)).mean(axis=2))


def _velocities(track: Track) -> Floats:
    return np.stack([track[name] for name in VELOCITY], axis=-1)


def _in_space(plane: Floats) -> Floats:
    """Return vectors (..., 2) with a third component of zero, one after the other."""
    return np.pad(plane.reshape(-1, 2), ((0, 0), (0, 1)))


def _created(group: Any, name: str, rows: int, components: int) -> Any:
    shape = (rows,) if components == 1 else (rows, components)
    chunks = (min(rows, CHUNK), *shape[1:])
    return group.create_dataset(name, shape, dtype=np.float64, chunks=chunks, **PACKED)


class Format(NamedTuple):
    """How a format is written; both writers return the number of frames, blocks or contacts in it."""

    write: Callable[[Path, Frames, Scenario], int]
    write_contacts: Callable[[Path, Frames, Contacts], int] | None = None  # into a file of their own
    counted: str = "frames"


# A format is one entry here.
FORMATS: dict[str, Format] = {
    "csv": Format(lambda path, frames, _: write_frames_csv(path, frames), write_contacts_csv),
    "vtkhdf": Format(write_vtkhdf),
    "geojson": Format(write_geojson, counted="blocks"),
    "dxf": Format(write_dxf, counted="blocks"),
}


def format_named(name: str) -> Format:
    """Return what writes files of a format. Raises InvalidInputError for an unknown one."""
    if name not in FORMATS:
        message = f"--format {name}: unsupported format; use {' or '.join(FORMATS)}"
        raise InvalidInputError(message)
    return FORMATS[name]
