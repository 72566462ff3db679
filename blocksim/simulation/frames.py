"""What a run leaves behind over time: positions, velocities and energies at the output times.

A tidy pandas table and an xarray data set are made from frames on request; pandas and xarray are imported then.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.simulation.contacts import Contacts
from blocksim.world.systems.blocks import BLOCKS
from blocksim.world.systems.system import Elements, Present, Track

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

EXTRA = "xarray"
Floats = NDArray[np.float64]


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

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Every system over time, blocks first."""
        unknown = np.full(len(self.names), np.nan)
        shape = (self.size_x, self.size_y, unknown, *(unknown if one is None else one for one in self._inert))
        start = np.stack([unknown, unknown, self.start_angle, unknown, unknown, unknown])
        blocks = Present(BLOCKS, Elements(self.names, np.stack(shape), start, self.outlines))
        values = np.stack([getattr(self, one.name) for one in BLOCKS.quantities], axis=1)
        return (Track(blocks, values), *self.others)

    @property
    def _inert(self) -> tuple[Floats | None, Floats | None]:
        return self.mass, self.inertia

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
    xarray = loaded("xarray", "to_xarray", EXTRA)
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"time": ("time", frames.time, {"units": "s"})}
    for track in frames.tracks:
        element = track.system.element
        prefix = "" if track.system is BLOCKS else f"{track.system.name}_"
        coordinates[element] = (element, list(track.names))
        for one in track.system.outputs:
            told = {"units": one.unit, "long_name": one.meaning}
            variables[prefix + one.name] = (("time", element), one.of(track), told)
    energies = {f"energy_{key}": (("time",), values, {"units": "J"}) for key, values in frames.energy.items()}
    found: xr.Dataset = xarray.Dataset({**variables, **energies}, coords=coordinates, attrs={"scenario": name})
    return found
