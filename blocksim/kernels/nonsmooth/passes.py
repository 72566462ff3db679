"""What a substep does to the rows: warm start, position pass, velocity pass, books. Formulas: __init__.py.

Velocities are read, changed by all impulses of a row and written back; effective masses are computed anew each time,
which is cheaper than to load them. Bodies that are fixed are never written to, so that rows of one colour share
nothing that changes.
"""

from typing import NamedTuple

from blocksim.kernels.arrays import Record
from blocksim.kernels.friction import friction_coefficient
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import FAR, Contacts
from blocksim.kernels.nonsmooth.solve import solve_two


class Slip(NamedTuple):
    """Velocity of body a against body b at the contact points: along the normal, twice, and along the tangent (m/s)."""

    one: float
    two: float
    shear: float


@kernel
def slip_of(row: Record, vx: float, vy: float, spin_a: float, spin_b: float) -> Slip:
    """Return the velocities at the points, given that of centre a against centre b and both spins."""
    one = row.nx * vx + row.ny * vy + row.arm_a * spin_a - row.arm_b * spin_b
    shear = row.nx * vy - row.ny * vx + row.shear_arm_a * spin_a - row.shear_arm_b * spin_b
    return Slip(one, one - row.width * (spin_a - spin_b), shear)


@kernel
def push(row: Record, a: Record, b: Record, normal: float, second: float, shear: float) -> None:
    """Change the velocities of both bodies by a normal impulse (N s) in all, of which `second` at point two."""
    px = row.nx * normal - row.ny * shear
    py = row.ny * normal + row.nx * shear
    turn = row.width * second
    if a.inverse_mass > 0.0:
        a.vx += a.inverse_mass * px
        a.vy += a.inverse_mass * py
        a.spin += a.inverse_inertia * (row.arm_a * normal - turn + row.shear_arm_a * shear)
    if b.inverse_mass > 0.0:
        b.vx -= b.inverse_mass * px
        b.vy -= b.inverse_mass * py
        b.spin -= b.inverse_inertia * (row.arm_b * normal - turn + row.shear_arm_b * shear)


@kernel
def masses(row: Record, a: Record, b: Record) -> tuple[float, float, float]:
    """Return A (1/kg) of the two normals: of one, mixed, of two."""
    together = a.inverse_mass + b.inverse_mass
    two_a = row.arm_a - row.width
    two_b = row.arm_b - row.width
    turned_a = a.inverse_inertia * row.arm_a
    turned_b = b.inverse_inertia * row.arm_b
    one = together + turned_a * row.arm_a + turned_b * row.arm_b
    mixed = together + turned_a * two_a + turned_b * two_b
    two = together + a.inverse_inertia * two_a * two_a + b.inverse_inertia * two_b * two_b
    return one, mixed, two


@kernel
def warm_row(row: Record, a: Record, b: Record) -> None:
    """Begin with the impulses of the last substep."""
    push(row, a, b, row.normal_one + row.normal_two, row.normal_two, row.shear)


@kernel
def gaps(row: Record, a: Record, b: Record) -> tuple[float, float]:
    """Return both gaps (m) as they are now."""
    slip = slip_of(row, a.dx - b.dx, a.dy - b.dy, a.turned, b.turned)
    return row.gap_one + slip.one, row.gap_two + slip.two


@kernel
def position_row(row: Record, a: Record, b: Record, stepping: Record) -> None:
    """Solve both normals of a row with soft contacts and gaps that may just close."""
    gap_one, gap_two = gaps(row, a, b)
    slip = slip_of(row, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(row, a, b)
    old_one = row.normal_one
    old_two = row.normal_two
    k_one = one + (0.0 if gap_one > 0.0 else stepping.softness) * one
    k_two = two + (0.0 if gap_two > 0.0 else stepping.softness) * two
    q_one = slip.one + (stepping.open_bias if gap_one > 0.0 else stepping.closed_bias) * gap_one
    q_two = slip.two + (stepping.open_bias if gap_two > 0.0 else stepping.closed_bias) * gap_two
    q_one -= one * old_one + mixed * old_two
    q_two -= mixed * old_one + two * old_two
    new_one, new_two = solve_two(k_one, mixed, k_two, q_one, q_two)
    row.normal_one = new_one
    row.normal_two = new_two
    second = new_two - old_two
    push(row, a, b, new_one - old_one + second, second, 0.0)


@kernel
def target(impulse: float, gap: float, approach: float, restitution: float, stepping: Record) -> float:
    """Return what J v of a point has to be at least (m/s) after the velocity pass; -FAR where it does not count.

    A gap that is still open must not slow an approach down: it would take a part of it in the substep before the
    impact, and restitution would vanish for small substeps.
    """
    rebounds = (approach < -stepping.threshold) & (restitution > 0.0)
    least = -restitution * approach if rebounds else -max(gap, 0.0) * stepping.open_bias
    return least if (impulse > 0.0) | (gap <= 0.0) else -FAR


@rare_kernel
def aim(contacts: Contacts, row: Record, a: Record, b: Record) -> None:
    """Fix what the velocity pass has to reach at the points of a row."""
    stepping = contacts.stepping[0]
    gap_one, gap_two = gaps(row, a, b)
    restitution = contacts.touches[row.touch].restitution
    before_a = contacts.before[row.a]
    before_b = contacts.before[row.b]
    u = slip_of(row, before_a.vx - before_b.vx, before_a.vy - before_b.vy, before_a.spin, before_b.spin)
    row.target_one = target(row.normal_one, gap_one, u.one, restitution, stepping)
    row.target_two = target(row.normal_two, gap_two, u.two, restitution, stepping)


@kernel
def shear_limit(touch: Record, normal: float, needed: float, mass: float) -> float:
    """Return the largest shear impulse (N s), given the one that stops all slip and A (1/kg) along the tangent.

    Static friction holds what it can stop within the substep; else kinetic friction at the slip that it leaves.
    """
    static = touch.static_friction
    kinetic = touch.kinetic_friction
    if static == kinetic:
        return kinetic * normal
    if needed <= static * normal:
        return static * normal
    slip = (needed - kinetic * normal) * mass
    return normal * friction_coefficient(static, kinetic, touch.transition_speed, slip)


@kernel
def velocity_row(row: Record, a: Record, b: Record, touch: Record) -> float:
    """Solve both normals of a row without softness, then friction; return the largest change of velocity (m/s)."""
    t_one = row.target_one
    t_two = row.target_two
    if max(t_one, t_two) == -FAR and row.shear == 0.0:  # no normal impulse, so no friction either
        return 0.0
    slip = slip_of(row, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(row, a, b)
    old_one = row.normal_one
    old_two = row.normal_two
    q_one = slip.one - t_one - one * old_one - mixed * old_two
    q_two = slip.two - t_two - mixed * old_one - two * old_two
    new_one, new_two = solve_two(one, mixed, two, q_one, q_two)
    row.normal_one = new_one
    row.normal_two = new_two
    d_one = new_one - old_one
    d_two = new_two - old_two
    normal = d_one + d_two
    # slip along the tangent after the normal impulses
    coupled_a = a.inverse_inertia * row.shear_arm_a
    coupled_b = b.inverse_inertia * row.shear_arm_b
    turn = row.width * d_two
    rate = slip.shear + coupled_a * (row.arm_a * normal - turn) + coupled_b * (row.arm_b * normal - turn)
    mass = a.inverse_mass + b.inverse_mass + coupled_a * row.shear_arm_a + coupled_b * row.shear_arm_b
    needed = row.shear - rate * (1.0 / mass)
    limit = shear_limit(touch, new_one + new_two, abs(needed), mass)
    shear = min(max(needed, -limit), limit)
    d_shear = shear - row.shear
    row.shear = shear
    push(row, a, b, normal, d_two, d_shear)
    return (a.inverse_mass + b.inverse_mass) * max(abs(d_one), abs(d_two), abs(d_shear))


@kernel
def book_row(contacts: Contacts, row: Record, gx: float, gy: float, hx: float, hy: float, book: Record) -> None:
    """Book what the impulses of a row have taken from the energy in this substep, and brought into the supports.

    An impulse times the mean of the velocities before and after all impulses is the energy that it brings; summed over
    all rows that is exact, whatever the order in which impulses were found. Velocities live half a substep before
    positions: the velocity before the impulses has a kick of gravity (`gx`, `gy`, m/s) in it, of which a supported
    body does not fall. The weight's part in the drift, half of `hx`, `hy` (m/s, a whole kick), is not lost.
    """
    if row.normal_one == 0.0 and row.normal_two == 0.0:
        return
    a = contacts.lines[row.a]
    b = contacts.lines[row.b]
    c = contacts.before[row.a]
    d = contacts.before[row.b]
    free = (1.0 if a.inverse_mass > 0.0 else 0.0) - (1.0 if b.inverse_mass > 0.0 else 0.0)
    vx = a.vx - b.vx + c.vx - d.vx + free * (gx - hx)
    vy = a.vy - b.vy + c.vy - d.vy + free * (gy - hy)
    slip = slip_of(row, vx, vy, a.spin + c.spin, b.spin + d.spin)
    book.impacts -= 0.5 * (slip.one * row.normal_one + slip.two * row.normal_two)
    book.friction -= 0.5 * slip.shear * row.shear
    if free != 0.0:
        normal = row.normal_one + row.normal_two
        ux = contacts.stepping[0].support_vx
        uy = contacts.stepping[0].support_vy
        book.to_support -= free * (normal * (row.nx * ux + row.ny * uy) + row.shear * (row.nx * uy - row.ny * ux))
