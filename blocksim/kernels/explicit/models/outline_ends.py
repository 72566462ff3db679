"""Ends of the interval of two faces of polygons: which of two corners that mark the same one is its contact.

Where a corner of a and a corner of b mark one end, that nearer to the other end is the inner one. Both may lie in the
other body: behind a blunt end the outer one does until it is as far out as the overlap over the tangent of the angle
there, 2.4 times the overlap of 16-gons. Its depth below the face drawn out beyond that end differs by the tilt times
that way from the depth of the inner one, and the stiffness, which is measured from contact to contact (tributary.py),
would grow while the interval shrinks. So the inner one takes over as soon as the corners have passed one another,
where both are equally deep: later the energy would change by a step, up to 5 % of it. Corners that are flush would
change places at every step by the last digits; so the one in contact stays for HAND_OVER of its overlap.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.models.duplicate_corners import PARALLEL, keeps_first
from blocksim.kernels.explicit.outlines import (
    MOST_CORNERS,
    corner_of,
    into_frame,
    is_piece,
    next_number,
    side_along,
)

# calibrated: of the overlap. What an end holds changes by twice that times the tilt (0.01) as it changes hands, 4e-4 of
# it; stacks at rest stay flush within less
HAND_OVER = 0.02


@kernel
def from_middle(body: Record, number: int, table: Records, nx: float, ny: float) -> float:
    """Return the place (m) of a corner along the tangent (-ny, nx), from the middle of the face that looks along n."""
    side = corner_of(body, table, side_along(body, table, nx, ny))
    corner = corner_of(body, table, number)
    tx, ty = into_frame(body, -ny, nx)
    x = corner.x - side.x + side.half * side.ny
    y = corner.y - side.y - side.half * side.nx
    return tx * x + ty * y


@rare_kernel
def is_same_end(of_a: Record, of_b: Record, a: Record, b: Record, table: Records) -> bool:
    """Return True if a corner of a and a corner of b (both points) mark the same end of one face contact."""
    nx = of_a.nx
    ny = of_a.ny
    if nx * of_b.nx + ny * of_b.ny < PARALLEL:
        return False
    end_a = -from_middle(a, of_a.slot, table, -nx, -ny)
    return end_a * from_middle(b, of_b.slot - MOST_CORNERS, table, nx, ny) > 0.0


@rare_kernel
def place_on(point: Record, touched: Record, table: Records) -> tuple[float, float]:
    """Return where a point is along the face it touches, from the middle of that (m), and half of its length (m)."""
    face: Any = np.int64(point.face)
    side = corner_of(touched, table, face)
    x, y = into_frame(touched, point.x - touched.x, point.y - touched.y)
    return side.nx * y - side.ny * x - side.middle, side.half


@rare_kernel
def way_beyond(point: Record, a: Record, b: Record, table: Records) -> float:
    """Return how far (m) the corner of a point is beyond the end of its face, less what it may be."""
    along, half = place_on(point, b if point.slot < MOST_CORNERS else a, table)
    return abs(along) - half - HAND_OVER * point.depth


@rare_kernel
def keeps_inner(
    one: Record, two: Record, a: Record, b: Record, pair: Record, contacts: Records, oblique: bool, table: Records
) -> bool:
    """Return True if of two corners at the same place, of a and of b, that of a counts; see the top.

    On a piece of ground the end of a face is none.
    """
    first = keeps_first(one, two, pair, contacts, oblique)
    if oblique or is_piece(a) or is_piece(b):
        return first
    beyond_one = way_beyond(one, a, b, table)
    beyond_two = way_beyond(two, a, b, table)
    if first:
        return beyond_one <= max(beyond_two, 0.0)
    return beyond_two > max(beyond_one, 0.0)


@kernel
def has_inner(duplicates: int, of_b: bool, touched: Record, face: int, along: float, beyond: float) -> bool:
    """Return True if a contact is beyond the end of its face by more than it may be, and the corner there a duplicate.

    `touched` is body b, or a; `along` (m) and `beyond` (m, less what it may be) are of the place on its face.
    """
    if beyond <= 0.0:
        return False
    end = next_number(touched, face) if along > 0.0 else face
    return (duplicates >> (end + MOST_CORNERS if of_b else end)) & 1 == 1


@rare_kernel
def has_passed(point: Record, duplicates: int, a: Record, b: Record, table: Records) -> bool:
    """Return True if a point is farther out than the corner that was dropped as its duplicate, if there is one."""
    of_b = bool(point.slot < MOST_CORNERS)
    touched = b if of_b else a
    face: Any = np.int64(point.face)
    along, half = place_on(point, touched, table)
    return has_inner(duplicates, of_b, touched, face, along, abs(along) - half - HAND_OVER * point.depth)
