"""What a run leaves behind over time: positions, velocities and energies at the output times.

A tidy pandas table and an xarray data set are made from frames on request; pandas and xarray are imported then.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.simulation.contacts import Contacts

if TYPE_CHECKING:
    import pandas as pd

EXTRA = "xarray"
MILLI = 1e3
QUANTITIES = {  # name of a variable: unit, meaning
    "x": ("m", "centre along the ground"),
    "y": ("m", "centre above the ground"),
    "rotation": ("rad", "angle turned since the start, counter-clockwise positive, not wrapped"),
    "vx": ("m/s", "velocity along the ground"),
    "vy": ("m/s", "velocity normal to the ground"),
    "spin": ("rad/s", "angular velocity"),
}
Floats = NDArray[np.float64]


@dataclass(frozen=True)
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

    @property
    def rotation(self) -> Floats:
        """Angle turned since the start, (n, b) rad, never wrapped."""
        return self.angle - self.start_angle

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)


def tidy_table(frames: Frames) -> "pd.DataFrame":
    """Return one row per frame and block; columns as in the exported CSV: time_s, block, x_mm, … spin_deg_s."""
    import pandas as pd  # noqa: PLC0415 - a third of a second that a run does not pay

    count, blocks = frames.x.shape
    columns: dict[str, Any] = {"time_s": np.repeat(frames.time, blocks), "block": list(frames.names) * count}
    columns |= {
        "x_mm": MILLI * frames.x.ravel(),
        "y_mm": MILLI * frames.y.ravel(),
        "rotation_deg": np.degrees(frames.rotation).ravel(),
        "vx_mm_s": MILLI * frames.vx.ravel(),
        "vy_mm_s": MILLI * frames.vy.ravel(),
        "spin_deg_s": np.degrees(frames.spin).ravel(),
    }
    return pd.DataFrame(columns)


def data_set(frames: Frames, name: str) -> Any:
    """Return an xarray.Dataset in SI with dimensions time and block, energies over time, units as attributes.

    Raises UnavailableError without the extra `xarray`.
    """
    xarray = loaded("xarray", "to_xarray", EXTRA)
    motion = {
        key: (("time", "block"), getattr(frames, key), {"units": unit, "long_name": meaning})
        for key, (unit, meaning) in QUANTITIES.items()
    }
    energies = {f"energy_{key}": (("time",), values, {"units": "J"}) for key, values in frames.energy.items()}
    coordinates = {"time": ("time", frames.time, {"units": "s"}), "block": ("block", list(frames.names))}
    return xarray.Dataset({**motion, **energies}, coords=coordinates, attrs={"scenario": name})
