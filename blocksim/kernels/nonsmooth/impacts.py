"""Impacts one after the other within a substep, for clusters in which anything rebounds.

The velocity pass gives every point that approached before the substep its rebound, and stops the approach of all other
points: a block that is struck and strikes the next one in the same substep would lose its rebound there. So impacts go
in rounds, from the velocities before the substep. In each of them all points that approach faster than the threshold
are hit, with u as it is then:

    0 <= lambda  complementary to  J v + e u >= 0

Points that pressed when the substep began and neither approach nor part push back at once (target zero): blocks that
press on one another are struck as one. All other points wait until they are hit in a later round, also those that touch
without pressing: in a row of blocks one is struck after the other, whether they touch or not. Rounds continue
until nothing approaches; then gravity and what rests are solved as ever, and points that were hit keep their rebound.

Without friction the energy of a round changes by -(1 - e) / 2 sum(lambda |u|): none is created, and with e = 1 none is
lost (M. Smith et al., Reflections on simultaneous impact, ACM Trans. Graph. 31 (2012) 106). With friction Newton's
restitution can create energy (T. R. Kane and D. A. Levinson, Dynamics (1985), section 5.8). Without rebounds a round
creates none: with lambda_n t = 0 and friction against the slip that is left the change is at most
-1/2 lambda A lambda. A cluster that gains has the round solved again with the share of its rebounds that leaves it the
energy that it had: restraint.py.
"""

from blocksim.kernels.common.arrays import TEAM_SIZE, Integers, Record, Records
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.nonsmooth.arrays import Contacts
from blocksim.kernels.nonsmooth.clusters import find_clusters, weigh
from blocksim.kernels.nonsmooth.iterate import VELOCITY, agree, velocity_pass
from blocksim.kernels.nonsmooth.loads import kick_again
from blocksim.kernels.nonsmooth.restraint import (
    aim_share,
    begin_search,
    judge,
    keep_all,
    keep_bodies,
    keep_constraints,
    settle_bodies,
    settle_constraints,
)
from blocksim.kernels.nonsmooth.rounds import aim_rest, aim_round, bring_back, set_aside, tally_round
from blocksim.kernels.nonsmooth.sweeps import part_of

MOST_ROUNDS = 100  # what approaches then does not rebound
MOST_TRIES = 30  # shares of rebounds; what energy is left then is made up between the last two
# of impacts, what they miss is energy: such a share of the tolerance of the velocity pass, between these (m/s)
TOLERANCE_SHARE, LEAST_TOLERANCE, MOST_TOLERANCE = 1e-7, 1e-10, 1e-6


@rare_kernel
def tolerance_of(stepping: Record) -> float:
    """Return to what (m/s) a round of impacts is solved."""
    return max(LEAST_TOLERANCE, min(MOST_TOLERANCE, TOLERANCE_SHARE * stepping.tolerance))


@rare_kernel
def rewind(contacts: Contacts, first: int, last: int) -> None:
    """Bring the bodies of clusters that are hit back to their velocities before the substep."""
    for i in range(first, last):
        if contacts.impacts[i].is_hit:
            state = contacts.states[i]
            before = contacts.before[i]
            state.vx = before.vx
            state.vy = before.vy
            state.spin = before.spin


@rare_kernel
def note(contacts: Contacts, first: int, last: int) -> None:
    """Keep the velocities at the start of a round; those of supports too."""
    for i in range(first, last):
        body = contacts.impacts[i]
        state = contacts.states[i]
        body.vx = state.vx
        body.vy = state.vy
        body.spin = state.spin


@rare_kernel
def undo(contacts: Contacts, first: int, last: int) -> None:
    """Keep the velocities after a round, and go back to its start."""
    for i in range(first, last):
        body = contacts.impacts[i]
        if body.is_hit:
            state = contacts.states[i]
            body.after_vx, state.vx = state.vx, body.vx
            body.after_vy, state.vy = state.vy, body.vy
            body.after_spin, state.spin = state.spin, body.spin


@rare_kernel
def resume(contacts: Contacts, first: int, last: int, gx: float, gy: float) -> None:
    """Let the substep of the bodies of clusters that were hit begin after the last impact, with gravity (m/s)."""
    for i in range(first, last):
        if contacts.impacts[i].is_hit:
            state = contacts.states[i]
            before = contacts.before[i]
            before.vx = state.vx
            before.vy = state.vy
            before.spin = state.spin
            state.vx += gx
            state.vy += gy


@rare_kernel
def restrain(contacts: Contacts, team: Integers, k: int, bodies: tuple[int, int], groups: tuple[int, int]) -> None:
    """Leave clusters that have gained energy in a round that share of their rebounds with which they do not."""
    stepping = contacts.stepping[0]
    keep_all(contacts, groups[0], groups[1])
    undo(contacts, bodies[0], bodies[1])
    barrier(team)
    if k == 0:
        begin_search(contacts)
    barrier(team)
    for number in range(MOST_TRIES):
        aim_share(contacts, groups[0], groups[1])
        barrier(team)
        velocity_pass(contacts, team, k, VELOCITY, tolerance_of(stepping))
        barrier(team)
        if k == 0:
            stepping.has_gain = judge(contacts, number == MOST_TRIES - 1)
        barrier(team)
        keep_constraints(contacts, groups[0], groups[1])
        keep_bodies(contacts, bodies[0], bodies[1])
        barrier(team)
        if not stepping.has_gain:
            break
    settle_constraints(contacts, groups[0], groups[1])
    settle_bodies(contacts, bodies[0], bodies[1])


@rare_kernel
def go_round(contacts: Contacts, team: Integers, k: int, bodies: tuple[int, int], groups: tuple[int, int]) -> None:
    """Solve one round that has been aimed."""
    velocity_pass(contacts, team, k, VELOCITY, tolerance_of(contacts.stepping[0]))
    barrier(team)
    if k == 0:
        contacts.stepping[0].has_gain = weigh(contacts)
    barrier(team)
    if contacts.stepping[0].has_gain:
        restrain(contacts, team, k, bodies, groups)
        barrier(team)


@rare_kernel
def follow_impacts(
    contacts: Contacts, team: Integers, k: int, bodies: tuple[int, int], share: float, pushes: Records
) -> None:
    """Let clusters in which anything rebounds go through their impacts one after the other.

    `bodies` are those of thread k, `share` is that of a kick of gravity in this substep, `pushes` are of loads.
    """
    stepping = contacts.stepping[0]
    groups = part_of(0, stepping.group_count, k, team[TEAM_SIZE])
    if k == 0:
        find_clusters(contacts)
    barrier(team)
    rewind(contacts, bodies[0], bodies[1])
    set_aside(contacts, groups[0], groups[1])
    barrier(team)
    for number in range(MOST_ROUNDS):
        note(contacts, bodies[0], bodies[1] + (k == team[TEAM_SIZE] - 1))  # the ground, which may move, is the last
        hits = aim_round(contacts, groups[0], groups[1], number == 0)
        if agree(contacts, team, k, number, hits) == 0.0:
            break
        go_round(contacts, team, k, bodies, groups)
        lacks = 2.0 * stepping.lag  # once before the round, once after it
        tally_round(contacts, groups[0], groups[1], lacks * stepping.fall_x, lacks * stepping.fall_y)
        barrier(team)
    resume(contacts, bodies[0], bodies[1], share * stepping.fall_x, share * stepping.fall_y)
    if pushes.size > 1:
        kick_again(contacts, pushes, bodies[0], bodies[1], share)
    barrier(team)
    aim_rest(contacts, groups[0], groups[1])
    barrier(team)
    velocity_pass(contacts, team, k, VELOCITY, min(tolerance_of(stepping), stepping.tolerance))
    bring_back(contacts, groups[0], groups[1], False)
    barrier(team)
