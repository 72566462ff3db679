"""One substep of all bodies and rows, shared by threads."""

import math

from blocksim.kernels.arrays import TEAM_SIZE, Integers
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import COLOURS, Contacts, Nonsmooth
from blocksim.kernels.nonsmooth.bends import follow_bends
from blocksim.kernels.nonsmooth.guard import TRIES, gains, weaken
from blocksim.kernels.nonsmooth.motion import drift_all, kick_all, kick_all_warm
from blocksim.kernels.nonsmooth.supports import drive
from blocksim.kernels.nonsmooth.sweeps import (
    book_rows,
    first_velocity_rows,
    part_of,
    position_rows,
    velocity_rows,
    warm_rows,
)
from blocksim.kernels.team import meet

WARM, POSITION, FIRST_VELOCITY, VELOCITY = range(4)


@kernel
def go_through(contacts: Contacts, task: int, begin: int, end: int) -> float:
    """Do one task for some groups; return the largest change of velocity (m/s) where it is of interest."""
    if task == WARM:
        warm_rows(contacts, begin, end)
    elif task == POSITION:
        position_rows(contacts, begin, end)
    elif task == FIRST_VELOCITY:
        return first_velocity_rows(contacts, begin, end)
    else:
        return velocity_rows(contacts, begin, end)
    return 0.0


@kernel
def sweep(contacts: Contacts, task: int, team: Integers, k: int) -> float:
    """Do one task for all groups, colour after colour; return the largest change of velocity (m/s) of thread k."""
    largest = 0.0
    size = team[TEAM_SIZE]
    for colour in range(contacts.stepping[0].colours):
        begin, end = contacts.ends[colour], contacts.ends[colour + 1]
        if begin < end:
            first, last = part_of(begin, end, k, 1 if colour == COLOURS - 1 else size)
            if colour < COLOURS - 1 or k == 0:
                largest = max(largest, go_through(contacts, task, first, last))
            meet(team)
    return largest


@kernel
def velocity_pass(contacts: Contacts, team: Integers, k: int, task: int) -> None:
    """Sweep until no impulse changes a velocity by more than the tolerance, or as often as allowed."""
    stepping = contacts.stepping[0]
    largest = math.inf
    sweeps = 0
    while largest > stepping.tolerance and sweeps < stepping.velocity_sweeps:
        sweeps += 1
        largest = agree(contacts, team, k, sweeps, sweep(contacts, task, team, k))
        task = VELOCITY
    if k == 0:
        stepping.sweeps += sweeps


@rare_kernel
def calm(contacts: Contacts, team: Integers, k: int, gx: float, gy: float) -> None:
    """Solve the velocity pass again with weaker rebounds while its impulses create energy; every thread finds out."""
    first, last = part_of(0, contacts.stepping[0].group_count, k, team[TEAM_SIZE])
    for i in range(TRIES + 1):
        if not gains(contacts, gx, gy):
            return
        meet(team)
        weaken(contacts, first, last, 0.5 if i < TRIES else 0.0)
        meet(team)
        velocity_pass(contacts, team, k, VELOCITY)


@kernel
def agree(contacts: Contacts, team: Integers, k: int, sweeps: int, largest: float) -> float:
    """Return the largest of what all threads have found; `sweeps` tells one question from the next."""
    size = team[TEAM_SIZE]
    if size == 1:
        return largest
    slot = sweeps % 2
    contacts.residuals[slot, 8 * k] = largest
    meet(team)
    for other in range(size):
        largest = max(largest, contacts.residuals[slot, 8 * other])
    return largest


@kernel
def kick_share(number: int, is_first_step: bool) -> float:
    """Return the share of a whole kick of gravity in substep `number` of a step; the first of a run has half of one."""
    return 0.5 if is_first_step and number == 0 else 1.0


@kernel
def bodies_of(contacts: Contacts, k: int, size: int) -> tuple[int, int]:
    """Return the bodies of thread k, from the first to before the last; the ground is nobody's."""
    count = contacts.lines.size - 1
    return count * k // size, count * (k + 1) // size


@kernel
def substep(scene: Nonsmooth, k: int, number: int, is_first_step: bool) -> None:
    """Go through substep `number` of a step as thread k; the first one of a run has half a kick of gravity."""
    contacts = scene.contacts
    team = scene.world.team
    controls = scene.world.controls[0]
    stepping = contacts.stepping[0]
    h = stepping.substep
    hx = h * controls.gravity_x
    hy = h * controls.gravity_y
    share = kick_share(number, is_first_step)
    first, last = bodies_of(contacts, k, team[TEAM_SIZE])
    if k == 0:
        drive(scene, number)
        follow_bends(stepping, number)
    if number == 0:
        kick_all(contacts.lines, contacts.before, first, last, share, hx, hy)
        meet(team)
        sweep(contacts, WARM, team, k)
    else:
        kick_all_warm(contacts.lines, contacts.before, first, last, kick_share(number - 1, is_first_step), hx, hy)
        meet(team)
    sweep(contacts, POSITION, team, k)
    drift_all(contacts.lines, first, last + (k == team[TEAM_SIZE] - 1), h)  # the ground, which may move, is the last
    meet(team)
    velocity_pass(contacts, team, k, FIRST_VELOCITY)
    if stepping.is_guarded:
        calm(contacts, team, k, share * hx, share * hy)
    first, last = part_of(0, stepping.group_count, k, team[TEAM_SIZE])
    book_rows(contacts, first, last, share * hx, share * hy, hx, hy)
    meet(team)
