"""Rectangles by plain geometry: what kernels are compared with."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import Record

    Floats = NDArray[np.float64]

SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])  # of the corners


def turned(body: Record) -> Floats:
    """Return the matrix that points of a body as rows are multiplied with, from its frame to the world."""
    c, s = cos(body.angle), sin(body.angle)
    return np.array([[c, s], [-s, c]])


def corners(body: Record) -> Floats:
    """Return the corners (4, 2) of a body from its angle."""
    return np.asarray(SIGNS * (body.half_x, body.half_y) @ turned(body) + (body.x, body.y))


def in_frame(points: Floats, body: Record) -> Floats:
    """Return points (n, 2) as the frame of a body has them."""
    return np.asarray((points - (body.x, body.y)) @ turned(body).T)


def gap_along(angle: float, one: Record, two: Record) -> float:
    """Return the gap between the projections of the corners of two bodies on one direction."""
    a, b = (corners(body) @ (cos(angle), sin(angle)) for body in (one, two))
    return float(max(b.min() - a.max(), a.min() - b.max()))


def gap(one: Record, two: Record) -> float:
    """Return the largest gap between the projections on the four face normals."""
    return max(gap_along(angle + turn, one, two) for angle in (one.angle, two.angle) for turn in (0.0, pi / 2))


def distances(points: Floats, body: Record) -> Floats:
    """Return the distances of points to a rectangle, zero inside."""
    outside = np.maximum(np.abs(in_frame(points, body)) - (body.half_x, body.half_y), 0.0)
    return np.asarray(np.hypot(outside[:, 0], outside[:, 1]))
