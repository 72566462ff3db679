"""Frames in the formats of other programs: CSV, VTKHDF, GeoJSON and DXF."""

import csv
import io
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.extras import load_module
from blocksim.scenario import Model, PlacedBody
from blocksim.scenario.structures.drawings import DXF, DXF_APPLICATION, DXF_INTEGER, DXF_TEXT
from blocksim.simulation import files, instruments
from blocksim.simulation.trajectory import BODIES, UNITS, Contacts, Frames, forces_on_a, join_contacts
from blocksim.world.systems.blocks import BLOCKS, are_removed, distinct, placed_points, supports_track
from blocksim.world.systems.system import Floats, Track

CONTACT_NUMBERS = sorted(UNITS, key=lambda name: "m1N".index(UNITS[name]))  # lengths, directions, forces
CONTACT_COLUMNS = ("time_s", *BODIES, *(f"{name}{instruments.TABLE_UNITS[UNITS[name]][0]}" for name in CONTACT_NUMBERS))
NOBODY = ""
"""Name of what is no block: the ground, or a wall."""


def write_frames_csv(path: Path, frames: Frames) -> int:
    """Write all frames and return their number; every system beside the blocks into a table beside this one.

    Rotation is the angle turned since the start, not wrapped. Raises OutputError, and leaves an older file as it was
    then.
    """
    for track in frames.tracks:
        columns = track.columns()
        heads = ("time_s", track.system.element, *columns)
        frames_of = zip(*columns.values(), strict=True)
        tables = (zip(track.names, *(one.tolist() for one in frame), strict=True) for frame in frames_of)
        name = path.name if track.system is BLOCKS else f"{path.stem}_{track.system.name}{path.suffix}"
        _write(path.with_name(name), heads, frames.time, tables)
    return len(frames)


def write_contacts_csv(path: Path, frames: Frames, contacts: Contacts) -> int:
    """Write all contacts and return their number.

    Bodies are named as in the table of frames; the cell of the ground or a wall is empty. Raises OutputError, and
    leaves an older file as it was then.
    """
    names = np.array([*frames.names, NOBODY], dtype=object)  # the support has number -1

    def table(rows: NDArray[Any]) -> Iterator[tuple[Any, ...]]:
        columns = [instruments.TABLE_UNITS[UNITS[name]][1] * rows[name] for name in CONTACT_NUMBERS]
        return zip(*(names[rows[name]] for name in BODIES), *(column.tolist() for column in columns), strict=True)

    _write(path, CONTACT_COLUMNS, frames.time, (table(contacts.at(k)) for k in range(len(contacts))))
    return len(contacts.rows)


def _write(path: Path, heads: Sequence[str], times: Floats, tables: Iterable[Iterable[tuple[Any, ...]]]) -> None:
    """Write a table of rows at each of the times (s); what is not finite is an empty cell."""
    timed = ((time, row) for time, rows in zip(times.tolist(), tables, strict=True) for row in rows)
    with files.atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        for time, row in timed:
            cells = ("" if isinstance(one, float) and not math.isfinite(one) else one for one in row)
            writer.writerow([time, *cells])


UNFIT_FOR_LAYERS = re.compile(r"[<>/\\\":;?*|=']")
CONTROLS = re.compile(r"[\x00-\x1f\x7f]")  # would end a line of the file
MOST_LETTERS = 60  # of a name, 4 bytes each at most: extended data have 255


def write_geojson(path: Path, frames: Frames, model: Model) -> int:
    """Write the outlines (m) of the last frame and return the number of blocks; properties are block, fixed and name.

    Raises InvalidInputError when there is no block to write, and OutputError.
    """
    features = [
        {
            "type": "Feature",
            "properties": {
                "name": body.name,
                "block": body.block,
                "fixed": body.fixed,
                "rotation_deg": float(np.degrees(rotation)),
            },
            "geometry": {"type": "Polygon", "coordinates": [[*corners.tolist(), corners[0].tolist()]]},
        }
        for corners, body, rotation in _last_blocks(frames, model)
    ]
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    files.write_text(path, f'{{{files.GEOJSON_MARK}, "type": "FeatureCollection", "features": [\n{lines}\n]}}\n')
    return len(features)


def write_dxf(path: Path, frames: Frames, model: Model) -> int:
    """Write the outlines (m) of the last frame, each in the layer of its block, and return the number of blocks.

    Extended data of BLOCKSIM have the name of each and whether it is fixed; `read_drawing` takes them up again.
    Raises UnavailableError without the package for it, else as `write_geojson`.
    """
    ezdxf = load_module("ezdxf", f"writing {path.name}", DXF)
    blocks = [*_last_blocks(frames, model)]
    document = ezdxf.new("R2010", units=6)  # DXF's number of the unit
    document.header.custom_vars.append(*files.DXF_PROPERTY)
    document.appids.new(DXF_APPLICATION)
    space = document.modelspace()
    for corners, body, _ in blocks:
        layer = {"layer": UNFIT_FOR_LAYERS.sub("_", body.block)}
        line = space.add_lwpolyline(corners.tolist(), close=True, dxfattribs=layer)
        name = CONTROLS.sub("_", body.name)[:MOST_LETTERS]
        line.set_xdata(DXF_APPLICATION, [(DXF_TEXT, name), (DXF_INTEGER, int(body.fixed))])
    with files.atomic_path(path) as temporary:
        document.saveas(temporary)
    return len(blocks)


def _last_blocks(frames: Frames, model: Model) -> Iterator[tuple[Floats, PlacedBody, float]]:
    """Yield the blocks of the last frame in which all of them are somewhere, without those that were removed.

    Each with its corners (m, (k, 2)), how it was placed, and its rotation (rad) since the start.
    """
    somewhere = np.isfinite([frames.x, frames.y, frames.angle]).all(axis=(0, 2))
    if not somewhere.any():
        raise InvalidInputError("no frame to export")
    if not frames.names:
        raise InvalidInputError("no block to export")
    last = int(np.flatnonzero(somewhere)[-1])
    places = placed_points(frames.corners, frames.x[last], frames.y[last], frames.angle[last])
    for number, body in enumerate(model.bodies):
        if not are_removed(frames.vx[last, number]):
            corners = places[number, : len(distinct(frames.corners[number]))]
            yield corners, body, float(frames.rotation[last, number])


VERSION = (2, 0)
VERTEX, QUAD, POLYGON = 1, 9, 7  # VTK's numbers of cells
BATCH = 1 << 16  # blocks times frames that are computed at once
CHUNK = 1 << 14  # rows of a data set that are packed together
PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
PLACE, VELOCITY, VELOCITY_DATA = ("x", "y"), ("vx", "vy"), "velocity_m_s"
WAY_DATA = "displacement_m"  # from the first frame
Indices = NDArray[np.intp]


def write_vtkhdf(path: Path, frames: Frames, model: Model) -> int:
    """Write all frames in which every number is finite and return their number.

    Points in m, z = 0. Cells are the outlines of all systems, blocks first; all others have block number 0, ground and
    walls come last. What a system does not have is zero. Names of the blocks are field data, and beside the VTK group
    `blocksim/block_names`, in the order of the cells. Raises InvalidInputError when there is nothing to write, and
    OutputError. The file is made in memory, packed: HDF5 does not survive a disk that is full.
    """
    chosen = _finite(frames)
    tracks = (*frames.tracks, supports_track(model, frames.tracks[0], frames.time))
    corners = np.concatenate([_corners_of(one) for one in tracks])
    cells, points, blocks, count = len(corners), int(corners.sum()), len(frames.names), len(chosen)
    others = (one for track in tracks for one in track.system.outputs if one.name not in (*PLACE, *VELOCITY))
    sizes = {VELOCITY_DATA: 3, WAY_DATA: 3, **{one.column: 1 for one in others}}  # data of cells: components
    with _grid(path, frames, chosen) as group:
        for name, number in (("Points", points), ("Cells", cells), ("ConnectivityIds", points)):
            group[f"NumberOf{name}"] = np.array([number], dtype=np.int64)
        group["Connectivity"] = np.arange(points, dtype=np.int64)
        group["Offsets"] = np.concatenate([[0], np.cumsum(corners)]).astype(np.int64)
        group["Types"] = np.where(corners == 4, QUAD, POLYGON).astype(np.uint8)
        group["CellData/block"] = np.pad(np.arange(1, blocks + 1, dtype=np.int64), (0, cells - blocks))
        steps, first, zero = group["Steps"], np.arange(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
        steps["PartOffsets"] = zero
        steps["PointOffsets"] = points * first
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = zero[:, None]
        steps["CellDataOffsets/block"] = zero
        for name in sizes:
            steps[f"CellDataOffsets/{name}"] = len(corners) * first
        data = {}
        for name, rows, size in (("Points", points, 3), *((f"CellData/{name}", cells, sizes[name]) for name in sizes)):
            shape = (rows * count,) if size == 1 else (rows * count, size)
            chunks = (min(rows * count, CHUNK), *shape[1:])
            data[name] = group.create_dataset(name, shape, dtype=np.float64, chunks=chunks, **PACKED)
        at_once = max(1, BATCH // cells)
        for start in range(0, count, at_once):
            some = chosen[start : start + at_once]
            for name, values in data.items():
                rows = points if name == "Points" else cells
                parts = [_cell_data(one, name.removeprefix("CellData/"), some) for one in tracks]
                joined = np.concatenate(parts, axis=1)
                if values.ndim == 2:  # in space
                    joined = np.pad(joined, ((0, 0), (0, 0), (0, 1)))
                values[start * rows : (start + len(some)) * rows] = joined.reshape(-1, *values.shape[1:])
        text = [name.encode() for name in frames.names]
        group.file.create_dataset("blocksim/block_names", data=text, dtype=h5py.string_dtype())
    return count


def write_contacts_vtkhdf(path: Path, frames: Frames, contacts: Contacts) -> int:
    """Write the contacts of the frames that `write_vtkhdf` writes, and return their number: points in m, z = 0.

    Data of points are the block numbers of that file (0: no block), the force on the first body and what tables of
    contacts have. Raises InvalidInputError and OutputError.
    """
    chosen = _finite(frames)
    some = join_contacts([contacts.at(frame) for frame in chosen.tolist()])
    counts = np.diff(some.ends, prepend=0)
    first, rows = some.ends - counts, some.rows
    force = forces_on_a(rows)
    data: dict[str, Any] = {name: rows[name].astype(np.int64) + 1 for name in BODIES}
    data["force_on_a_N"] = np.pad(force, ((0, 0), (0, 1)))
    for name in CONTACT_NUMBERS:
        suffix, factor = instruments.TABLE_UNITS[UNITS[name]]
        data[f"{name}{suffix}"] = factor * rows[name]
    with _grid(path, frames, chosen) as group:
        for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
            group[name] = counts
        group["Points"] = np.stack([rows["x"], rows["y"], 0.0 * rows["x"]], axis=-1)
        group["Connectivity"] = np.arange(len(rows)) - np.repeat(first, counts)
        group["Offsets"] = np.concatenate([np.arange(count + 1) for count in counts.tolist()])
        group["Types"] = np.full(len(rows), VERTEX, dtype=np.uint8)
        steps = group["Steps"]
        steps["PartOffsets"] = np.arange(len(chosen), dtype=np.int64)
        steps["PointOffsets"] = first
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = first[:, None]
        for name, values in data.items():
            group.create_dataset(f"PointData/{name}", data=values, **(PACKED if len(values) else {}))
            steps[f"PointDataOffsets/{name}"] = first
    return len(rows)


@contextmanager
def _grid(path: Path, frames: Frames, chosen: Indices) -> Iterator[Any]:
    """Give the group of a grid at the times of some frames, which is written to a file in the end. Raises OutputError.

    The names of the blocks are field data of every time; no blocks, no field data. VTK reads strings of variable
    length, and takes them for UTF-8, where HDF5 says that they are ASCII.
    """
    content, times, names = io.BytesIO(), len(chosen), [name.encode() for name in frames.names]
    with h5py.File(content, "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["Version"] = np.array(VERSION, dtype=np.int64)
        group.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(times)
        steps["Values"] = frames.time[chosen]
        steps["NumberOfParts"] = np.ones(times, dtype=np.int64)
        yield group
        if names:
            group.create_dataset("FieldData/block_names", data=names, dtype=h5py.string_dtype("ascii"))
            steps["FieldDataOffsets/block_names"] = np.zeros(times, dtype=np.int64)
            steps["FieldDataSizes/block_names"] = np.array([[1, len(names)]] * times, dtype=np.int64)
    files.write_bytes(path, content.getbuffer())


def _finite(frames: Frames) -> Indices:
    """Return the frames that can be shown; a failed run may end in others."""
    finite = np.isfinite(frames.time)
    for track in frames.tracks:
        finite &= np.isfinite(track.values).all(axis=(1, 2))
    chosen = np.flatnonzero(finite)
    if len(chosen) == 0 or not any(track.values.size for track in frames.tracks):
        raise InvalidInputError("no frame to export")
    return chosen


def _corners_of(track: Track) -> NDArray[np.int64]:
    """Return how many corners each element has, in a table with the last one of some repeated."""
    corners = track.system.outlines(track, np.zeros(1, dtype=np.intp))[0]
    return np.asarray(1 + (corners[:, 1:] != corners[:, :-1]).any(axis=-1).sum(axis=1), dtype=np.int64)


def _cell_data(track: Track, name: str, some: Indices) -> Floats:
    """Return data of a system in some frames, (f, b) or (f, b, 2), zero where it has nothing of the kind.

    Those of points are the corners (m) of all elements one after the other.
    """
    if name == "Points":
        outlines = track.system.outlines(track, some)
        is_distinct = np.arange(outlines.shape[2]) < _corners_of(track)[:, None]
        return np.asarray(outlines[:, is_distinct])
    if name == VELOCITY_DATA:
        return np.stack([track[one][some] for one in VELOCITY], axis=-1)
    if name == WAY_DATA and {one.name for one in track.system.quantities} >= set(PLACE):
        return np.stack([track[one][some] - track[one][0] for one in PLACE], axis=-1)
    if name == WAY_DATA:
        first = np.zeros(1, dtype=np.intp)
        return np.asarray((track.system.outlines(track, some) - track.system.outlines(track, first)).mean(axis=2))
    output = next((one for one in track.system.outputs if one.column == name), None)
    return np.zeros((len(some), len(track.names))) if output is None else output.factor * output.of(track.some(some))


class Format(NamedTuple):
    """How a format is written; both writers return the number of frames, blocks or contacts in it."""

    write: Callable[[Path, Frames, Model], int]
    write_contacts: Callable[[Path, Frames, Contacts], int] | None = None  # into a file of their own
    counted: str = "frames"


# A format is one entry here.
FORMATS: dict[str, Format] = {
    "csv": Format(lambda path, frames, _: write_frames_csv(path, frames), write_contacts_csv),
    "vtkhdf": Format(write_vtkhdf, write_contacts_vtkhdf),
    "geojson": Format(write_geojson, counted="blocks"),
    "dxf": Format(write_dxf, counted="blocks"),
}
