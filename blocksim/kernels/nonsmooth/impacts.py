"""Impacts one after the other within a substep, for contact groups in which anything rebounds.

The velocity pass gives every point that approached before the substep its rebound, and stops the approach of all other
points: a block that is struck and strikes the next one in the same substep would lose its rebound there. So impacts go
in rounds, from the velocities before the substep. In each of them all points that approach faster than the threshold
are hit, with u as it is then:

    0 <= lambda  complementary to  J v + e u >= 0

Where faces meet as faces both points are hit: passes.meets_flush.

Points that pressed when the substep began and neither approach nor part push back at once (target zero): blocks that
press on one another are struck as one. All other points wait until they are hit in a later round, also those that touch
without pressing: in a row of blocks one is struck after the other, whether they touch or not. Rounds continue
until nothing approaches; then gravity and what rests are solved as ever, and points that were hit keep their rebound.

Without friction the energy of a round changes by -(1 - e) / 2 sum(lambda |u|): none is created, and with e = 1 none is
lost (M. Smith et al., Reflections on simultaneous impact, ACM Trans. Graph. 31 (2012) 106). With friction Newton's
restitution can create energy (T. R. Kane and D. A. Levinson, Dynamics (1985), section 5.8). Without rebounds a round
creates none: with lambda_n t = 0 and friction against the slip that is left the change is at most
-1/2 lambda A lambda. A group that gains has the round solved again with the share of its rebounds that leaves it the
energy that it had.

How much of its rebounds a group gets that would gain energy with all of them.

A share x of the rebounds of a round, from 0 to 1, has a solution of its own: the round with all targets above zero
times x. Velocities v(x) are straight lines in x with bends where a point begins or ends to slide or to press, and the
energy K(x) is a parabola on each of them. Without rebounds no energy is gained, so that between 0 and 1 it is at some x
what it was. A group gets v(x) there. With more restitution x falls in proportion, and v(x) is the same: what a
group does grows with restitution until it would gain energy, and stays.

For one point there is one such x: with y its velocity after the round along the normal, w that along the tangent and
A = J M^-1 J^T, energy changes by dK = y d(lambda_n) + w d(lambda_t). Where it sticks, that is y d(lambda_n) >= 0. Where
it slides, with sigma = +-1 the sense of w, it is (y - mu |w|) d(lambda_n), and this bracket grows with lambda_n at the
rate A_nn - 2 sigma mu A_nt + mu^2 A_tt >= 0, as A is positive definite: K falls at first, if at all, and then grows.

The search keeps a solution with too little and one with too much energy, and tries the x that would be right if no bend
were in between; if there is none, it is. An end that stays where it is counts for half as much each time. What the two
last solutions leave is made up between them, so that the energy is exact. Both keep all bounds of impulses and
approaches, so what lies between them does too.
"""

import math

from blocksim.kernels.common.arrays import TEAM_SIZE, Integers, Record, Records
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.common.tolerances import (
    IMPACT_ROUND_OFF,
    LEAST_TOLERANCE,
    MOST_ROUNDS,
    MOST_TOLERANCE,
    MOST_TRIES,
    TOLERANCE_SHARE,
)
from blocksim.kernels.nonsmooth import arrays, impact_rounds, motion, passes
from blocksim.kernels.nonsmooth.arrays import HIGH, LOW, NEITHER


@rare_kernel
def begin_search(contacts: arrays.Contacts) -> None:
    """Let all groups that have gained energy begin without rebounds; the others keep all of theirs."""
    bodies = contacts.impacts
    for body in bodies:
        root = bodies[body.root]
        body.is_open = 1 if impact_rounds.has_gain(root) else 0
        body.share = 0.0 if body.is_open else 1.0
        body.side = NEITHER
        body.low = 0.0
        body.high = 1.0
        body.stale = 1.0
        body.most = body.now


@rare_kernel
def aim_share(contacts: arrays.Contacts, begin: int, end: int) -> None:
    """Begin a round again with the share of its rebounds that is to be tried; leave out groups that are done."""
    for m in range(begin, end):
        lanes = contacts.impact_lanes[m]
        if lanes.is_hit:
            pack = contacts.packs[m]
            impact_rounds.clear(pack)
            for lane in range(WIDTH):
                body = impact_rounds.of_constraint(contacts, pack, min(lane, pack.count - 1))
                pack.target_one[lane] = target_of(lanes.all_one[lane], body)
                pack.target_two[lane] = target_of(lanes.all_two[lane], body)


@rare_kernel
def target_of(target: float, body: Record) -> float:
    """Return what a point has to reach (m/s) with the share of its rebound that is to be tried."""
    if not body.is_open:
        return -arrays.FAR
    return body.share * target if target > 0.0 else target


@rare_kernel
def judge(contacts: arrays.Contacts, is_last: bool) -> bool:
    """Decide as what the solutions just found are to be kept, and what is to be tried next; return whether anything is.

    A solution replaces the one on the same side of the energy that a group had. Groups that are done have in `share`
    where they are between their two solutions.
    """
    states = contacts.states
    bodies = contacts.impacts
    for body in bodies:
        if body.is_open:
            body.now = 0.0
    for i in range(bodies.size):
        if bodies[i].is_open and states[i].inverse_mass > 0.0:
            energy = impact_rounds.energy(contacts, states[i], states[i].vx, states[i].vy, states[i].spin)
            bodies[bodies[i].root].now += energy
    impact_rounds.count_work(contacts)
    for i in range(bodies.size):
        root = bodies[i]
        if root.root != i:
            continue
        last = root.side
        if not root.is_open:
            root.side = NEITHER
            continue
        root.side = LOW if root.share <= 0.0 or root.now <= root.then else HIGH
        root.stale = 0.5 * root.stale if root.side == last else 1.0
        if root.side == LOW:
            root.low, root.least = root.share, root.now
        else:
            root.high, root.most = root.share, root.now
    find_between(contacts)
    is_any = False
    for i in range(bodies.size):
        body = bodies[i]
        if body.root == i and body.side != NEITHER:
            try_next(body, is_last)
            is_any = is_any or body.is_open == 1
    for body in bodies:
        body.share = bodies[body.root].share
        body.is_open = bodies[body.root].is_open
    return is_any


@rare_kernel
def find_between(contacts: arrays.Contacts) -> None:
    """Sum up the energy of the difference between the two solutions of every group, and give its bodies the side."""
    states = contacts.states
    bodies = contacts.impacts
    ux = contacts.stepping[0].support_vx
    uy = contacts.stepping[0].support_vy
    for body in bodies:
        body.between = 0.0
    for i in range(bodies.size):
        body = bodies[i]
        state = states[i]
        root = bodies[body.root]
        body.side = root.side
        if body.side != NEITHER and state.inverse_mass > 0.0:
            is_low = body.side == LOW
            vx = state.vx - (body.after_vx if is_low else body.low_vx) + ux
            vy = state.vy - (body.after_vy if is_low else body.low_vy) + uy
            spin = state.spin - (body.after_spin if is_low else body.low_spin)
            root.between += impact_rounds.energy(contacts, state, vx, vy, spin)


@rare_kernel
def try_next(root: Record, is_last: bool) -> None:
    """Set the share that a group tries next, or where it ends up between its two solutions."""
    room = root.then - root.least
    excess = root.most - root.then
    if is_last or room <= 0.0 or abs(root.now - root.then) <= IMPACT_ROUND_OFF * root.then:
        root.is_open = 0
        root.share = share_of(room, room + excess, root.between)
        return
    if root.side == LOW:
        excess *= root.stale
    else:
        room *= root.stale
    root.share = root.low + (root.high - root.low) * share_of(room, room + excess, root.between)


@rare_kernel
def share_of(room: float, gain: float, between: float) -> float:
    """Return s in [0, 1] with s (gain - between) + s^2 between = room, all energies (J).

    From v_0 to v_1 = v_0 + d energy is a parabola of the share s of d: K(s) = K_0 + s (K_1 - K_0 - c) + s^2 c with the
    energy c of d.
    """
    if room <= 0.0:
        return 0.0
    slope = gain - between
    return min(1.0, 2.0 * room / (slope + math.sqrt(slope * slope + 4.0 * between * room)))


@rare_kernel
def keep_solution(contacts: arrays.Contacts, bodies: tuple[int, int], packs: tuple[int, int]) -> None:
    """Keep impulses and velocities just found, on the side of their group, and go back to the start of the round."""
    for m in range(packs[0], packs[1]):
        lanes = contacts.impact_lanes[m]
        if lanes.is_hit:
            pack = contacts.packs[m]
            for lane in range(WIDTH):
                side = impact_rounds.of_constraint(contacts, pack, min(lane, pack.count - 1)).side
                if side == LOW:
                    lanes.low_one[lane] = pack.normal_one[lane]
                    lanes.low_two[lane] = pack.normal_two[lane]
                    lanes.low_shear[lane] = pack.shear[lane]
                elif side == HIGH:
                    lanes.after_one[lane] = pack.normal_one[lane]
                    lanes.after_two[lane] = pack.normal_two[lane]
                    lanes.after_shear[lane] = pack.shear[lane]
    for i in range(bodies[0], bodies[1]):
        body = contacts.impacts[i]
        state = contacts.states[i]
        if body.side == LOW:
            body.low_vx, body.low_vy, body.low_spin = state.vx, state.vy, state.spin
        elif body.side == HIGH:
            body.after_vx, body.after_vy, body.after_spin = state.vx, state.vy, state.spin
        if body.is_hit:
            state.vx, state.vy, state.spin = body.vx, body.vy, body.spin


@rare_kernel
def settle(contacts: arrays.Contacts, bodies: tuple[int, int], packs: tuple[int, int]) -> None:
    """Give constraints the impulses, and bodies the velocities, that their group ends up with."""
    for m in range(packs[0], packs[1]):
        lanes = contacts.impact_lanes[m]
        if lanes.is_hit:
            pack = contacts.packs[m]
            for lane in range(WIDTH):
                s = impact_rounds.of_constraint(contacts, pack, min(lane, pack.count - 1)).share
                pack.normal_one[lane] = between(lanes.low_one[lane], lanes.after_one[lane], s)
                pack.normal_two[lane] = between(lanes.low_two[lane], lanes.after_two[lane], s)
                pack.shear[lane] = between(lanes.low_shear[lane], lanes.after_shear[lane], s)
    for i in range(bodies[0], bodies[1]):
        body = contacts.impacts[i]
        if body.is_hit:
            state = contacts.states[i]
            state.vx = between(body.low_vx, body.after_vx, body.share)
            state.vy = between(body.low_vy, body.after_vy, body.share)
            state.spin = between(body.low_spin, body.after_spin, body.share)


@rare_kernel
def between(x: float, y: float, share: float) -> float:
    """Return what lies between x and y; exactly y where the share is one."""
    return y if share >= 1.0 else x + share * (y - x)


@rare_kernel
def tolerance_of(stepping: Record) -> float:
    """Return to what (m/s) a round of impacts is solved; without a threshold no better than round-off of gaps."""
    wanted = TOLERANCE_SHARE * stepping.tolerance
    if stepping.threshold > 0.0:
        return max(LEAST_TOLERANCE * stepping.threshold, min(MOST_TOLERANCE * stepping.threshold, wanted))
    return max(stepping.touch_gap * stepping.open_bias, wanted)


@rare_kernel
def rewind(contacts: arrays.Contacts, first: int, last: int) -> None:
    """Bring the bodies of groups that are hit back to their velocities before the substep."""
    for i in range(first, last):
        if contacts.impacts[i].is_hit:
            state = contacts.states[i]
            before = contacts.before[i]
            state.vx = before.vx
            state.vy = before.vy
            state.spin = before.spin


@rare_kernel
def note(contacts: arrays.Contacts, first: int, last: int) -> None:
    """Keep the velocities at the start of a round; those of supports too."""
    for i in range(first, last):
        body = contacts.impacts[i]
        state = contacts.states[i]
        body.vx = state.vx
        body.vy = state.vy
        body.spin = state.spin


@rare_kernel
def solve_round(
    contacts: arrays.Contacts, team: Integers, k: int, bodies: tuple[int, int], packs: tuple[int, int]
) -> None:
    """Solve one round that has been aimed.

    Groups that gain energy in it are left that share of their rebounds with which they do not.
    """
    stepping = contacts.stepping[0]
    passes.velocity_pass(contacts, team, k, passes.VELOCITY, tolerance_of(stepping))
    barrier(team)
    if k == 0:
        stepping.has_gain = impact_rounds.weigh(contacts)
    barrier(team)
    if not stepping.has_gain:
        return
    keep_solution(contacts, bodies, packs)
    barrier(team)
    if k == 0:
        begin_search(contacts)
    barrier(team)
    for number in range(MOST_TRIES):
        aim_share(contacts, packs[0], packs[1])
        barrier(team)
        passes.velocity_pass(contacts, team, k, passes.VELOCITY, tolerance_of(stepping))
        barrier(team)
        if k == 0:
            stepping.has_gain = judge(contacts, number == MOST_TRIES - 1)
        barrier(team)
        keep_solution(contacts, bodies, packs)
        barrier(team)
        if not stepping.has_gain:
            break
    if k == 0 and number == MOST_TRIES - 1:
        stepping.cut_searches += 1
    settle(contacts, bodies, packs)
    barrier(team)


@rare_kernel
def follow_impacts(
    contacts: arrays.Contacts, team: Integers, k: int, bodies: tuple[int, int], share: float, pushes: Records
) -> None:
    """Let groups in which anything rebounds go through their impacts one after the other.

    `bodies` are those of thread k, `share` is that of a kick of gravity in this substep, `pushes` are of loads.
    """
    stepping = contacts.stepping[0]
    packs = passes.range_of_thread(0, stepping.pack_count, k, team[TEAM_SIZE])
    if k == 0:
        impact_rounds.find_contact_groups(contacts)
    barrier(team)
    rewind(contacts, bodies[0], bodies[1])
    impact_rounds.begin_rounds(contacts, packs[0], packs[1])
    barrier(team)
    hits = 1.0
    for number in range(MOST_ROUNDS):
        note(contacts, bodies[0], bodies[1] + (k == team[TEAM_SIZE] - 1))  # the ground, which may move, is the last
        own_hits = impact_rounds.aim_round(contacts, packs[0], packs[1], number == 0)
        hits = passes.agree(contacts, team, k, number, own_hits)
        if hits == 0.0:
            break
        solve_round(contacts, team, k, bodies, packs)
        lacks = 2.0 * stepping.lag  # once before the round, once after it
        impact_rounds.tally_round(contacts, packs[0], packs[1], lacks * stepping.fall_x, lacks * stepping.fall_y)
        barrier(team)
    if k == 0 and hits > 0.0:
        stepping.cut_rounds += 1
    motion.kick_again(contacts, pushes, bodies[0], bodies[1], share)
    barrier(team)
    impact_rounds.aim_rest(contacts, packs[0], packs[1])
    barrier(team)
    passes.velocity_pass(contacts, team, k, passes.VELOCITY, min(tolerance_of(stepping), stepping.tolerance))
    impact_rounds.bring_back(contacts, packs[0], packs[1], False)
    barrier(team)
