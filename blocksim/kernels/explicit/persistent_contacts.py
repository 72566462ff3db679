"""Contacts that continue: where they are, how they move, and how their dashpots are rebuilt.

Places are taken from the centre of body b, in world axes. The velocity of a point of body a against body b at a place r
is then v + w x r with one v and one w for all points of the pair. Everything is passed by value and stays in registers.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import HALF, NORMAL, SHEAR, Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import corner_offset
from blocksim.kernels.explicit import damping, inertia, kinematics
from blocksim.kernels.explicit.models.surface import CONE_TOLERANCE, corner_signs


class Motion(NamedTuple):
    """Motion of body a against body b at the centre of b: in the last drift, and as predicted at its end."""

    vx: float  # m/s
    vy: float
    spin: float  # rad/s
    end_vx: float
    end_vy: float
    end_spin: float


class PersistentContact(NamedTuple):
    """One contact that continues."""

    x: float  # m, from the centre of b
    y: float
    nx: float  # normal, from b to a
    ny: float
    depth: float  # m
    closing: float  # m, displacement of the last drift against the normal
    slip: float  # m, along the tangent
    closing_rate: float  # m/s, at the end of the drift
    slip_rate: float


@kernel
def admits(owner: Record, corner: int, nx: float, ny: float) -> bool:
    """Return True if a corner of `owner` can touch a face of the outward normal (nx, ny); see models/duplicates.py."""
    sx, sy = corner_signs(corner)
    along_x = sx * (nx * owner.cos + ny * owner.sin)
    along_y = sy * (ny * owner.cos - nx * owner.sin)
    return along_x <= CONE_TOLERANCE and along_y <= CONE_TOLERANCE


@kernel
def face_frame(body: Record, face: int) -> tuple[float, float, float, float]:
    """Return the outward normal of a face in world axes, its distance from the centre and half of its length (m)."""
    sign = 1.0 if face < 2 else -1.0
    if face % 2 == 0:
        return sign * body.cos, sign * body.sin, body.half_x, body.half_y
    return -sign * body.sin, sign * body.cos, body.half_y, body.half_x


@kernel
def relative_motion(a: Record, b: Record, dx: float, dy: float, time: float) -> Motion:
    """Return the motion of a against b; the end of the drift is `time` (s) ahead, with the last accelerations."""
    vx = a.vx - b.vx + a.spin * dy
    vy = a.vy - b.vy - a.spin * dx
    spin = a.spin - b.spin
    ax = a.ax - b.ax + a.spin_rate * dy
    ay = a.ay - b.ay - a.spin_rate * dx
    return Motion(vx, vy, spin, vx + time * ax, vy + time * ay, spin + time * (a.spin_rate - b.spin_rate))


@kernel
def follow(
    contact: Record, a: Record, b: Record, dx: float, dy: float, motion: Motion, step: float, turns: bool
) -> tuple[bool, PersistentContact]:
    """Check that a contact continues, and where and how.

    It does not where its corner has left or has passed the end of the face, where another face is nearer that it can
    touch, or will be within a few steps. Whether the corner can still touch its face at all changes by turning only,
    slowly, and is checked where `turns` says so.
    """
    slot = contact.slot
    is_own = slot < HALF
    owner = a if is_own else b
    touched = b if is_own else a
    side = 1.0 if is_own else -1.0
    corner = slot % HALF
    ox, oy = corner_offset(owner, corner)
    x = ox + side * dx
    y = oy + side * dy
    nx, ny, half, half_length = face_frame(touched, contact.face)
    depth = half - (x * nx + y * ny)
    along = y * nx - x * ny
    beside = half_length - abs(along)
    goes_on = depth > 0.0 and beside >= 0.0 and (not turns or admits(owner, corner, nx, ny))
    found = contact_at(x if is_own else ox, y if is_own else oy, side * nx, side * ny, depth, motion, step)
    if beside < max(depth, kinematics.IMPACT_STEPS * abs(found.closing)):
        other = 1.0 if along > 0.0 else -1.0
        goes_on = goes_on and not admits(owner, corner, -other * ny, other * nx)
    return goes_on, found


@kernel
def contact_at(
    x: float, y: float, nx: float, ny: float, depth: float, motion: Motion, step: float
) -> PersistentContact:
    """Return a contact with its displacements in the last drift and its rates at the end of it."""
    ux = motion.vx - motion.spin * y
    uy = motion.vy + motion.spin * x
    ex = motion.end_vx - motion.end_spin * y
    ey = motion.end_vy + motion.end_spin * x
    closing = -step * (nx * ux + ny * uy)
    slip = step * (nx * uy - ny * ux)
    return PersistentContact(x, y, nx, ny, depth, closing, slip, -(nx * ex + ny * ey), nx * ey - ny * ex)


@kernel
def arms(found: PersistentContact, dx: float, dy: float, direction: int) -> tuple[float, float]:
    """Return the lever arms (m) of the normal or the tangent of a contact about the centres of a and b."""
    if direction == NORMAL:
        arm = found.x * found.ny - found.y * found.nx
        return arm - (dx * found.ny - dy * found.nx), arm
    arm = found.x * found.nx + found.y * found.ny
    return arm - (dx * found.nx + dy * found.ny), arm


@kernel
def pieces_of(
    a: Record, b: Record, found: PersistentContact, arm_a: float, arm_b: float, stiffness: float, direction: int
) -> tuple[inertia.Piece, inertia.Piece]:
    """Return what of both bodies the dashpots of a pair stand for; mean arms (m) of its normals, stiffness (N/m)."""
    of_a = inertia.piece_of(a, stiffness, found.nx, found.ny, arm_a, direction)
    return of_a, inertia.piece_of(b, stiffness, found.nx, found.ny, arm_b, direction)


@rare_kernel
def renew_single(
    operator: Record,
    pair: Record,
    a: Record,
    b: Record,
    found: PersistentContact,
    direction: int,
    ratio: float,
    step: float,
    stiffness: float,
) -> None:
    """Rebuild the operator of a single contact; `stiffness` (N/m) is that along the direction."""
    dx = a.x - b.x
    dy = a.y - b.y
    normal_a, normal_b = arms(found, dx, dy, NORMAL)
    of_a, of_b = pieces_of(a, b, found, normal_a, normal_b, pair.stiffness, direction)
    arm_a, arm_b = arms(found, dx, dy, direction)
    mass = inertia.inverse_mass_of(arm_a, arm_b, arm_a, arm_b, 1.0, of_a, of_b)
    half = 0.5 * step
    damping.keep_masses(operator, half, mass, mass, mass)
    damping.keep_dashpots(pair, direction, 1, damping.OPERATOR_LIFE if half > 0.0 else 0)
    damping.fill_single(operator, 0, ratio, half, mass, stiffness, 1.0)


@rare_kernel
def renew_sliding(
    operator: Record, pair: Record, a: Record, b: Record, found: PersistentContact, values: Record, step: float
) -> None:
    """Rebuild the operator along the normal of a single sliding contact."""
    dx = a.x - b.x
    dy = a.y - b.y
    arm_a, arm_b = arms(found, dx, dy, NORMAL)
    shear_a, shear_b = arms(found, dx, dy, SHEAR)
    of_a, of_b = pieces_of(a, b, found, arm_a, arm_b, pair.stiffness, NORMAL)
    mass = inertia.inverse_mass_of(arm_a, arm_b, arm_a, arm_b, 1.0, of_a, of_b)
    mixed = (arm_a - of_a.arm) * shear_a * of_a.inverse_inertia + (arm_b - of_b.arm) * shear_b * of_b.inverse_inertia
    mass = damping.sliding_mass(mass, mixed, values.kinetic_friction, pair.slides)
    half = 0.5 * step
    damping.keep_masses(operator, half, mass, mass, mass)
    damping.keep_dashpots(pair, NORMAL, 1, damping.OPERATOR_LIFE if half > 0.0 else 0)
    damping.fill_single(operator, 0, values.normal_damping, half, mass, pair.stiffness, 1.0)


@rare_kernel
def renew_double(
    operator: Record,
    pair: Record,
    a: Record,
    b: Record,
    one: PersistentContact,
    two: PersistentContact,
    direction: int,
    pattern: int,
    ratio: float,
    step: float,
    stiffness: float,
) -> None:
    """Rebuild the operator of two contacts, of which those in `pattern` have a dashpot.

    `stiffness` (N/m) is that of each along the direction.
    """
    dx = a.x - b.x
    dy = a.y - b.y
    normal_one_a, normal_one_b = arms(one, dx, dy, NORMAL)
    normal_two_a, normal_two_b = arms(two, dx, dy, NORMAL)
    mean_a = 0.5 * (normal_one_a + normal_two_a)
    mean_b = 0.5 * (normal_one_b + normal_two_b)
    of_a, of_b = pieces_of(a, b, one, mean_a, mean_b, 2.0 * pair.stiffness, direction)
    one_a, one_b = arms(one, dx, dy, direction)
    two_a, two_b = arms(two, dx, dy, direction)
    cosine = one.nx * two.nx + one.ny * two.ny
    m_one = inertia.inverse_mass_of(one_a, one_b, one_a, one_b, 1.0, of_a, of_b)
    m_two = inertia.inverse_mass_of(two_a, two_b, two_a, two_b, 1.0, of_a, of_b)
    m_mixed = inertia.inverse_mass_of(one_a, one_b, two_a, two_b, cosine, of_a, of_b)
    half = 0.5 * step
    damping.keep_masses(operator, half, m_one, m_mixed, m_two)
    damping.keep_dashpots(pair, direction, pattern, damping.OPERATOR_LIFE if half > 0.0 else 0)
    if pattern == damping.BOTH:
        damping.fill_alike(operator, 2.0 * ratio * math.sqrt(stiffness), half, m_one, m_mixed, m_two)
    else:
        damping.fill_single(operator, pattern - 1, ratio, half, m_one if pattern == 1 else m_two, stiffness, 1.0)
