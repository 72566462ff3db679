"""Contact points and their forces, one row a corner that touches something; recorded on request."""

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import NO_FACE, World

CONTACT = np.dtype(
    [
        ("step", np.int64),
        ("body", np.int64),  # whose corner touches
        ("other", np.int64),  # what is touched: another body, or GROUND
        ("x", np.float64),  # m, the corner
        ("y", np.float64),  # m
        ("overlap", np.float64),  # m
        ("normal_force", np.float64),  # N, pushing apart
        ("shear_force", np.float64),  # N, along the face
        ("force_x", np.float64),  # N, on `body`
        ("force_y", np.float64),  # N, on `body`
    ]
)
CONTACT_UNITS = dict(zip(CONTACT.names or (), ("1", "1", "1", "m", "m", "m", "N", "N", "N", "N"), strict=True))
GROUND = -1
CORNERS = 4
CORNER_X = np.array([-1.0, 1.0, 1.0, -1.0])  # counter-clockwise from the lower left
CORNER_Y = np.array([-1.0, -1.0, 1.0, 1.0])


def contact_rows(world: World) -> NDArray[np.void]:
    """Return all contact points of the present state, (k,) CONTACT.

    The force on the owner of a corner is N m - S t: N and S its normal and shear force, m the outward normal of the
    touched face, t the same turned by +90 degrees.
    """
    count = int(world.clock[0].pair_count)
    pair, slot = np.nonzero(world.slots[:count].face != NO_FACE)
    touching = world.slots[pair, slot]
    first, second = world.pairs.a[pair], world.pairs.b[pair]
    is_first = slot < CORNERS  # of the pair, who owns the corner
    owner, touched = np.where(is_first, first, second), np.where(is_first, second, first)
    body, corner = world.bodies[owner], slot % CORNERS
    local_x, local_y = CORNER_X[corner] * body.half_x, CORNER_Y[corner] * body.half_y
    is_ground = touched == world.bodies.size - 1
    normal_angle = np.where(is_ground, 0.5 * np.pi, world.bodies.angle[touched] + 0.5 * np.pi * touching.face)
    cos, sin = np.cos(normal_angle), np.sin(normal_angle)
    rows = np.zeros(len(pair), CONTACT)
    rows["step"] = world.clock[0].steps
    rows["body"], rows["other"] = owner, np.where(is_ground, GROUND, touched)
    rows["x"] = body.x + body.cos * local_x - body.sin * local_y
    rows["y"] = body.y + body.sin * local_x + body.cos * local_y
    rows["overlap"] = touching.depth
    rows["normal_force"], rows["shear_force"] = touching.normal_force, touching.shear_force
    rows["force_x"] = cos * touching.normal_force + sin * touching.shear_force
    rows["force_y"] = sin * touching.normal_force - cos * touching.shear_force
    return rows
