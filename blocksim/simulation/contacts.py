"""Contacts of a run over time: where bodies touched at every frame, and with which forces.

The normal points from body b to body a, and the tangent is the normal turned by +90 degrees. What a contact does to
body a is `normal_force` along the normal and `shear_force` along the tangent; body b gets the opposite. With springs
these are the forces at the time of the frame, what a changing stiffness does (kernels/explicit/tributary.py) among
them: the shear force may be above the friction limit by the normal force times overlap over length. With rigid
contacts they are the impulses of the last substep over its length, so that an impact shows as one very large force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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

    def tables(self) -> list[Rows]:
        """Return the contacts of all frames, one table each."""
        return [self.at(frame) for frame in range(len(self))]

    def chosen(self, which: NDArray[np.bool_]) -> "Contacts":
        """Return those of some frames."""
        return joined([self.at(frame) for frame in np.flatnonzero(which).tolist()])

    @property
    def frame(self) -> NDArray[np.intp]:
        """Number of the frame of every contact, (c,)."""
        return np.repeat(np.arange(len(self.ends)), np.diff(self.ends, prepend=0))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.ends)


def joined(tables: Sequence[Rows]) -> Contacts:
    """Return the contacts of frames from one table each."""
    ends = np.cumsum([len(table) for table in tables], dtype=np.int64)
    return Contacts(ends, np.concatenate([empty_rows(0), *tables]))


def empty_rows(count: int) -> Rows:
    """Return a table of so many contacts, all zero."""
    return np.zeros(count, dtype=CONTACT_ROW)


def forces_on_a(rows: Rows) -> Floats:
    """Return the force (N) of every contact on its body a along x and y, (k, 2)."""
    normal, shear = rows["normal_force"], rows["shear_force"]
    nx, ny = rows["normal_x"], rows["normal_y"]
    return np.stack([nx * normal - ny * shear, ny * normal + nx * shear], axis=-1)


def borne(contacts: Contacts, up: tuple[float, float] = (0.0, 1.0), fixed: Sequence[bool] = ()) -> Floats:
    """Return the force (N) along the unit vector `up` with which supports hold all free blocks at every frame, (n,).

    Supports are ground and walls, and blocks that are `fixed`. Blocks at rest are held by what they weigh.
    """
    rows = contacts.rows
    held = np.append(np.asarray(fixed, dtype=np.bool_), [False] * (1 + int(rows["body_a"].max(initial=0))))
    holds_a = (rows["body_b"] == SUPPORT) | held[rows["body_b"]]
    sign = holds_a.astype(float) - held[rows["body_a"]]
    total = np.cumsum(sign * (forces_on_a(rows) @ np.array(up)))
    return np.diff(np.concatenate([[0.0], total])[contacts.ends], prepend=0.0)
