"""What a substep does to the constraints, four at a time: warm start, position pass, velocity pass, tallies.

Formulas: __init__.py. Velocities are read, changed by all impulses of a constraint and written back. Bodies that are
fixed are never written to, so that constraints of one colour share nothing that changes.

Few blocks wait for one constraint after the other, so sums are put together such that what needs no velocity is there
when the velocities of the constraint before come.

What the velocity pass has to reach at the points of constraints: rebounds, and no approach elsewhere.
"""

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import (
    Lane,
    Lanes,
    branch,
    fields_0,
    four,
    greater,
    is_all,
    lesser,
    load,
    root,
    select,
    store,
    write_fields_0,
)
from blocksim.kernels.nonsmooth import arrays, cone, packs
from blocksim.kernels.nonsmooth.slip import Constraints, Slip, presses, slip_of


@kernel
def gaps(
    pack: Record, lane: Lane, constraint: Constraints, a: packs.Bodies, b: packs.Bodies, bend_time: float
) -> tuple[Lanes, Lanes]:
    """Return both gaps (m) as they are now; `bend_time` (s) is that of slip.py now."""
    slip = slip_of(constraint, a.dx - b.dx, a.dy - b.dy, a.turned, b.turned)
    bent = bend_time * load(lane, pack.bend)
    return load(lane, pack.gap_one) + slip.one + bent, load(lane, pack.gap_two) + slip.two + bent


@kernel
def pulls(constraint: Constraints, a: packs.Bodies, b: packs.Bodies, stepping: Record) -> Lanes:
    """Return by how much gravity changes J v of constraints in a substep (m/s) as long as nothing touches.

    So do loads that act on all bodies. Those on single ones are left out: a rebound is off by their share of a kick.
    """
    free = select(a.inverse_mass > 0.0, 1.0, 0.0) - select(b.inverse_mass > 0.0, 1.0, 0.0)
    return free * (constraint.nx * stepping.pull_x + constraint.ny * stepping.pull_y)


@kernel
def rebound(approach: Lanes, start: Lanes, pull: Lanes, restitution: Lanes, stepping: Record) -> Lanes:
    """Return J v (m/s) that leaves a share e^2 of the energy with which a point meets.

    Positions are half a substep ahead of velocities, so that J v is short of half a `pull` both before and after (not
    at the start of a run: what it lacks there is `lag`). From a gap `start` (m) the point falls on, and the position
    pass leaves it where it touches:

        t + pull / 2 = e sqrt((u + pull / 2)^2 - 2 (pull / h) start)

    With t = -e u an impact at speed u lost 3 g h / u of its energy, on average, however elastic the blocks.
    """
    now = approach + stepping.lag * pull
    square = now * now - 2.0 * stepping.open_bias * pull * greater(start, 0.0)
    return restitution * root(greater(square, 0.0)) - 0.5 * pull


@kernel
def target(impulse: Lanes, inverse_mass: Lanes, gap: Lanes, least: Lanes, stepping: Record) -> Lanes:
    """Return what J v of a point has to be at least (m/s) after the velocity pass; -FAR where it does not count.

    A gap that is still open must not slow an approach down: it would take a part of it in the substep before the
    impact, and restitution would vanish for small substeps.
    """
    return branch(presses(impulse, inverse_mass, stepping) | (gap <= stepping.touch_gap), least, -arrays.FAR)


@kernel
def aim(
    contacts: arrays.Contacts, pack: Record, lane: Lane, constraint: Constraints, a: packs.Bodies, b: packs.Bodies
) -> tuple[Lanes, Lanes]:
    """Set what the velocity pass has to reach at the points of constraints."""
    stepping = contacts.stepping[0]
    gap_one, gap_two = gaps(pack, lane, constraint, a, b, stepping.next_bend_time)
    normal_one = load(lane, pack.normal_one)
    normal_two = load(lane, pack.normal_two)
    if is_all((lesser(gap_one, gap_two) > stepping.touch_gap) & (greater(normal_one, normal_two) <= 0.0)):
        none = 0.0 * gap_one - arrays.FAR
        store(lane, pack.target_one, none)
        store(lane, pack.target_two, none)
        return none, none
    vx_a, vy_a, spin_a, _ = fields_0(lane, contacts.before, pack.a)
    vx_b, vy_b, spin_b, _ = fields_0(lane, contacts.before, pack.b)
    u = slip_of(constraint, vx_a - vx_b, vy_a - vy_b, spin_a, spin_b)
    inverse_mass = a.inverse_mass + b.inverse_mass
    least_one = -branch(gap_one > 0.0, gap_one, 0.0) * stepping.open_bias
    least_two = -branch(gap_two > 0.0, gap_two, 0.0) * stepping.open_bias
    t_one = target(normal_one, inverse_mass, gap_one, least_one, stepping)
    t_two = target(normal_two, inverse_mass, gap_two, least_two, stepping)
    if not is_all((lesser(u.one, u.two) >= -stepping.threshold) | (greater(t_one, t_two) <= -arrays.FAR)):
        t_one, t_two = with_rebounds(contacts, pack, lane, constraint, a, b, u, t_one, t_two)
    store(lane, pack.target_one, t_one)
    store(lane, pack.target_two, t_two)
    return t_one, t_two


@kernel
def with_rebounds(
    contacts: arrays.Contacts,
    pack: Record,
    lane: Lane,
    constraint: Constraints,
    a: packs.Bodies,
    b: packs.Bodies,
    u: Slip,
    t_one: Lanes,
    t_two: Lanes,
) -> tuple[Lanes, Lanes]:
    """Return the targets (m/s) of constraints with those of points that rebound, which approach with u."""
    stepping = contacts.stepping[0]
    restitution = load(lane, pack.restitution)
    pull = pulls(constraint, a, b, stepping)
    after_one = rebound(u.one, load(lane, pack.start_one), pull, restitution, stepping)
    after_two = rebound(u.two, load(lane, pack.start_two), pull, restitution, stepping)
    rebounds = restitution > (-1.0 if stepping.has_cuts else 0.0)  # then it is an impact without any rebound too
    t_one = select(rebounds & (u.one < -stepping.threshold) & (t_one > -arrays.FAR), after_one, t_one)
    t_two = select(rebounds & (u.two < -stepping.threshold) & (t_two > -arrays.FAR), after_two, t_two)
    if stepping.is_guarded and not is_all(greater(t_one, t_two) <= 0.0):
        stepping.has_rebounds = 1
    return t_one, t_two


@kernel
def push(
    contacts: arrays.Contacts,
    pack: Record,
    lane: Lane,
    constraint: Constraints,
    a: packs.Bodies,
    b: packs.Bodies,
    normal: Lanes,
    second: Lanes,
) -> None:
    """Change the velocities of the bodies by a normal impulse (N s) in all, of which `second` at point two."""
    turn = constraint.width * second
    turn_a = constraint.arm_a * normal - turn
    turn_b = constraint.arm_b * normal - turn
    shove(contacts, pack, lane, a, b, (constraint.nx * normal, constraint.ny * normal, turn_a, turn_b))


@kernel
def push_and_drag(
    contacts: arrays.Contacts,
    pack: Record,
    lane: Lane,
    constraint: Constraints,
    a: packs.Bodies,
    b: packs.Bodies,
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
    shove(contacts, pack, lane, a, b, (px, py, turn_a, turn_b))


@kernel
def shove(
    contacts: arrays.Contacts,
    pack: Record,
    lane: Lane,
    a: packs.Bodies,
    b: packs.Bodies,
    impulse: tuple[Lanes, Lanes, Lanes, Lanes],
) -> None:
    """Change the velocities of the bodies by an impulse: along x and y (N s), its moments about both (N m s)."""
    px, py, turn_a, turn_b = impulse
    vx = a.vx + a.inverse_mass * px
    vy = a.vy + a.inverse_mass * py
    spin = a.spin + a.inverse_inertia * turn_a
    write_fields_0(lane, contacts.states, pack.a, a.inverse_mass > 0.0, (vx, vy, spin, a.inverse_mass))
    vx = b.vx - b.inverse_mass * px
    vy = b.vy - b.inverse_mass * py
    spin = b.spin - b.inverse_inertia * turn_b
    write_fields_0(lane, contacts.states, pack.b, b.inverse_mass > 0.0, (vx, vy, spin, b.inverse_mass))


@kernel
def masses(
    pack: Record, lane: Lane, constraint: Constraints, a: packs.Bodies, b: packs.Bodies
) -> tuple[Lanes, Lanes, Lanes]:
    """Return A (1/kg) of the two normals: of one, mixed, of two.

    Of four constraints it is computed again each time, which is cheaper than to load it, of one it is kept.
    """
    if lane is None:
        return packs.normal_masses(constraint, a, b)
    return pack.one, pack.mixed, pack.two


@kernel
def shear_mass(pack: Record, lane: Lane, constraint: Constraints, a: packs.Bodies, b: packs.Bodies) -> Lanes:
    """Return A (1/kg) along the tangent; kept as in masses."""
    if lane is None:
        return packs.tangent_mass(constraint, a, b)
    return pack.along


@kernel
def warm_pack(contacts: arrays.Contacts, pack: Record, lane: Lane) -> None:
    """Begin with the impulses of the last substep."""
    second = load(lane, pack.normal_two)
    normal = load(lane, pack.normal_one) + second
    if not is_all(normal <= 0.0):
        a = packs.bodies_at(contacts, pack.a, lane)
        b = packs.bodies_at(contacts, pack.b, lane)
        push_and_drag(
            contacts, pack, lane, packs.constraints_of(pack, lane), a, b, normal, second, load(lane, pack.shear)
        )


@kernel
def position_pack(contacts: arrays.Contacts, pack: Record, lane: Lane) -> None:
    """Solve both normals of constraints with soft contacts and gaps that may just close."""
    stepping = contacts.stepping[0]
    constraint = packs.constraints_of(pack, lane)
    a = packs.bodies_at(contacts, pack.a, lane)
    b = packs.bodies_at(contacts, pack.b, lane)
    gap_one, gap_two = gaps(pack, lane, constraint, a, b, stepping.bend_time)
    store(lane, pack.start_one, gap_one)
    store(lane, pack.start_two, gap_two)
    slip = slip_of(constraint, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(pack, lane, constraint, a, b)
    old_one = load(lane, pack.normal_one)
    old_two = load(lane, pack.normal_two)
    is_open_one = gap_one > stepping.touch_gap
    is_open_two = gap_two > stepping.touch_gap
    k_one = one + branch(is_open_one, 0.0, stepping.softness) * one
    k_two = two + branch(is_open_two, 0.0, stepping.softness) * two
    bend = stepping.bend_share * load(lane, pack.bend)
    rate_one = bend + branch(is_open_one, stepping.open_bias, stepping.closed_bias) * gap_one
    rate_two = bend + branch(is_open_two, stepping.open_bias, stepping.closed_bias) * gap_two
    q_one = slip.one + (rate_one - (one * old_one + mixed * old_two))
    q_two = slip.two + (rate_two - (mixed * old_one + two * old_two))
    if is_all((lesser(q_one, q_two) >= 0.0) & (greater(old_one, old_two) <= 0.0)):
        return  # gaps that stay open
    new_one, new_two = cone.solve_two(lane, k_one, mixed, k_two, q_one, q_two)
    store(lane, pack.normal_one, new_one)
    store(lane, pack.normal_two, new_two)
    second = new_two - old_two
    push(contacts, pack, lane, constraint, a, b, new_one - old_one + second, second)


@kernel
def reach(
    contacts: arrays.Contacts,
    pack: Record,
    lane: Lane,
    constraint: Constraints,
    a: packs.Bodies,
    b: packs.Bodies,
    t_one: Lanes,
    t_two: Lanes,
) -> Lanes:
    """Solve both normals without softness, then friction; return the largest changes of velocity (m/s)."""
    if is_all((greater(t_one, t_two) <= -arrays.FAR) & (abs(load(lane, pack.shear)) <= 0.0)):
        return 0.0 * t_one  # no normal impulse, so no friction either
    slip = slip_of(constraint, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)
    one, mixed, two = masses(pack, lane, constraint, a, b)
    old_one = load(lane, pack.normal_one)
    old_two = load(lane, pack.normal_two)
    old_shear = load(lane, pack.shear)
    share = contacts.stepping[0].bend_share
    bend = share * load(lane, pack.bend)
    q_one = slip.one + (bend - t_one - (one * old_one + mixed * old_two))
    q_two = slip.two + (bend - t_two - (mixed * old_one + two * old_two))
    new_one, new_two = cone.solve_two(lane, one, mixed, two, q_one, q_two)
    store(lane, pack.normal_one, new_one)
    store(lane, pack.normal_two, new_two)
    d_one = new_one - old_one
    d_two = new_two - old_two
    normal = d_one + d_two
    # slip along the tangent after the normal impulses
    coupled_a = a.inverse_inertia * constraint.shear_arm_a
    coupled_b = b.inverse_inertia * constraint.shear_arm_b
    by_normal = coupled_a * constraint.arm_a + coupled_b * constraint.arm_b
    by_width = (coupled_a + coupled_b) * constraint.width
    rate = (slip.shear + share * load(lane, pack.shear_bend)) + (by_normal * normal - by_width * d_two)
    mass = shear_mass(pack, lane, constraint, a, b)
    needed = old_shear - rate * (1.0 / mass)
    limit = cone.shear_limits(contacts, pack, lane, new_one + new_two, abs(needed), mass)
    shear = cone.shear_within(pack, lane, constraint, a, b, old_shear, needed, limit)
    store(lane, pack.shear, shear)
    d_shear = shear - old_shear
    push_and_drag(contacts, pack, lane, constraint, a, b, normal, d_two, d_shear)
    return (a.inverse_mass + b.inverse_mass) * greater(greater(abs(d_one), abs(d_two)), abs(d_shear))


WARM, POSITION, FIRST_VELOCITY, VELOCITY = range(4)


@kernel
def solve_pack(contacts: arrays.Contacts, pack: Record, lane: Lane, task: int) -> Lanes:
    """Do one task for the constraints of a pack; return the largest changes of velocity (m/s) of a velocity pass."""
    if task == WARM:
        warm_pack(contacts, pack, lane)
        return four(lane, 0.0, 0.0, 0.0, 0.0)
    if task == POSITION:
        position_pack(contacts, pack, lane)
        return four(lane, 0.0, 0.0, 0.0, 0.0)
    constraint = packs.constraints_of(pack, lane)
    a = packs.bodies_at(contacts, pack.a, lane)
    b = packs.bodies_at(contacts, pack.b, lane)
    if task == FIRST_VELOCITY:
        t_one, t_two = aim(contacts, pack, lane, constraint, a, b)
    else:
        t_one, t_two = load(lane, pack.target_one), load(lane, pack.target_two)
    return reach(contacts, pack, lane, constraint, a, b, t_one, t_two)


@kernel
def given_to(
    constraint: Constraints, a: packs.Bodies, b: packs.Bodies, normal_one: Lanes, normal_two: Lanes, shear: Lanes
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
    contacts: arrays.Contacts, then: Records, pack: Record, lane: Lane, gx: float, gy: float
) -> tuple[Lanes, Lanes, Lanes]:
    """Return what normal and shear impulses of constraints have taken from the energy in this substep (J), both twice.

    The third is what they have brought into the supports (J).

    An impulse times the mean of the velocities before (`then`, fields as in BEFORE) and after all impulses is the
    energy that it brings; summed over all constraints that is exact, whatever the order in which impulses were found.
    Both velocities together lack (`gx`, `gy`), m/s, of gravity: they live half a substep before positions, but those
    after a whole kick count without it, as a supported body does not fall.
    """
    normal_one = load(lane, pack.normal_one)
    normal_two = load(lane, pack.normal_two)
    if is_all(normal_one + normal_two <= 0.0):
        return 0.0 * normal_one, 0.0 * normal_one, 0.0 * normal_one
    constraint = packs.constraints_of(pack, lane)
    shear = load(lane, pack.shear)
    a = packs.bodies_at(contacts, pack.a, lane)
    b = packs.bodies_at(contacts, pack.b, lane)
    vx_a, vy_a, spin_a, _ = fields_0(lane, then, pack.a)
    vx_b, vy_b, spin_b, _ = fields_0(lane, then, pack.b)
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


@kernel
def tally_pack(contacts: arrays.Contacts, then: Records, m: int, lane: Lane, gx: float, gy: float) -> None:
    """Tally the constraints of pack m; fields of `then` and (gx, gy) as in taken_by."""
    pack = contacts.packs[m]
    tally = contacts.tallies[m // arrays.TALLY_PACKS]
    normals, shears, gifts = taken_by(contacts, then, pack, lane, gx, gy)
    tally.impacts -= 0.5 * packs.total(lane, normals, pack.count)
    tally.friction -= 0.5 * packs.total(lane, shears, pack.count)
    if contacts.stepping[0].is_shaken:
        tally.to_support += packs.total(lane, gifts, pack.count)
