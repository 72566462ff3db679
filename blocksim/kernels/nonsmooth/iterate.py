"""Passes over all groups, shared by threads: colour after colour, and again until nothing changes any more."""

import math

from blocksim.kernels.common.arrays import TEAM_SIZE, Integers
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import COLOURS, Contacts
from blocksim.kernels.nonsmooth.cone import LATE, find_couplings, forget_couplings
from blocksim.kernels.nonsmooth.sweeps import (
    first_velocity_constraints,
    part_of,
    position_constraints,
    velocity_constraints,
    warm_constraints,
)

WARM, POSITION, FIRST_VELOCITY, VELOCITY = range(4)


@kernel
def go_through(contacts: Contacts, task: int, begin: int, end: int) -> float:
    """Do one task for some groups; return the largest change of velocity (m/s) where it is of interest."""
    if task == WARM:
        warm_constraints(contacts, begin, end)
    elif task == POSITION:
        position_constraints(contacts, begin, end)
    elif task == FIRST_VELOCITY:
        return first_velocity_constraints(contacts, begin, end)
    else:
        return velocity_constraints(contacts, begin, end)
    return 0.0


@kernel
def sweep(contacts: Contacts, task: int, team: Integers, k: int) -> float:
    """Do one task for all groups, colour after colour; return the largest change of velocity (m/s) of thread k.

    For one thread colours are one sequence of groups, the same.
    """
    largest = 0.0
    size = team[TEAM_SIZE]
    for colour in range(1 if size == 1 else contacts.stepping[0].colours):
        begin = 0 if size == 1 else contacts.ends[colour]
        end = contacts.stepping[0].group_count if size == 1 else contacts.ends[colour + 1]
        if begin < end:
            first, last = part_of(begin, end, k, 1 if colour == COLOURS - 1 else size)
            if colour < COLOURS - 1 or k == 0:
                largest = max(largest, go_through(contacts, task, first, last))
            barrier(team)
    return largest


@kernel
def agree(contacts: Contacts, team: Integers, k: int, number: int, largest: float) -> float:
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
def hold_back(contacts: Contacts, team: Integers, k: int, is_late: bool) -> None:
    """Let friction that couples strongly go a share of the way from now on, or all of it again; see cone.py."""
    first, last = part_of(0, contacts.stepping[0].group_count, k, team[TEAM_SIZE])
    if is_late:
        find_couplings(contacts, first, last)
    else:
        forget_couplings(contacts, first, last)
    barrier(team)


@kernel
def velocity_pass(contacts: Contacts, team: Integers, k: int, task: int, tolerance: float) -> None:
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
    if sweeps > LATE:
        hold_back(contacts, team, k, False)
    if k == 0:
        stepping.sweeps += sweeps
