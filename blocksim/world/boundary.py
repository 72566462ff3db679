"""Boundary particles of a rectangle: equally spaced on every side, corners included."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class BoundaryParticles(NamedTuple):
    """Positions in the body frame and the share of the boundary that each particle stands for."""

    x: NDArray[np.float64]  # (k,) m, counter-clockwise from the lower left corner
    y: NDArray[np.float64]  # (k,) m
    tributary_length: NDArray[np.float64]  # (k,) m, sums to the perimeter


def boundary_particles(size_x: float, size_y: float, spacing: float) -> BoundaryParticles:
    """Place particles around a rectangle of the given sides (m), no farther apart than `spacing` (m).

    Every side is divided evenly, so both spacings of a body may be a little smaller than asked; a corner particle
    stands for half an interval of each of its two sides. Raises ValueError for a size or spacing that is not positive.
    """
    if min(size_x, size_y, spacing) <= 0.0:
        message = f"sizes and spacing must be positive, got {size_x}, {size_y}, {spacing}"
        raise ValueError(message)
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * (0.5 * size_x, 0.5 * size_y)
    sides = (size_x, size_y, size_x, size_y)
    divisions = [division(side, spacing) for side in sides]
    points, lengths = [], []
    for k, (side, count) in enumerate(zip(sides, divisions, strict=True)):
        share = np.arange(count)[:, np.newaxis] / count
        points.append(corners[k] * (1.0 - share) + corners[(k + 1) % 4] * share)
        length = np.full(count, side / count)
        length[0] = 0.5 * (side / count + sides[k - 1] / divisions[k - 1])
        lengths.append(length)
    xy = np.concatenate(points)
    return BoundaryParticles(xy[:, 0].copy(), xy[:, 1].copy(), np.concatenate(lengths))


def particle_count(size_x: float, size_y: float, spacing: float) -> int:
    """Return how many particles `boundary_particles` would place."""
    return 2 * (division(size_x, spacing) + division(size_y, spacing))


def division(side: float, spacing: float) -> int:
    """Return the number of equal intervals, none longer than `spacing`, that a side (both m) is divided into."""
    # a quotient that round-off lifted just over an integer must not add a particle
    return max(1, math.ceil(side / spacing * (1.0 - 1e-12)))
