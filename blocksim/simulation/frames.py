"""What a run leaves behind over time: positions, velocities and energies at the output times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.contacts import Contacts

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
