"""Particles along the edge of a block, for models that have them; drawn, never used for forces.

The same division of the sides as when the world is built: equal intervals, none longer than the spacing. Discs lie
inset by half of it, the rows of the kernel model on the edge itself.
"""

import math

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario

Floats = NDArray[np.float64]
ROUND_OFF = 1e-12


def boundary_particles(scenario: Scenario, size_x: float, size_y: float) -> Floats:
    """Return the particles of a block of these sides (m) in its own axes (m), (k, 2); none for the surface model."""
    contact = scenario.contact
    if contact.model == "surface":
        return np.zeros((0, 2))
    inset = 0.0 if contact.model == "kernel" else 0.5 * contact.particle_spacing
    half = np.array([0.5 * size_x - inset, 0.5 * size_y - inset])
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    counts = [_intervals(2.0 * float(side), contact.particle_spacing) for side in (*half, *half)]
    sides = [
        start + (end - start) * (np.arange(count) / count)[:, None]
        for start, end, count in zip(corners, np.roll(corners, -1, axis=0), counts, strict=True)
    ]
    return np.concatenate(sides)


def _intervals(side: float, spacing: float) -> int:
    return max(1, math.ceil(side / spacing * (1.0 - ROUND_OFF)))
