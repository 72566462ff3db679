"""Sweeps over the constraints, colour after colour. Those of one colour share no free body: threads divide them.

Passes over all packs, shared by threads: colour after colour, and again until nothing changes any more.
"""

import math

from blocksim.kernels.common.arrays import TEAM_SIZE, Integers
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.simd import greater, spread
from blocksim.kernels.common.tolerances import LATE
from blocksim.kernels.nonsmooth import arrays, cone, packs, passes


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
    """Do one task of passes.py for some packs; return the largest change of velocity (m/s) of a velocity pass."""
    largest = spread(0.0)
    single = 0.0
    for m in range(begin, end):
        pack = contacts.packs[m]
        if pack.count == 1:
            single = greater(passes.solve_pack(contacts, pack, 0, task), single)
        else:
            largest = greater(passes.solve_pack(contacts, pack, None, task), largest)
    return max(single, packs.highest(largest))


@kernel
def tally_constraints(contacts: arrays.Contacts, begin: int, end: int, gx: float, gy: float) -> None:
    """Tally the constraints of some packs; (gx, gy), m/s, is what velocities lack of gravity."""
    for m in range(begin, end):
        pack = contacts.packs[m]
        if pack.count == 1:
            passes.tally_pack(contacts, contacts.before, m, 0, gx, gy)
        else:
            passes.tally_pack(contacts, contacts.before, m, None, gx, gy)


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
    """Let friction that couples strongly go a share of the way from now on, or all of it again; see cone.py."""
    first, last = range_of_thread(0, contacts.stepping[0].pack_count, k, team[TEAM_SIZE])
    for m in range(first, last):
        pack = contacts.packs[m]
        if pack.count == 1:
            pack.is_coupled = is_late and cone.is_coupled(contacts, pack, 0)
        else:
            pack.is_coupled = is_late and cone.is_coupled(contacts, pack, None)
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
        task = passes.VELOCITY
    if sweeps > LATE:
        hold_back(contacts, team, k, False)
    if k == 0:
        stepping.sweeps += sweeps
