"""What a run leaves behind over time: contacts and states at the output times, and the final table."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.extras import load_module
from blocksim.scenario import geometry
from blocksim.scenario.input_files import MEGABYTE, read_limited
from blocksim.world.systems.blocks import BLOCKS, boxes_around
from blocksim.world.systems.system import Elements, SystemInScene, Track, local_corners

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


Floats = NDArray[np.float64]
Rows = NDArray[Any]  # (c,) CONTACT_ROW

BODIES = ("body_a", "body_b")
SUPPORT = -1  # body number of the ground, of its pieces and of walls; blocks count from 0 as in frames
UNITS = {
    "x": "m",  # contact point
    "y": "m",
    "normal_x": "1",
    "normal_y": "1",
    "overlap": "m",  # negative: a gap
    "normal_force": "N",
    "shear_force": "N",
}
CONTACT_ROW = np.dtype([*((name, np.int32) for name in BODIES), *((name, np.float64) for name in UNITS)])


@dataclass(frozen=True)
class Contacts:
    """The contacts of n frames, one frame after the other."""

    ends: NDArray[np.int64]  # (n,) number of contacts in all frames up to and with this one
    rows: Rows  # (c,) CONTACT_ROW

    def at(self, frame: int) -> Rows:
        """Return the contacts of one frame, (k,) CONTACT_ROW."""
        return self.rows[self.ends[frame - 1] if frame > 0 else 0 : self.ends[frame]]

    @property
    def frame(self) -> NDArray[np.intp]:
        """Number of the frame of every contact, (c,)."""
        return np.repeat(np.arange(len(self.ends)), np.diff(self.ends, prepend=0))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.ends)


def join_contacts(tables: Sequence[Rows]) -> Contacts:
    """Return the contacts of frames from one table each."""
    ends = np.cumsum([len(table) for table in tables], dtype=np.int64)
    return Contacts(ends, np.concatenate([np.zeros(0, CONTACT_ROW), *tables]))


def forces_on_a(rows: Rows) -> Floats:
    """Return the force (N) of every contact on its body a along x and y, (k, 2)."""
    normal, shear = rows["normal_force"], rows["shear_force"]
    nx, ny = rows["normal_x"], rows["normal_y"]
    return np.stack([nx * normal - ny * shear, ny * normal + nx * shear], axis=-1)


def force_on_supports(contacts: Contacts, up: tuple[float, float] = (0.0, 1.0), fixed: Sequence[bool] = ()) -> Floats:
    """Return the force (N) along the unit vector `up` with which supports hold all free blocks at every frame, (n,).

    Supports are ground and walls, and blocks that are `fixed`. Blocks at rest are held by what they weigh.
    """
    rows = contacts.rows
    held = np.append(np.asarray(fixed, dtype=np.bool_), [False] * (1 + int(rows["body_a"].max(initial=0))))
    holds_a = (rows["body_b"] == SUPPORT) | held[rows["body_b"]]
    sign = holds_a.astype(float) - held[rows["body_a"]]
    total = np.cumsum(sign * (forces_on_a(rows) @ np.array(up)))
    return np.diff(np.concatenate([[0.0], total])[contacts.ends], prepend=0.0)


EXTRA = "xarray"


@dataclass(frozen=True, repr=False)
class Frames:
    """Recorded states in SI; n frames of b bodies. Rotations counter-clockwise positive."""

    step: NDArray[np.int64]  # (n,) step numbers
    time: Floats  # (n,) s
    x: Floats  # (n, b) m, centres along the ground
    y: Floats  # (n, b) m, centres above the ground
    angle: Floats  # (n, b) rad, of the body axes
    vx: Floats  # (n, b) m/s
    vy: Floats  # (n, b) m/s
    spin: Floats  # (n, b) rad/s
    energy: dict[str, Floats]  # (n,) J each, by name: the scheme's `ledger`
    contact_count: Floats  # (n,) contacts
    largest_overlap: Floats  # (n,) m
    names: tuple[str, ...]  # b names of bodies
    size_x: Floats  # (b,) m, along the body's own x axis
    size_y: Floats  # (b,) m
    start_angle: Floats  # (b,) rad, of the body axes as placed
    contacts: Contacts | None = None  # where they were recorded
    mass: Floats | None = None  # (b,) kg
    inertia: Floats | None = None  # (b,) kg m2
    others: tuple[Track, ...] = ()  # systems beside the blocks
    outlines: Floats | None = None  # (b, k, 2) m, corners along the body's own axes, where any is no rectangle

    @cached_property
    def corners(self) -> Floats:
        """Corners of every block along its own axes, (b, k, 2) m, counter-clockwise, the last one of some repeated."""
        return local_corners(self.size_x, self.size_y, self.outlines)

    @cached_property
    def least_widths(self) -> Floats:
        """Least distances of parallel lines around every block, of a rectangle its smaller side, (b,) m."""
        normals, is_edge = geometry.outward_normals(self.corners)
        heights = np.einsum("bec,bkc->bek", normals, self.corners)
        return np.asarray(np.where(is_edge, np.ptp(heights, axis=2), np.inf).min(axis=1))

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Every system over time, blocks first."""
        unknown = np.full(len(self.names), np.nan)
        inert = (unknown if one is None else one for one in (self.mass, self.inertia))
        shape = (self.size_x, self.size_y, unknown, *inert)
        start = np.stack([unknown, unknown, self.start_angle, unknown, unknown, unknown])
        blocks = SystemInScene(BLOCKS, Elements(self.names, np.stack(shape), start, self.outlines))
        values = np.stack([getattr(self, one.name) for one in BLOCKS.quantities], axis=1)
        return (Track(blocks, values), *self.others)

    @property
    def rotation(self) -> Floats:
        """Angle turned since the start, (n, b) rad, never wrapped."""
        return self.angle - self.start_angle

    def __repr__(self) -> str:
        """Return a line: frames, blocks, the time that they span."""
        span = f"{self.time[0]:.4g} to {self.time[-1]:.4g} s" if len(self) else "none"
        return f"<Frames: {len(self)} of {len(self.names)} blocks, {span}>"

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)


def tidy_table(frames: Frames, system: str = BLOCKS.name) -> "pd.DataFrame":
    """Return one row per frame and block, or element of another system; columns as in the exported CSV.

    Of blocks: time_s, block, x_mm, … kinetic_energy_J. Raises KeyError for a system that is not in the run.
    """
    import pandas as pd

    track = {one.system.name: one for one in frames.tracks}[system]
    count, elements = len(frames), len(track.names)
    columns: dict[str, Any] = {"time_s": np.repeat(frames.time, elements), track.system.element: [*track.names] * count}
    return pd.DataFrame(columns | {name: values.ravel() for name, values in track.columns().items()})


def data_set(frames: Frames, name: str) -> "xr.Dataset":
    """Return an xarray.Dataset in SI with dimensions time and block, energies over time, units as attributes.

    Variables of another system begin with its name, and have a dimension of their own. Raises UnavailableError without
    the extra `xarray`.
    """
    xarray = load_module("xarray", "to_xarray", EXTRA)
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"time": ("time", frames.time, {"units": "s"})}
    for track in frames.tracks:
        element = track.system.element
        prefix = "" if track.system is BLOCKS else f"{track.system.name}_"
        coordinates[element] = (element, list(track.names))
        for one in track.system.outputs:
            attributes = {"units": one.unit, "long_name": one.meaning}
            variables[prefix + one.name] = (("time", element), one.of(track), attributes)
    energies = {f"energy_{key}": (("time",), values, {"units": "J"}) for key, values in frames.energy.items()}
    dataset: xr.Dataset = xarray.Dataset({**variables, **energies}, coords=coordinates, attrs={"scenario": name})
    return dataset


Columns = dict[str, list[Any]]  # by the names in COLUMNS, a value a block: its name, then numbers

COLUMNS = (
    "block",
    "x_mm",
    "y_mm",
    "rotation_deg",
    "left_mm",
    "right_mm",
    "bottom_mm",
    "top_mm",
    "vx_mm_s",
    "vy_mm_s",
    "spin_deg_s",
)
MILLI = 1e3
MOST_BYTES = 400 * MEGABYTE  # of final.csv; a million blocks take half of it


def final_columns(frames: Frames) -> Columns:
    """Return the table of the last frame: a value a block, columns as in `COLUMNS`.

    x, y is the centre; rotation the angle turned since the start, counter-clockwise positive, not wrapped; left, right,
    bottom and top are the extents of the turned block.
    """
    motion = np.stack([one[-1] for one in (frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin)])
    values = final_values(motion, frames.corners, frames.start_angle)
    return dict(zip(COLUMNS, (list(frames.names), *values.tolist()), strict=True))


def final_values(motion: Floats, corners: Floats, start_angle: Floats) -> Floats:
    """Return the numbers (..., 10, b) of the tables of states, columns as in `COLUMNS`.

    `motion` (..., 6, b) holds x, y, angle and their rates, `corners` (..., b, k, 2) are along the body's own axes, and
    `start_angle` (..., b) is the angle of these at the start, all SI.
    """
    x, y, angle, vx, vy, spin = (motion[..., k, :] for k in range(6))
    # of one state at a time: what is computed together may decide on the last digit
    cos, sin = (
        np.reshape([turn(one) for one in angle.reshape(-1, max(x.shape[-1], 1))], x.shape) for turn in (np.cos, np.sin)
    )
    low, high = boxes_around(corners, x, y, cos, sin)
    extents = [low[..., 0], high[..., 0], low[..., 1], high[..., 1]]
    values = (
        MILLI * x,
        MILLI * y,
        np.degrees(angle - start_angle),
        *(MILLI * one for one in extents),
        MILLI * vx,
        MILLI * vy,
        np.degrees(spin),
    )
    return np.stack(values, axis=-2)


def as_frame(columns: Columns) -> "pd.DataFrame":
    """Return the same table for people who know pandas."""
    import pandas as pd

    return pd.DataFrame(columns)


def rows_of(columns: Columns) -> list[dict[str, Any]]:
    """Return the same table as a list of rows."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def csv_text(columns: Columns) -> str:
    """Return the text of a file that gives all numbers back to the last bit; NaN is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for name, *values in zip(*columns.values(), strict=True):
        writer.writerow([name, *("" if isinstance(one, float) and math.isnan(one) else one for one in values)])
    return text.getvalue()


def read_table(path: Path) -> Columns:
    """Return a final table from its file. Raises InputMissingError or InvalidInputError."""
    content = read_limited(path, MOST_BYTES)
    try:
        return _columns_of(line for line in csv.reader(io.StringIO(content.decode(), newline="")) if line)
    except (ValueError, csv.Error) as error:
        raise InvalidInputError(f"{path}: not a final table: {error}") from error


def _columns_of(lines: Iterator[list[str]]) -> Columns:
    """Return the columns in the lines of a file, which are not kept; an empty cell is NaN. Raises ValueError."""
    if tuple(next(lines, ())) != COLUMNS:
        raise ValueError(f"the columns must be {','.join(COLUMNS)}")
    columns: Columns = {name: [] for name in COLUMNS}
    for number, cells in enumerate(lines, start=1):
        if len(cells) != len(COLUMNS):
            raise ValueError(f"row {number} has {len(cells)} cells, not {len(COLUMNS)}")
        columns[COLUMNS[0]].append(cells[0])
        for name, cell in zip(COLUMNS[1:], cells[1:], strict=True):
            columns[name].append(float(cell or "nan"))
    return columns
