"""How bodies move at the points of a row."""

from typing import NamedTuple

from blocksim.kernels.jit import kernel
from blocksim.kernels.lanes import Lanes, Mask, select


class Rows(NamedTuple):
    """What rows are, the same for all substeps of a step; fields as in ROW."""

    nx: Lanes
    ny: Lanes
    arm_a: Lanes
    arm_b: Lanes
    width: Lanes
    shear_arm_a: Lanes
    shear_arm_b: Lanes


class Slip(NamedTuple):
    """Velocity of body a against body b at the contact points: along the normal, twice, and along the tangent (m/s)."""

    one: Lanes
    two: Lanes
    shear: Lanes


class Bend(NamedTuple):
    """What velocities at the points gain within half a substep as the bodies turn: along normal and tangent (m/s)."""

    normal: Lanes
    shear: Lanes


class Motion(NamedTuple):
    """How two bodies move, and how far into the step that is followed.

    Velocity of centre a against centre b (m/s), both spins (rad/s), how far `ahead` (s) contacts are looked for, and
    `half` a substep (s); both zero for contacts that do not press.
    """

    vx: Lanes
    vy: Lanes
    spin_a: Lanes
    spin_b: Lanes
    ahead: Lanes
    half: Lanes


@kernel
def slip_of(row: Rows, vx: Lanes, vy: Lanes, spin_a: Lanes, spin_b: Lanes) -> Slip:
    """Return the velocities at the points, given that of centre a against centre b and both spins."""
    one = row.nx * vx + row.ny * vy + row.arm_a * spin_a - row.arm_b * spin_b
    shear = row.nx * vy - row.ny * vx + row.shear_arm_a * spin_a - row.shear_arm_b * spin_b
    return Slip(one, one - row.width * (spin_a - spin_b), shear)


@kernel
def bend_of(row: Rows, motion: Motion, is_of_b: Mask, is_two: Mask) -> Bend:
    """Return what the velocities at a contact gain within half a substep, as bodies turn on with the speed they have.

    Along the normal that is the second derivative of the gap g = n (p - q), where the face with n turns with body b
    (or a) and p is a corner of the other body. With S = r n (`shear_arm`), u the velocity of centre a against centre b
    along the tangent and spins w:

        face of b:  g'' = -w_b^2 S_b + 2 w_b (u + w_a S_a) - w_a^2 S_a
        face of a:  g'' =  w_a^2 S_a + 2 w_a (u - w_b S_b) + w_b^2 S_b

    Along the tangent it is the change of the velocity at the point that sticks, t (w_b^2 r_b - w_a^2 r_a), that is
    point two where `is_two`.
    """
    w_a = motion.spin_a
    w_b = motion.spin_b
    along = row.nx * motion.vy - row.ny * motion.vx
    part_a = w_a * row.shear_arm_a
    part_b = w_b * row.shear_arm_b
    of_b = 2.0 * w_b * (along + part_a) - w_b * part_b - w_a * part_a
    of_a = 2.0 * w_a * (along - part_b) + w_a * part_a + w_b * part_b
    width = select(is_two, row.width, 0.0)
    sticking = w_a * w_a * (row.arm_a - width) - w_b * w_b * (row.arm_b - width)
    return Bend(motion.half * select(is_of_b, of_b, of_a), motion.half * sticking)
