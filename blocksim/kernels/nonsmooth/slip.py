"""How bodies move at the points of a constraint, and how that bends away from straight lines as bodies turn.

Manifolds are found a time T = (dt - h) / 2 into the step and kept, so that a gap is linear in the ways of the bodies
since the step began. With the velocities at T its second derivative is c, and to second order it is

    g(t) = g_linear(t) + c (t - T)^2 / 2.

Within substep k, from t = k h to (k + 1) h, it changes by h (J v + c (t_middle - T)) with t_middle = (k + 1/2) h. What
constraints keep is the bend c h / 2, and with that velocities gain (2 k - n + 2) bends in substep k of n, while gaps at
time t = m h are off by (2 m - n + 1)^2 h / 4 bends.
"""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.simd import Lanes, Mask, select


class Constraints(NamedTuple):
    """What constraints are, the same for all substeps of a step; fields as in CONSTRAINT."""

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


class Motion(NamedTuple):
    """How two bodies move, and how far into the step that is followed.

    Velocity of centre a against centre b (m/s), both spins (rad/s), how far `ahead` (s) contacts are sought, and
    `half` a substep (s); both zero for contacts that do not press.
    """

    vx: Lanes
    vy: Lanes
    spin_a: Lanes
    spin_b: Lanes
    ahead: Lanes
    half: Lanes


@jit.kernel
def presses(impulse: Lanes, inverse_mass: Lanes, stepping: arrays.Record) -> Mask:
    """Return True if an impulse (N s) is more than round-off: if it moves bodies by more than `touch_gap` in a substep.

    `inverse_mass` (1/kg) is that of both bodies together.
    """
    return inverse_mass * impulse > stepping.touch_gap * stepping.open_bias


@jit.kernel
def slip_of(constraint: Constraints, vx: Lanes, vy: Lanes, spin_a: Lanes, spin_b: Lanes) -> Slip:
    """Return the velocities at the points, given that of centre a against centre b and both spins."""
    along = constraint.nx * vx + constraint.ny * vy
    across = constraint.nx * vy - constraint.ny * vx
    one = along + (constraint.arm_a * spin_a - constraint.arm_b * spin_b)
    shear = across + (constraint.shear_arm_a * spin_a - constraint.shear_arm_b * spin_b)
    return Slip(one, one - constraint.width * (spin_a - spin_b), shear)


class Bend(NamedTuple):
    """What velocities at the points gain within half a substep as the bodies turn: along normal and tangent (m/s)."""

    normal: Lanes
    shear: Lanes


@jit.kernel
def bend_of(constraint: Constraints, motion: Motion, is_of_b: Mask, is_two: Mask) -> Bend:
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
    along = constraint.nx * motion.vy - constraint.ny * motion.vx
    part_a = w_a * constraint.shear_arm_a
    part_b = w_b * constraint.shear_arm_b
    of_b = 2.0 * w_b * (along + part_a) - w_b * part_b - w_a * part_a
    of_a = 2.0 * w_a * (along - part_b) + w_a * part_a + w_b * part_b
    width = select(is_two, constraint.width, 0.0)
    sticking = w_a * w_a * (constraint.arm_a - width) - w_b * w_b * (constraint.arm_b - width)
    return Bend(motion.half * select(is_of_b, of_b, of_a), motion.half * sticking)


@jit.kernel
def bend_time(stepping: arrays.Record, number: int) -> float:
    """Return by how much gaps at the start of substep `number` are off, over the bend of their constraint (s)."""
    off = 2 * number - stepping.substeps + 1
    return 0.25 * stepping.substep * off * off


@jit.kernel
def follow_curvature(stepping: arrays.Record, number: int) -> None:
    """Set the bends in substep `number`."""
    stepping.bend_share = 2 * number - stepping.substeps + 2
    stepping.bend_time = bend_time(stepping, number)
    stepping.next_bend_time = bend_time(stepping, number + 1)
