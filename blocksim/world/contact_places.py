"""Where the contacts of a world with springs are, found again as kernels find them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common import arrays
from blocksim.kernels.explicit import sides

Indices = NDArray[np.intp]
SIDES_X, SIDES_Y = (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0)  # of the corners, counter-clockwise from lower left


def places_of(world: arrays.World, contacts: Any, a: Indices, b: Indices) -> list[Any]:
    """Return place (m) and normal of contacts (c,) between bodies a and b: x, y, and the normal from b to a.

    Those of particles keep them.
    """
    if "nx" in (contacts.dtype.names or ()):
        return [contacts[name] for name in ("x", "y", "nx", "ny")]
    bodies = world.bodies.view(np.ndarray)
    is_of_a = contacts["slot"] < sides.MOST_CORNERS
    owner, touched = np.where(is_of_a, a, b), np.where(is_of_a, b, a)
    number, face = contacts["slot"] % sides.MOST_CORNERS, contacts["face"]
    cosine, sine = bodies["cos"][touched], bodies["sin"][touched]
    if world.corners is None:
        px = np.choose(number, SIDES_X) * bodies["half_x"][owner]
        py = np.choose(number, SIDES_Y) * bodies["half_y"][owner]
        # faces 0: -y, 1: +x, 2: +y, 3: -x
        nx, ny = np.choose(face, [sine, cosine, -sine, -cosine]), np.choose(face, [-cosine, sine, cosine, -sine])
    else:
        corners = world.corners.view(np.ndarray)
        corner, edge = bodies["first_corner"][owner] + number, bodies["first_corner"][touched] + face
        px, py, nx, ny = corners["x"][corner], corners["y"][corner], corners["nx"][edge], corners["ny"][edge]
        nx, ny = cosine * nx - sine * ny, sine * nx + cosine * ny
    outward = np.where(is_of_a, 1.0, -1.0)  # from b to a, whichever of the two is touched
    cosine, sine = bodies["cos"][owner], bodies["sin"][owner]
    x, y = bodies["x"][owner] + cosine * px - sine * py, bodies["y"][owner] + sine * px + cosine * py
    return [x, y, outward * nx, outward * ny]
