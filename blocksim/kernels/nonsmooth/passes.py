"""What a substep does to the constraints, four at a time: warm start, position pass, velocity pass, tallies.

Formulas: __init__.py. Velocities are read, changed by all impulses of a constraint and written back. Bodies that are
fixed are never written to, so that constraints of one colour share nothing that changes.

Few blocks wait for one constraint after the other, so sums are put together such that what needs no velocity is there
when the velocities of the constraint before come.
"""

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import (
    Lane,
    Lanes,
    branch,
    fields_0,
    greater,
    is_all,
    lesser,
    load,
    select,
    store,
    write_fields_0,
)
from blocksim.kernels.nonsmooth.aims import aim, gaps
from blocksim.kernels.nonsmooth.arrays import FAR, Contacts
from blocksim.kernels.nonsmooth.cone import shear_limits, shear_within
from blocksim.kernels.nonsmooth.groups import (
    Bodies,
    bodies_at,
    constraints_of,
    normal_masses,
    tangent_mass,
)
from blocksim.kernels.nonsmooth.slip import Constraints, slip_of
from blocksim.kernels.nonsmooth.solve import solve_two


@kernel
def push(
    contacts: Contacts,
    group: Record,
    lane: Lane,
    constraint: Constraints,
    a: Bodies,
    b: Bodies,
    normal: Lanes,
    second: Lanes,
) -> None:
    """Change the velocities of the bodies by a normal impulse (N s) in all, of which `second` at point two."""
    turn = constraint.width * second
    turn_a = constraint.arm_a * normal - turn
    turn_b = constraint.arm_b * normal - turn
    shove(contacts, group, lane, a, b, (constraint.nx * normal, constraint.ny * normal, turn_a, turn_b))


@kernel
def push_and_drag(
    contacts: Contacts,
    group: Record,
    lane: Lane,
    constraint: Constraints,
    a: Bodies,
    b: Bodies,
    normal: Lanes,
    second: Lanes,
    shear: Lanes,
) -> None:
    """Change the velocities of the bodies by normal impulses, as push does, and by one along the tangent (N s)."""
    px = constraint.nx * normal - constraint.ny * shear
    py = constraint.ny * normal + constraint.nx * shear
    turn = constraint.width * second
    turn_a = constraint.arm_a * normal - turn + constraint.shear_arm_a * shear
    turn_b = constraint.arm_b * normal - turn + constraint.shear_arm_b * shear
    shove(contacts, group, lane, a, b, (px, py, turn_a, turn_b))


@kernel
def shove(
    contacts: Contacts, group: Record, lane: Lane, a: Bodies, b: Bodies, impulse: tuple[Lanes, Lanes, Lanes, Lanes]
) -> None:
    """Change the velocities of the bodies by an impulse: along x and y (N s), its moments about both (N m s)."""
    px, py, turn_a, turn_b = impulse
    vx = a.vx + a.inverse_mass * px
    vy = a.vy + a.inverse_mass * py
    spin = a.spin + a.inverse_inertia * turn_a
    write_fields_0(lane, contacts.states, group.a, a.inverse_mass > 0.0, (vx, vy, spin, a.inverse_mass))
    vx = b.vx - b.inverse_mass * px
    vy = b.vy - b.inverse_mass * py
    spin = b.spin - b.inverse_inertia * turn_b
    write_fields_0(lane, contacts.states, group.b, b.inverse_mass > 0.0, (vx, vy, spin, b.inverse_mass))


@kernel
def masses(group: Record, lane: Lane, constraint: Constraints, a: Bodies, b: Bodies) -> tuple[Lanes, Lanes, Lanes]:
    """Return A (1/kg) of the two normals: of one, mixed, of two.

    Of four constraints it is computed again each time, which is cheaper than to load it, of one it is kept.
    """
    if lane is None:
        return normal_masses(constraint, a, b)
    return group.one, group.mixed, group.two


@kernel
def shear_mass(group: Record, lane: Lane, constraint: Constraints, a: Bodies, b: Bodies) -> Lanes:
    """Return A (1/kg) along the tangent; kept as in masses."""
    if lane is None:
        return tangent_mass(constraint, a, b)
    return group.along


@kernel
def warm_group(contacts: Contacts, group: Record, lane: Lane) -> None:
    """Begin with the impulses of the last substep."""
    second = load(lane, group.normal_two)
    normal = load(lane, group.normal_one) + second
    if not is_all(normal <= 0.0):
        a = bodies_at(contacts, group.a, lane)
        b = bodies_at(contacts, group.b, lane)
        push_and_drag(contacts, group, lane, constraints_of(group, lane), a, b, normal, second, load(lane, group.shear))


@kernel
def position_group(contacts: Contacts, group: Record, lane: Lane) -> None:
    """Solve both normals of constraints with soft contacts and gaps that may just close."""
    stepping = contacts.stepping[0]
    constraint = constraints_of(group, lane)
    a = bodies_at(contacts, group.a, lane)
    b = bodies_at(contacts, group.b, lane)
    gap_one, gap_two = gaps(group, lane, constraint, a, b, stepping.bend_time)
    store(lane, group.start_one, gap_one)
    store(lane, group.start_two, gap_two)
    slip = slip_of(constraint, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(group, lane, constraint, a, b)
    old_one = load(lane, group.normal_one)
    old_two = load(lane, group.normal_two)
    is_open_one = gap_one > stepping.touch_gap
    is_open_two = gap_two > stepping.touch_gap
    k_one = one + branch(is_open_one, 0.0, stepping.softness) * one
    k_two = two + branch(is_open_two, 0.0, stepping.softness) * two
    bend = stepping.bend_share * load(lane, group.bend)
    rate_one = bend + branch(is_open_one, stepping.open_bias, stepping.closed_bias) * gap_one
    rate_two = bend + branch(is_open_two, stepping.open_bias, stepping.closed_bias) * gap_two
    q_one = slip.one + (rate_one - (one * old_one + mixed * old_two))
    q_two = slip.two + (rate_two - (mixed * old_one + two * old_two))
    if is_all((lesser(q_one, q_two) >= 0.0) & (greater(old_one, old_two) <= 0.0)):
        return  # gaps that stay open
    new_one, new_two = solve_two(lane, k_one, mixed, k_two, q_one, q_two)
    store(lane, group.normal_one, new_one)
    store(lane, group.normal_two, new_two)
    second = new_two - old_two
    push(contacts, group, lane, constraint, a, b, new_one - old_one + second, second)


@kernel
def first_velocity_group(contacts: Contacts, group: Record, lane: Lane) -> Lanes:
    """Begin the velocity pass of constraints; return the largest changes of velocity (m/s)."""
    constraint = constraints_of(group, lane)
    a = bodies_at(contacts, group.a, lane)
    b = bodies_at(contacts, group.b, lane)
    t_one, t_two = aim(contacts, group, lane, constraint, a, b)
    return reach(contacts, group, lane, constraint, a, b, t_one, t_two)


@kernel
def velocity_group(contacts: Contacts, group: Record, lane: Lane) -> Lanes:
    """Continue the velocity pass of constraints; return the largest changes of velocity (m/s)."""
    constraint = constraints_of(group, lane)
    a = bodies_at(contacts, group.a, lane)
    b = bodies_at(contacts, group.b, lane)
    return reach(contacts, group, lane, constraint, a, b, load(lane, group.target_one), load(lane, group.target_two))


@kernel
def reach(
    contacts: Contacts,
    group: Record,
    lane: Lane,
    constraint: Constraints,
    a: Bodies,
    b: Bodies,
    t_one: Lanes,
    t_two: Lanes,
) -> Lanes:
    """Solve both normals without softness, then friction; return the largest changes of velocity (m/s)."""
    if is_all((greater(t_one, t_two) <= -FAR) & (abs(load(lane, group.shear)) <= 0.0)):
        return 0.0 * t_one  # no normal impulse, so no friction either
    slip = slip_of(constraint, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(group, lane, constraint, a, b)
    old_one = load(lane, group.normal_one)
    old_two = load(lane, group.normal_two)
    old_shear = load(lane, group.shear)
    share = contacts.stepping[0].bend_share
    bend = share * load(lane, group.bend)
    q_one = slip.one + (bend - t_one - (one * old_one + mixed * old_two))
    q_two = slip.two + (bend - t_two - (mixed * old_one + two * old_two))
    new_one, new_two = solve_two(lane, one, mixed, two, q_one, q_two)
    store(lane, group.normal_one, new_one)
    store(lane, group.normal_two, new_two)
    d_one = new_one - old_one
    d_two = new_two - old_two
    normal = d_one + d_two
    # slip along the tangent after the normal impulses
    coupled_a = a.inverse_inertia * constraint.shear_arm_a
    coupled_b = b.inverse_inertia * constraint.shear_arm_b
    by_normal = coupled_a * constraint.arm_a + coupled_b * constraint.arm_b
    by_width = (coupled_a + coupled_b) * constraint.width
    rate = (slip.shear + share * load(lane, group.shear_bend)) + (by_normal * normal - by_width * d_two)
    mass = shear_mass(group, lane, constraint, a, b)
    needed = old_shear - rate * (1.0 / mass)
    limit = shear_limits(contacts, group, lane, new_one + new_two, abs(needed), mass)
    shear = shear_within(group, lane, constraint, a, b, old_shear, needed, limit)
    store(lane, group.shear, shear)
    d_shear = shear - old_shear
    push_and_drag(contacts, group, lane, constraint, a, b, normal, d_two, d_shear)
    return (a.inverse_mass + b.inverse_mass) * greater(greater(abs(d_one), abs(d_two)), abs(d_shear))


@kernel
def given_to(
    constraint: Constraints, a: Bodies, b: Bodies, normal_one: Lanes, normal_two: Lanes, shear: Lanes
) -> Lanes:
    """Return the work (J) of the impulses on body a, did it move as the fixed body of its constraint does."""
    is_b = a.inverse_mass > 0.0
    vx = select(is_b, b.vx, a.vx)
    vy = select(is_b, b.vy, a.vy)
    spin = select(is_b, b.spin, a.spin)
    normal = normal_one + normal_two
    moment = select(is_b, constraint.arm_b, constraint.arm_a) * normal - constraint.width * normal_two
    moment = moment + select(is_b, constraint.shear_arm_b, constraint.shear_arm_a) * shear
    return (
        normal * (constraint.nx * vx + constraint.ny * vy)
        + shear * (constraint.nx * vy - constraint.ny * vx)
        + spin * moment
    )


@kernel
def taken_by(
    contacts: Contacts, then: Records, group: Record, lane: Lane, gx: float, gy: float
) -> tuple[Lanes, Lanes, Lanes]:
    """Return what normal and shear impulses of constraints have taken from the energy in this substep (J), both twice.

    The third is what they have brought into the supports (J).

    An impulse times the mean of the velocities before (`then`, fields as in BEFORE) and after all impulses is the
    energy that it brings; summed over all constraints that is exact, whatever the order in which impulses were found.
    Both velocities together lack (`gx`, `gy`), m/s, of gravity: they live half a substep before positions, but those
    after a whole kick count without it, as a supported body does not fall.
    """
    normal_one = load(lane, group.normal_one)
    normal_two = load(lane, group.normal_two)
    if is_all(normal_one + normal_two <= 0.0):
        return 0.0 * normal_one, 0.0 * normal_one, 0.0 * normal_one
    constraint = constraints_of(group, lane)
    shear = load(lane, group.shear)
    a = bodies_at(contacts, group.a, lane)
    b = bodies_at(contacts, group.b, lane)
    vx_a, vy_a, spin_a, _ = fields_0(lane, then, group.a)
    vx_b, vy_b, spin_b, _ = fields_0(lane, then, group.b)
    free = select(a.inverse_mass > 0.0, 1.0, 0.0) - select(b.inverse_mass > 0.0, 1.0, 0.0)
    vx = a.vx - b.vx + vx_a - vx_b
    vy = a.vy - b.vy + vy_a - vy_b
    if gx != 0.0 or gy != 0.0:  # only in the first substep of a run
        vx = vx + free * gx
        vy = vy + free * gy
    slip = slip_of(constraint, vx, vy, a.spin + spin_a, b.spin + spin_b)
    if contacts.stepping[0].is_shaken:
        given = free * given_to(constraint, a, b, normal_one, normal_two, shear)
    else:
        given = 0.0 * shear
    return slip.one * normal_one + slip.two * normal_two, slip.shear * shear, -given
