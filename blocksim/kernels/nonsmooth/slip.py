"""How bodies move at the points of a constraint."""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.simd import Lanes, Mask


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
