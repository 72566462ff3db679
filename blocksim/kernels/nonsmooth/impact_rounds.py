"""A round of impacts: contact groups, the energy of each, and what is done to the constraints of those hit; impacts.py.

A contact group is the free bodies that touch one another in a substep, supports apart. Fixed bodies join no group, as
no impulse moves them: two blocks on one table are independent.
"""

import math

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.simd import WIDTH, Lane, Lanes, Mask, greater, lesser, load, select, store
from blocksim.kernels.common.tolerances import IMPACT_ROUND_OFF, UPRIGHT
from blocksim.kernels.nonsmooth import arrays, packs, passes, slip


@rare_kernel
def root_of(bodies: Records, i: int) -> int:
    """Return the body that stands for the group of body i, so far; shortens the way there."""
    while bodies[i].root != i:
        bodies[i].root = bodies[bodies[i].root].root
        i = bodies[i].root
    return i


@rare_kernel
def of_constraint(contacts: arrays.Contacts, pack: Record, lane: int) -> Record:
    """Return the record of a free body of a constraint."""
    a = pack.a[lane]
    return contacts.impacts[a if contacts.states[a].inverse_mass > 0.0 else pack.b[lane]]


@rare_kernel
def find_contact_groups(contacts: arrays.Contacts) -> None:
    """Join the bodies of all constraints with a point that counts, and mark the groups in which anything rebounds."""
    states, bodies = contacts.states, contacts.impacts
    count = contacts.stepping[0].pack_count
    for i in range(bodies.size):
        bodies[i].root = i
        bodies[i].is_hit = 0
    for m in range(count):
        pack = contacts.packs[m]
        for lane in range(pack.count):
            a, b = pack.a[lane], pack.b[lane]
            are_free = states[a].inverse_mass > 0.0 and states[b].inverse_mass > 0.0
            if are_free and max(pack.target_one[lane], pack.target_two[lane]) > -arrays.FAR:
                one, other = root_of(bodies, a), root_of(bodies, b)
                bodies[max(one, other)].root = min(one, other)
    for m in range(count):
        pack = contacts.packs[m]
        for lane in range(pack.count):
            if max(pack.target_one[lane], pack.target_two[lane]) > 0.0:
                bodies[root_of(bodies, of_constraint(contacts, pack, lane).root)].is_hit = 1
    for i in range(bodies.size):
        bodies[i].root = root_of(bodies, i)
        bodies[i].is_hit = bodies[bodies[i].root].is_hit


@rare_kernel
def energy(contacts: arrays.Contacts, state: Record, vx: float, vy: float, spin: float) -> float:
    """Return the kinetic energy (J) of a body, seen from the supports: those that move may well bring energy in."""
    ux = vx - contacts.stepping[0].support_vx
    uy = vy - contacts.stepping[0].support_vy
    return 0.5 * ((ux * ux + uy * uy) / state.inverse_mass + spin * spin / state.inverse_inertia)


@rare_kernel
def count_work(contacts: arrays.Contacts) -> None:
    """Take the work of driven bodies, seen from the supports, out of the energies of groups after a round.

    What a body that moves differently from the supports brings in is not created by impacts.
    """
    stepping = contacts.stepping[0]
    for m in range(stepping.pack_count if stepping.is_driven else 0):
        pack = contacts.packs[m]
        for lane in range(pack.count if contacts.impact_lanes[m].is_hit else 0):
            root = contacts.impacts[of_constraint(contacts, pack, lane).root]
            root.now -= work_of(contacts, pack, lane)


@rare_kernel
def work_of(contacts: arrays.Contacts, pack: Record, lane: int) -> float:
    """Return the work (J) that the impulses of a constraint bring into its free body, seen from the supports."""
    states = contacts.states
    is_b = states[pack.a[lane]].inverse_mass > 0.0
    fixed = states[pack.b[lane] if is_b else pack.a[lane]]
    if fixed.inverse_mass > 0.0:
        return 0.0
    ux = fixed.vx - contacts.stepping[0].support_vx
    uy = fixed.vy - contacts.stepping[0].support_vy
    normal = pack.normal_one[lane] + pack.normal_two[lane]
    shear = pack.shear[lane]
    nx = pack.nx[lane]
    ny = pack.ny[lane]
    moment = (pack.arm_b[lane] if is_b else pack.arm_a[lane]) * normal - pack.width[lane] * pack.normal_two[lane]
    moment += (pack.shear_arm_b[lane] if is_b else pack.shear_arm_a[lane]) * shear
    work = normal * (nx * ux + ny * uy) + shear * (nx * uy - ny * ux) + fixed.spin * moment
    return work if is_b else -work


@rare_kernel
def has_gain(root: Record) -> bool:
    """Return True if impacts have created energy in a group."""
    return root.now > root.then * (1.0 + IMPACT_ROUND_OFF)


@rare_kernel
def weigh(contacts: arrays.Contacts) -> bool:
    """Sum up the energies of all groups before and after a round; return whether any has gained."""
    states = contacts.states
    bodies = contacts.impacts
    for body in bodies:
        body.then = body.now = 0.0
        body.side = arrays.HIGH
    for i in range(bodies.size):
        body = bodies[i]
        if body.is_hit and states[i].inverse_mass > 0.0:
            root = bodies[body.root]
            root.then += energy(contacts, states[i], body.vx, body.vy, body.spin)
            root.now += energy(contacts, states[i], states[i].vx, states[i].vy, states[i].spin)
    count_work(contacts)
    gains = False
    for body in bodies:
        gains = gains or has_gain(body)
    return gains


@rare_kernel
def clear(pack: Record) -> None:
    """Forget the impulses of a pack."""
    none = 0.0 * load(None, pack.normal_one)
    store(None, pack.normal_one, none)
    store(None, pack.normal_two, none)
    store(None, pack.shear, none)


@kernel
def keep_held(contacts: arrays.Contacts, begin: int, end: int) -> None:
    """Keep the normal impulses with which a substep begins for some packs: they tell what presses."""
    for m in range(begin, end):
        pack = contacts.packs[m]
        store(None, contacts.impact_lanes[m].held, load(None, pack.normal_one) + load(None, pack.normal_two))


@rare_kernel
def hold(scene: arrays.Nonsmooth, begin: int, end: int, share: float) -> None:
    """Let constraints of some packs press that did so before an impact, in the first substep after it.

    At the start of a run, with `share` 1, else 0, all those press that are not upright: nothing is known of them yet.
    """
    contacts = scene.contacts
    gx, gy = share * scene.world.controls[0].gravity_x, share * scene.world.controls[0].gravity_y
    least = UPRIGHT * math.hypot(gx, gy)
    for m in range(begin, end):
        pack = contacts.packs[m]
        for lane in range(WIDTH):
            constraint = contacts.constraints[pack.constraint[lane]]
            across = abs(constraint.nx * gx + constraint.ny * gy)
            if constraint.is_struck == arrays.FORGOTTEN or across > least:
                contacts.impact_lanes[m].held[lane] = arrays.FAR
        for lane in range(pack.count):
            contacts.constraints[pack.constraint[lane]].is_struck = arrays.NOT_STRUCK


@rare_kernel
def begin_rounds(contacts: arrays.Contacts, begin: int, end: int) -> None:
    """Keep what the velocity pass has found for some packs, and leave all constraints out of those to come.

    Of groups that are hit the impulses of all rounds are summed up from zero; others in the packs are not aimed at.
    """
    for m in range(begin, end):
        pack = contacts.packs[m]
        lanes = contacts.impact_lanes[m]
        none = 0.0 * load(None, pack.normal_one) - arrays.FAR
        store(None, lanes.normal_one, load(None, pack.normal_one))
        store(None, lanes.normal_two, load(None, pack.normal_two))
        store(None, lanes.shear, load(None, pack.shear))
        store(None, lanes.target_one, load(None, pack.target_one))
        store(None, lanes.target_two, load(None, pack.target_two))
        store(None, lanes.rise_one, none)
        store(None, lanes.rise_two, none)
        lanes.is_hit = 0
        for lane in range(pack.count):
            if of_constraint(contacts, pack, lane).is_hit:
                lanes.is_hit = 1
        for lane in range(WIDTH if lanes.is_hit else 0):
            if of_constraint(contacts, pack, min(lane, pack.count - 1)).is_hit:
                lanes.normal_one[lane] = lanes.normal_two[lane] = lanes.shear[lane] = 0.0
            else:
                lanes.target_one[lane] = lanes.target_two[lane] = -arrays.FAR
        store(None, pack.target_one, none)
        store(None, pack.target_two, none)
        clear(pack)


@rare_kernel
def aim_point(
    u: Lanes, start: Lanes, active: Lanes, after: Lanes, bend: Lanes, held: Mask, stepping: Record
) -> tuple[Lanes, Mask]:
    """Return the target (m/s) of a point in the next round, and whether it is hit and has to reach `after`.

    A point that is not `held` does not press: it waits until what it touches comes nearer.
    """
    counts = active > -arrays.FAR
    is_hit = counts & (u < -stepping.threshold)
    rests = counts & held & (abs(u) <= stepping.threshold) & (start <= stepping.rest_gap)
    return select(is_hit, bend + after, select(rests, bend - greater(u, 0.0), -arrays.FAR)), is_hit


@rare_kernel
def least_after(u: Lanes, last: Lanes, pull: Lanes, e: Lanes) -> Lanes:
    """Return what an approach u (m/s) has to become in a round, so that it is `last` once gravity has added its pull.

    Where gravity pulls back what is missing then is added after all rounds; what is too much could not be taken away.
    """
    return select(pull > 0.0, greater(last - pull, 0.0), -e * u)


@rare_kernel
def aim_pack(contacts: arrays.Contacts, m: int, lane: Lane, is_first: bool) -> Lanes:
    """Set what a round has to reach at the points of a pack; return 1 for constraints that are hit, 0 for others."""
    stepping = contacts.stepping[0]
    pack = contacts.packs[m]
    lanes = contacts.impact_lanes[m]
    link = packs.link_of(contacts, pack, lane)
    u = packs.slip_now(link)
    e = load(lane, pack.restitution)
    bend = stepping.bend_share * load(lane, pack.bend)
    pull = passes.pulls(link, stepping)
    start_one = load(lane, pack.start_one)
    start_two = load(lane, pack.start_two)
    old_one = load(lane, lanes.target_one)
    old_two = load(lane, lanes.target_two)
    meets = passes.meets_flush(u.one, u.two, start_one - start_two, link.its.width, stepping)
    active_one = select(meets, greater(old_one, old_two), old_one)
    active_two = select(meets, greater(old_one, old_two), old_two)
    store(lane, lanes.target_one, active_one)
    store(lane, lanes.target_two, active_two)
    last_one = old_one if is_first else -e * u.one - 0.5 * pull
    last_two = old_two if is_first else -e * u.two - 0.5 * pull
    after_one = least_after(u.one, last_one, pull, e)
    after_two = least_after(u.two, last_two, pull, e)
    held = slip.presses(load(lane, lanes.held), link.a.inverse_mass + link.b.inverse_mass, stepping)
    t_one, hit_one = aim_point(u.one, start_one, active_one, after_one, bend, held, stepping)
    t_two, hit_two = aim_point(u.two, start_two, active_two, after_two, bend, held, stepping)
    store(lane, pack.target_one, t_one)
    store(lane, pack.target_two, t_two)
    store(lane, lanes.all_one, t_one)
    store(lane, lanes.all_two, t_two)
    rise_one = load(lane, lanes.rise_one)
    rise_two = load(lane, lanes.rise_two)
    more_one = select(pull < 0.0, last_one + e * u.one, 0.0)
    more_two = select(pull < 0.0, last_two + e * u.two, 0.0)
    store(lane, lanes.rise_one, select(hit_one & (rise_one <= -arrays.FAR), more_one, rise_one))
    store(lane, lanes.rise_two, select(hit_two & (rise_two <= -arrays.FAR), more_two, rise_two))
    return select(hit_one | hit_two, 1.0 + 0.0 * t_one, 0.0 * t_one)


@rare_kernel
def aim_round(contacts: arrays.Contacts, begin: int, end: int, is_first: bool) -> float:
    """Begin a round for some packs; return 1 where any point is hit, else 0."""
    hits = 0.0
    for m in range(begin, end):
        if contacts.impact_lanes[m].is_hit:
            pack = contacts.packs[m]
            clear(pack)
            if pack.count == 1:
                hits = max(hits, aim_pack(contacts, m, 0, is_first))
            else:
                hits = max(hits, packs.highest(aim_pack(contacts, m, None, is_first)))
    return hits


@rare_kernel
def tally_round(contacts: arrays.Contacts, begin: int, end: int, gx: float, gy: float) -> None:
    """Tally a round for some packs, and sum up its impulses; (gx, gy) as in taken_by."""
    for m in range(begin, end):
        lanes = contacts.impact_lanes[m]
        if lanes.is_hit:
            pack = contacts.packs[m]
            if pack.count == 1:
                passes.tally_pack(contacts, contacts.impacts, m, 0, gx, gy)
            else:
                passes.tally_pack(contacts, contacts.impacts, m, None, gx, gy)
            store(None, lanes.normal_one, load(None, lanes.normal_one) + load(None, pack.normal_one))
            store(None, lanes.normal_two, load(None, lanes.normal_two) + load(None, pack.normal_two))
            store(None, lanes.shear, load(None, lanes.shear) + load(None, pack.shear))


@rare_kernel
def aim_rest_of(contacts: arrays.Contacts, m: int, lane: Lane) -> None:
    """Set what the points of a pack keep after all impacts: their rebound against gravity, else no approach.

    Two free bodies that only touched have nothing to rebound against: what moves slower than the threshold pushes one
    of them, and must not push the other away from it.
    """
    stepping = contacts.stepping[0]
    pack = contacts.packs[m]
    lanes = contacts.impact_lanes[m]
    link = packs.link_of(contacts, pack, lane)
    gap_one, gap_two = passes.gaps(pack, lane, link, stepping.next_bend_time)
    u = packs.slip_before(contacts, pack, lane, link.its)
    bend = stepping.bend_share * load(lane, pack.bend)
    are_free = lesser(link.a.inverse_mass, link.b.inverse_mass) > 0.0
    held = slip.presses(load(lane, lanes.held), link.a.inverse_mass + link.b.inverse_mass, stepping)
    none = 0.0 * bend - arrays.FAR
    rise_one = select(are_free, select(held, load(lane, lanes.rise_one), none), load(lane, lanes.rise_one))
    rise_two = select(are_free, select(held, load(lane, lanes.rise_two), none), load(lane, lanes.rise_two))
    one = rest_target(u.one, rise_one, bend, gap_one, stepping)
    two = rest_target(u.two, rise_two, bend, gap_two, stepping)
    store(lane, pack.target_one, select(load(lane, lanes.target_one) > -arrays.FAR, one, -arrays.FAR))
    store(lane, pack.target_two, select(load(lane, lanes.target_two) > -arrays.FAR, two, -arrays.FAR))


@rare_kernel
def rest_target(u: Lanes, rise: Lanes, bend: Lanes, gap: Lanes, stepping: Record) -> Lanes:
    """Return what a point has to reach at least (m/s) in the velocity pass after all impacts, u after the last one."""
    least = -greater(gap, 0.0) * stepping.open_bias
    return select((rise > -arrays.FAR) & (u > 0.0), greater(u + rise, 0.0) + bend, least)


@rare_kernel
def aim_rest(contacts: arrays.Contacts, begin: int, end: int) -> None:
    """Begin the velocity pass after all impacts for some packs."""
    for m in range(begin, end):
        if contacts.impact_lanes[m].is_hit:
            pack = contacts.packs[m]
            clear(pack)
            if pack.count == 1:
                aim_rest_of(contacts, m, 0)
            else:
                aim_rest_of(contacts, m, None)


@rare_kernel
def bring_back(contacts: arrays.Contacts, begin: int, end: int, are_hit: bool) -> None:
    """Restore the impulses of groups that were not hit; give those that were hit the impulses of all rounds.

    Impacts are over, so that no substep begins with their impulses; at the end of a step they are reported.
    """
    for m in range(begin, end):
        pack = contacts.packs[m]
        lanes = contacts.impact_lanes[m]
        for lane in range(WIDTH):  # copies find the same
            is_hit = of_constraint(contacts, pack, min(lane, pack.count - 1)).is_hit == 1
            if is_hit == are_hit:
                if lanes.normal_one[lane] + lanes.normal_two[lane] > 0.0 and is_hit:
                    states = contacts.states
                    inverse_mass = states[pack.a[lane]].inverse_mass + states[pack.b[lane]].inverse_mass
                    is_held = slip.presses(lanes.held[lane], inverse_mass, contacts.stepping[0])
                    contacts.constraints[pack.constraint[lane]].is_struck = (
                        arrays.STRUCK_AT_REST if is_held else arrays.STRUCK
                    )
                pack.normal_one[lane] += lanes.normal_one[lane]
                pack.normal_two[lane] += lanes.normal_two[lane]
                pack.shear[lane] += lanes.shear[lane]


@rare_kernel
def forget_struck(contacts: arrays.Contacts, begin: int, end: int) -> None:
    """Let some constraints begin a step without the impulses of impacts: nothing presses on them any more.

    Those that pressed before are still known, for the first substep; see hold.
    """
    for r in range(begin, end):
        constraint = contacts.constraints[r]
        if constraint.is_struck == arrays.STRUCK or constraint.is_struck == arrays.STRUCK_AT_REST:
            constraint.normal_one = constraint.normal_two = constraint.shear = 0.0
            if constraint.is_struck == arrays.STRUCK_AT_REST:
                constraint.is_struck = arrays.FORGOTTEN
                contacts.stepping[0].has_forgotten = 1  # the same by every thread
            else:
                constraint.is_struck = arrays.NOT_STRUCK
        elif constraint.reach == arrays.AWAY:
            constraint.is_struck = arrays.NOT_STRUCK
