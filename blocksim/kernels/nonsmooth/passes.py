"""What a substep does to the constraints, four at a time: warm start, position pass, velocity pass, tallies.

A sweep goes through all packs, colour after colour. Those of one colour share no free body: threads divide them.

Formulas: __init__.py. Velocities are read, changed by all impulses of a constraint and written back. Bodies that are
fixed are never written to, so that constraints of one colour share nothing that changes.

Few blocks wait for one constraint after the other, so sums are put together such that what needs no velocity is there
when the velocities of the constraint before come.

Coulomb's cone: a sweep finds the normal impulse for the shear impulse that there is, and then the shear impulse for
that. Where bodies stick that is Gauss and Seidel's method, which always ends. Where they slide, shear is -f times the
normal impulse, and the next normal impulse changes by the coupling f A_nt/A_nn of it: up and down, slowly to an end
where that is a little less than one, and without one beyond, as with a tall block on its corner and friction of 1.4 and
more. A share of 1/(1 + coupling) of the way to the next shear impulse is exactly that to where both stay. Constraints
that couple so go that way in passes that have not ended after LATE sweeps. Not before: with as much friction there may
be several solutions, and sweeps that go all the way find that in which bodies stick, if there is one. A share of the
way down leaves shear outside the cone, so such passes have a last sweep that goes all of it: impulses that are applied,
kept and tallied obey Coulomb, solved or not.
"""

import math
from typing import Any

from blocksim.kernels.common.arrays import TEAM_SIZE, Integers, Record, Records
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.mechanics import friction_coefficient
from blocksim.kernels.common.simd import (
    Lane,
    Lanes,
    Mask,
    branch,
    fields_0,
    four,
    greater,
    is_all,
    lesser,
    load,
    root,
    select,
    split,
    spread,
    store,
    write_fields_0,
)
from blocksim.kernels.common.tolerances import FLUSH, LATE, STRONG
from blocksim.kernels.nonsmooth import arrays, packs
from blocksim.kernels.nonsmooth.slip import presses, slip_of


@kernel
def shear_limit(material: Record, normal: float, needed: float, mass: float) -> float:
    """Return the largest shear impulse (N s), given the one that stops all slip and A (1/kg) along the tangent.

    Static friction holds what it can stop within the substep; else kinetic friction at the slip that it leaves.
    """
    static = material.static_friction
    kinetic = material.kinetic_friction
    if static == kinetic:
        return kinetic * normal
    if needed <= static * normal:
        return static * normal
    slip = (needed - kinetic * normal) * mass
    return normal * friction_coefficient(static, kinetic, material.transition_speed, slip)


@kernel
def shear_limits(
    contacts: arrays.Contacts, pack: Record, lane: Lane, normal: Lanes, needed: Lanes, mass: Lanes
) -> Lanes:
    """Return the largest shear impulses (N s) of constraints; see shear_limit."""
    if pack.are_simple:
        return load(lane, pack.friction) * normal
    n_0, n_1, n_2, n_3 = split(normal)
    s_0, s_1, s_2, s_3 = split(needed)
    m_0, m_1, m_2, m_3 = split(mass)
    return four(
        lane,
        shear_limit(packs.material_of(contacts, pack, 0), n_0, s_0, m_0),
        shear_limit(packs.material_of(contacts, pack, 1), n_1, s_1, m_1),
        shear_limit(packs.material_of(contacts, pack, 2), n_2, s_2, m_2),
        shear_limit(packs.material_of(contacts, pack, 3), n_3, s_3, m_3),
    )


@kernel
def within(needed: Lanes, limit: Lanes) -> Lanes:
    """Return the shear impulses (N s) nearest to those needed that the limits allow."""
    shear = branch(needed > -limit, needed, -limit)
    return branch(shear < limit, shear, limit)


@kernel
def coupling(pack: Record, lane: Lane, link: packs.Link) -> Lanes:
    """Return the change of a normal impulse over that which it brings by sliding friction, of the worse point (-)."""
    its, a, b = link
    coupled_a = a.inverse_inertia * its.shear_arm_a
    coupled_b = b.inverse_inertia * its.shear_arm_b
    by_one = coupled_a * its.arm_a + coupled_b * its.arm_b
    by_two = by_one - (coupled_a + coupled_b) * its.width
    one, _, two = packs.normal_masses(link)
    return load(lane, pack.friction) * greater(abs(by_one) / one, abs(by_two) / two)


@rare_kernel
def approached(pack: Record, lane: Lane, link: packs.Link, old: Lanes, needed: Lanes, limit: Lanes) -> Lanes:
    """Return shear impulses (N s) as `within` does, of bodies that slide a share of the way there from the old ones."""
    shear = within(needed, limit)
    factor = coupling(pack, lane, link)
    return select((factor > STRONG) & (abs(needed) > limit), old + (shear - old) / (1.0 + factor), shear)


@kernel
def solve_two(
    lane: Lane, k_one: Lanes, k_mixed: Lanes, k_two: Lanes, q_one: Lanes, q_two: Lanes
) -> tuple[Lanes, Lanes]:
    """Return x >= 0 with K x + q >= 0 and x (K x + q) = 0, K symmetric, positive definite: of one or four constraints.

    Of the four cases (both positive, one of them, none) exactly one holds for such a K (K. G. Murty, Linear Algebra
    Appl. 5 (1972) 65-108), so the first that holds is the answer. A very large q leaves a point out.

    Few blocks have single constraints, which are in the same case for many substeps: the processor predicts it, and
    what follows does not wait. Of four all cases are computed and one is chosen, with the same bits: a branch would be
    unpredictable, and a wrong prediction costs more.
    """
    both = 1.0 / (k_one * k_two - k_mixed * k_mixed)  # division is slow; so it does not wait for velocities
    one = (k_mixed * q_two - k_two * q_one) * both
    two = (k_mixed * q_one - k_one * q_two) * both
    if lane is not None:
        if one >= 0.0 and two >= 0.0:
            return one, two
        one_alone = max(-q_one * (1.0 / k_one), 0.0)
        if k_mixed * one_alone + q_two >= 0.0:
            return one_alone, 0.0
        return 0.0, max(-q_two * (1.0 / k_two), 0.0)
    one_alone = greater(-q_one * (1.0 / k_one), 0.0)
    two_alone = greater(-q_two * (1.0 / k_two), 0.0)
    are_both = (one >= 0.0) & (two >= 0.0)
    is_one = k_mixed * one_alone + q_two >= 0.0
    rest_one = select(is_one, one_alone, 0.0)
    rest_two = select(is_one, 0.0, two_alone)
    return select(are_both, one, rest_one), select(are_both, two, rest_two)


@kernel
def gaps(pack: Record, lane: Lane, link: packs.Link, bend_time: float) -> tuple[Lanes, Lanes]:
    """Return both gaps (m) as they are now; `bend_time` (s) is that of slip.py now."""
    a, b = link.a, link.b
    slip = slip_of(link.its, a.dx - b.dx, a.dy - b.dy, a.turned, b.turned)
    bent = bend_time * load(lane, pack.bend)
    return load(lane, pack.gap_one) + slip.one + bent, load(lane, pack.gap_two) + slip.two + bent


@kernel
def pulls(link: packs.Link, stepping: Record) -> Lanes:
    """Return by how much gravity changes J v of constraints in a substep (m/s) as long as nothing touches.

    So do loads that act on all bodies. Those on single ones are left out: a rebound is off by their share of a kick.
    """
    free = select(link.a.inverse_mass > 0.0, 1.0, 0.0) - select(link.b.inverse_mass > 0.0, 1.0, 0.0)
    return free * (link.its.nx * stepping.pull_x + link.its.ny * stepping.pull_y)


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
def meets_flush(u_one: Lanes, u_two: Lanes, apart: Lanes, width: Lanes, stepping: Record) -> Mask:
    """Return True where two faces meet as faces: both points approach (m/s), and their gaps (m) are nearly the same.

    Both points share such a blow if one of them is hit. With one approach at both, J v = -e u at both leaves no spin of
    one face against the other, and energy as e says; it is the same for mirrored scenes, and as both impulses push, the
    resultant lies within the faces. A corner that is hit alone, since the other closes in the next substep for a gap of
    1e-13 m, would turn half of the energy of a frontal blow into spins.
    """
    return (greater(u_one, u_two) < -stepping.threshold) & (abs(apart) <= FLUSH * width)


@kernel
def aim(contacts: arrays.Contacts, pack: Record, lane: Lane, link: packs.Link) -> tuple[Lanes, Lanes]:
    """Set what the velocity pass has to reach at the points of constraints: rebounds, and no approach elsewhere."""
    stepping = contacts.stepping[0]
    gap_one, gap_two = gaps(pack, lane, link, stepping.next_bend_time)
    normal_one = load(lane, pack.normal_one)
    normal_two = load(lane, pack.normal_two)
    if is_all((lesser(gap_one, gap_two) > stepping.touch_gap) & (greater(normal_one, normal_two) <= 0.0)):
        none = 0.0 * gap_one - arrays.FAR
        store(lane, pack.target_one, none)
        store(lane, pack.target_two, none)
        return none, none
    u = packs.slip_before(contacts, pack, lane, link.its)
    inverse_mass = link.a.inverse_mass + link.b.inverse_mass
    least_one = -branch(gap_one > 0.0, gap_one, 0.0) * stepping.open_bias
    least_two = -branch(gap_two > 0.0, gap_two, 0.0) * stepping.open_bias
    t_one = target(normal_one, inverse_mass, gap_one, least_one, stepping)
    t_two = target(normal_two, inverse_mass, gap_two, least_two, stepping)
    if not is_all((lesser(u.one, u.two) >= -stepping.threshold) | (greater(t_one, t_two) <= -arrays.FAR)):
        meets = meets_flush(u.one, u.two, gap_one - gap_two, link.its.width, stepping)
        t_one = select(meets & (t_two > -arrays.FAR), least_one, t_one)
        t_two = select(meets & (t_one > -arrays.FAR), least_two, t_two)
        restitution = load(lane, pack.restitution)
        pull = pulls(link, stepping)
        after_one = rebound(u.one, load(lane, pack.start_one), pull, restitution, stepping)
        after_two = rebound(u.two, load(lane, pack.start_two), pull, restitution, stepping)
        rebounds = restitution > (-1.0 if stepping.is_guarded else 0.0)  # then it is an impact without any rebound too
        t_one = select(rebounds & (u.one < -stepping.threshold) & (t_one > -arrays.FAR), after_one, t_one)
        t_two = select(rebounds & (u.two < -stepping.threshold) & (t_two > -arrays.FAR), after_two, t_two)
        if stepping.is_guarded and not is_all(greater(t_one, t_two) <= 0.0):
            stepping.has_rebounds = 1
    store(lane, pack.target_one, t_one)
    store(lane, pack.target_two, t_two)
    return t_one, t_two


@kernel
def push(
    contacts: arrays.Contacts, pack: Record, lane: Lane, link: packs.Link, normal: Lanes, second: Lanes, shear: Any
) -> None:
    """Change the velocities of the bodies by impulses (N s), along the normal in all, of which `second` at point two.

    And along the tangent by `shear`, None for none.
    """
    its, a, b = link
    px = its.nx * normal
    py = its.ny * normal
    turn = its.width * second
    turn_a = its.arm_a * normal - turn
    turn_b = its.arm_b * normal - turn
    if shear is not None:
        px = px - its.ny * shear
        py = py + its.nx * shear
        turn_a = turn_a + its.shear_arm_a * shear
        turn_b = turn_b + its.shear_arm_b * shear
    vx = a.vx + a.inverse_mass * px
    vy = a.vy + a.inverse_mass * py
    spin = a.spin + a.inverse_inertia * turn_a
    write_fields_0(lane, contacts.states, pack.a, a.inverse_mass > 0.0, (vx, vy, spin, a.inverse_mass))
    vx = b.vx - b.inverse_mass * px
    vy = b.vy - b.inverse_mass * py
    spin = b.spin - b.inverse_inertia * turn_b
    write_fields_0(lane, contacts.states, pack.b, b.inverse_mass > 0.0, (vx, vy, spin, b.inverse_mass))


@kernel
def masses(pack: Record, lane: Lane, link: packs.Link) -> tuple[Lanes, Lanes, Lanes]:
    """Return A (1/kg) of the two normals: of one, mixed, of two.

    Of four constraints it is computed again each time, which is cheaper than to load it, of one it is kept.
    """
    if lane is None:
        return packs.normal_masses(link)
    return pack.one, pack.mixed, pack.two


@kernel
def shear_mass(pack: Record, lane: Lane, link: packs.Link) -> Lanes:
    """Return A (1/kg) along the tangent; kept as in masses."""
    if lane is None:
        return packs.tangent_mass(link)
    return pack.along


@kernel
def warm_pack(contacts: arrays.Contacts, pack: Record, lane: Lane) -> None:
    """Begin with the impulses of the last substep."""
    second = load(lane, pack.normal_two)
    normal = load(lane, pack.normal_one) + second
    if not is_all(normal <= 0.0):
        push(contacts, pack, lane, packs.link_of(contacts, pack, lane), normal, second, load(lane, pack.shear))


@kernel
def position_pack(contacts: arrays.Contacts, pack: Record, lane: Lane) -> None:
    """Solve both normals of constraints with soft contacts and gaps that may just close."""
    stepping = contacts.stepping[0]
    link = packs.link_of(contacts, pack, lane)
    gap_one, gap_two = gaps(pack, lane, link, stepping.bend_time)
    store(lane, pack.start_one, gap_one)
    store(lane, pack.start_two, gap_two)
    slip = packs.slip_now(link)
    one, mixed, two = masses(pack, lane, link)
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
    new_one, new_two = solve_two(lane, k_one, mixed, k_two, q_one, q_two)
    store(lane, pack.normal_one, new_one)
    store(lane, pack.normal_two, new_two)
    second = new_two - old_two
    push(contacts, pack, lane, link, new_one - old_one + second, second, None)


@kernel
def velocity_pack(contacts: arrays.Contacts, pack: Record, lane: Lane, is_first: bool) -> Lanes:
    """Solve both normals without softness, then friction; return the largest changes of velocity (m/s)."""
    link = packs.link_of(contacts, pack, lane)
    if is_first:
        t_one, t_two = aim(contacts, pack, lane, link)
    else:
        t_one, t_two = load(lane, pack.target_one), load(lane, pack.target_two)
    if is_all((greater(t_one, t_two) <= -arrays.FAR) & (abs(load(lane, pack.shear)) <= 0.0)):
        return 0.0 * t_one  # no normal impulse, so no friction either
    slip = packs.slip_now(link)
    one, mixed, two = masses(pack, lane, link)
    old_one = load(lane, pack.normal_one)
    old_two = load(lane, pack.normal_two)
    old_shear = load(lane, pack.shear)
    share = contacts.stepping[0].bend_share
    bend = share * load(lane, pack.bend)
    q_one = slip.one + (bend - t_one - (one * old_one + mixed * old_two))
    q_two = slip.two + (bend - t_two - (mixed * old_one + two * old_two))
    new_one, new_two = solve_two(lane, one, mixed, two, q_one, q_two)
    store(lane, pack.normal_one, new_one)
    store(lane, pack.normal_two, new_two)
    d_one = new_one - old_one
    d_two = new_two - old_two
    normal = d_one + d_two
    # slip along the tangent after the normal impulses
    its, a, b = link
    coupled_a = a.inverse_inertia * its.shear_arm_a
    coupled_b = b.inverse_inertia * its.shear_arm_b
    by_normal = coupled_a * its.arm_a + coupled_b * its.arm_b
    by_width = (coupled_a + coupled_b) * its.width
    rate = (slip.shear + share * load(lane, pack.shear_bend)) + (by_normal * normal - by_width * d_two)
    mass = shear_mass(pack, lane, link)
    needed = old_shear - rate * (1.0 / mass)
    limit = shear_limits(contacts, pack, lane, new_one + new_two, abs(needed), mass)
    if pack.is_coupled:
        shear = approached(pack, lane, link, old_shear, needed, limit)
    else:
        shear = within(needed, limit)
    store(lane, pack.shear, shear)
    d_shear = shear - old_shear
    push(contacts, pack, lane, link, normal, d_two, d_shear)
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
    return velocity_pack(contacts, pack, lane, task == FIRST_VELOCITY)


@kernel
def given_to(link: packs.Link, normal_one: Lanes, normal_two: Lanes, shear: Lanes) -> Lanes:
    """Return the work (J) of the impulses on body a, did it move as the fixed body of its constraint does."""
    its, a, b = link
    is_b = a.inverse_mass > 0.0
    vx = select(is_b, b.vx, a.vx)
    vy = select(is_b, b.vy, a.vy)
    spin = select(is_b, b.spin, a.spin)
    normal = normal_one + normal_two
    moment = select(is_b, its.arm_b, its.arm_a) * normal - its.width * normal_two
    moment = moment + select(is_b, its.shear_arm_b, its.shear_arm_a) * shear
    return normal * (its.nx * vx + its.ny * vy) + shear * (its.nx * vy - its.ny * vx) + spin * moment


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
    link = packs.link_of(contacts, pack, lane)
    shear = load(lane, pack.shear)
    _, a, b = link
    vx_a, vy_a, spin_a, _ = fields_0(lane, then, pack.a)
    vx_b, vy_b, spin_b, _ = fields_0(lane, then, pack.b)
    free = select(a.inverse_mass > 0.0, 1.0, 0.0) - select(b.inverse_mass > 0.0, 1.0, 0.0)
    vx = a.vx - b.vx + vx_a - vx_b
    vy = a.vy - b.vy + vy_a - vy_b
    if gx != 0.0 or gy != 0.0:  # only in the first substep of a run
        vx = vx + free * gx
        vy = vy + free * gy
    slip = slip_of(link.its, vx, vy, a.spin + spin_a, b.spin + spin_b)
    if contacts.stepping[0].is_shaken:
        given = free * given_to(link, normal_one, normal_two, shear)
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


@kernel
def range_of_thread(begin: int, end: int, k: int, size: int) -> tuple[int, int]:
    """Return where the range of thread k begins and ends: whole tallies, so that no two threads write to one."""
    if size == 1:
        return begin, end
    most = arrays.TALLY_PACKS
    blocks = (end - begin + most - 1) // most
    return min(end, begin + blocks * k // size * most), min(end, begin + blocks * (k + 1) // size * most)


@kernel
def go_through(contacts: arrays.Contacts, task: int, begin: int, end: int) -> float:
    """Do a task of passes.py for some packs; return the largest change of velocity (m/s) of a velocity pass."""
    largest = spread(0.0)
    single = 0.0
    for m in range(begin, end):
        pack = contacts.packs[m]
        if pack.count == 1:
            single = greater(solve_pack(contacts, pack, 0, task), single)
        else:
            largest = greater(solve_pack(contacts, pack, None, task), largest)
    return max(single, packs.highest(largest))


@kernel
def tally_constraints(contacts: arrays.Contacts, begin: int, end: int, gx: float, gy: float) -> None:
    """Tally the constraints of some packs; (gx, gy), m/s, is what velocities lack of gravity."""
    for m in range(begin, end):
        pack = contacts.packs[m]
        if pack.count == 1:
            tally_pack(contacts, contacts.before, m, 0, gx, gy)
        else:
            tally_pack(contacts, contacts.before, m, None, gx, gy)


@kernel
def sweep(contacts: arrays.Contacts, task: int, team: Integers, k: int) -> float:
    """Do one task for all packs, colour after colour; return the largest change of velocity (m/s) of thread k.

    For one thread colours are one sequence of packs, the same.
    """
    largest = 0.0
    size = team[TEAM_SIZE]
    for colour in range(1 if size == 1 else contacts.stepping[0].colours):
        begin = 0 if size == 1 else contacts.ends[colour]
        end = contacts.stepping[0].pack_count if size == 1 else contacts.ends[colour + 1]
        if begin < end:
            first, last = range_of_thread(begin, end, k, 1 if colour == arrays.COLOURS - 1 else size)
            if colour < arrays.COLOURS - 1 or k == 0:
                largest = max(largest, go_through(contacts, task, first, last))
            barrier(team)
    return largest


@kernel
def agree(contacts: arrays.Contacts, team: Integers, k: int, number: int, largest: float) -> float:
    """Return the largest of what all threads have found; `number` distinguishes one question from the next."""
    size = team[TEAM_SIZE]
    if size == 1:
        return largest
    slot = number % 2
    contacts.residuals[slot, 8 * k] = largest
    barrier(team)
    for other in range(size):
        largest = max(largest, contacts.residuals[slot, 8 * other])
    return largest


@rare_kernel
def hold_back(contacts: arrays.Contacts, team: Integers, k: int, is_late: bool) -> None:
    """Let friction that couples strongly go a share of the way from now on, or all of it again; see the top."""
    first, last = range_of_thread(0, contacts.stepping[0].pack_count, k, team[TEAM_SIZE])
    for m in range(first, last):
        pack = contacts.packs[m]
        if pack.count == 1:
            pack.is_coupled = is_late and not is_all(coupling(pack, 0, packs.link_of(contacts, pack, 0)) <= STRONG)
        else:
            pack.is_coupled = is_late and not is_all(
                coupling(pack, None, packs.link_of(contacts, pack, None)) <= STRONG
            )
        if pack.is_coupled:
            contacts.stepping[0].has_held = 1  # the same by every thread
    barrier(team)


@kernel
def velocity_pass(contacts: arrays.Contacts, team: Integers, k: int, task: int, tolerance: float) -> None:
    """Sweep until no impulse changes a velocity by more than the tolerance (m/s), or as often as allowed."""
    stepping = contacts.stepping[0]
    largest = math.inf
    sweeps = 0
    while largest > tolerance and sweeps < stepping.velocity_sweeps:
        if sweeps == LATE:
            hold_back(contacts, team, k, True)
        sweeps += 1
        largest = agree(contacts, team, k, sweeps, sweep(contacts, task, team, k))
        task = VELOCITY
    is_solved = largest <= tolerance
    if sweeps > LATE:
        hold_back(contacts, team, k, False)
        if stepping.has_held:  # whatever it leaves, within the cone
            sweeps += 1
            largest = agree(contacts, team, k, sweeps, sweep(contacts, task, team, k))
    if k == 0:
        stepping.has_held = 0
        stepping.sweeps += sweeps
        stepping.passes += 1
        stepping.residual = largest
        if not is_solved:
            stepping.unsolved += 1
            stepping.worst_residual = max(stepping.worst_residual, largest)
