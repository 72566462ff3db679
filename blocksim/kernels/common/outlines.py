"""Convex polygons: their corners and faces in the table that all bodies of a shape share.

Nothing of it turns: what is asked of a body is turned into its own frame instead, a face normal at a time.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel


class Hull(NamedTuple):
    """The corners of a body: those from `first` on of a table (CORNER). Face k leads from corner k to the next one."""

    table: Records
    first: int
    size: int  # number of corners
    inner: float  # m, from the centroid to the nearest face


AnyHull = Any  # None, a type of its own, for rectangles among themselves, whose corners are in no table


@kernel
def hull_of(body: Record, table: Records) -> Hull:
    """Return the corners of a body, of a polygon or a rectangle."""
    first: Any = np.int64(body.first_corner)  # compiled code makes floats of signed and unsigned ones together
    size: Any = np.int64(body.corner_count)
    return Hull(table, first, size, body.inner_radius)


@kernel
def corner_at(hull: Hull, number: int) -> Record:
    """Return a corner, with the face that begins there."""
    return hull.table[hull.first + number]


@kernel
def next_corner(hull: Hull, number: int) -> int:
    """Return the number of the corner after one, counter-clockwise."""
    return number + 1 if number + 1 < hull.size else 0


@kernel
def least_along(hull: Hull, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector given in its own frame, at least."""
    least = math.inf
    for k in range(hull.first, hull.first + hull.size):
        corner = hull.table[k]
        least = min(least, nx * corner.x + ny * corner.y)
    return least


@kernel
def face_towards(hull: Hull, nx: float, ny: float) -> int:
    """Return the face whose outward normal is nearest to a unit vector given in the frame of the body.

    The corner that is farthest along it is one of its ends: the normals of both faces there are on either side of it.
    """
    number = 0
    best = -math.inf
    for k in range(hull.size):
        corner = hull.table[hull.first + k]
        cosine = nx * corner.nx + ny * corner.ny
        if cosine > best:
            best = cosine
            number = k
    return number
