"""How contacts bend away from the straight lines that a step takes them for, as bodies turn.

Manifolds are found a time T = (dt - h) / 2 into the step and kept, so that a gap is linear in the ways of the bodies
since the step began. With the velocities at T its second derivative is c, and to second order it is

    g(t) = g_linear(t) + c (t - T)^2 / 2.

Within substep k, from t = k h to (k + 1) h, it changes by h (J v + c (t_middle - T)) with t_middle = (k + 1/2) h. What
constraints keep is the bend c h / 2, and with that velocities gain (2 k - n + 2) bends in substep k of n, while gaps at
time t = m h are off by (2 m - n + 1)^2 h / 4 bends.
"""

from typing import NamedTuple

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import Lanes, Mask, select
from blocksim.kernels.nonsmooth.slip import Constraints, Motion


class Bend(NamedTuple):
    """What velocities at the points gain within half a substep as the bodies turn: along normal and tangent (m/s)."""

    normal: Lanes
    shear: Lanes


@kernel
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


@kernel
def bend_time(stepping: Record, number: int) -> float:
    """Return by how much gaps at the start of substep `number` are off, over the bend of their constraint (s)."""
    off = 2 * number - stepping.substeps + 1
    return 0.25 * stepping.substep * off * off


@kernel
def follow_curvature(stepping: Record, number: int) -> None:
    """Set the bends in substep `number`."""
    stepping.bend_share = 2 * number - stepping.substeps + 2
    stepping.bend_time = bend_time(stepping, number)
    stepping.next_bend_time = bend_time(stepping, number + 1)
