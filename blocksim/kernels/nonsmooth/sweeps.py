"""Sweeps over the constraints, colour after colour. Those of one colour share no free body: threads divide them."""

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import greater, spread
from blocksim.kernels.nonsmooth.arrays import PART, Contacts
from blocksim.kernels.nonsmooth.groups import highest, total
from blocksim.kernels.nonsmooth.passes import first_velocity_group, position_group, taken_by, velocity_group, warm_group


@kernel
def part_of(begin: int, end: int, k: int, size: int) -> tuple[int, int]:
    """Return where the part of thread k begins and ends: whole tallies, so that no two threads write to one."""
    if size == 1:
        return begin, end
    blocks = (end - begin + PART - 1) // PART
    return min(end, begin + blocks * k // size * PART), min(end, begin + blocks * (k + 1) // size * PART)


@kernel
def warm_constraints(contacts: Contacts, begin: int, end: int) -> None:
    """Warm-start the constraints of some groups."""
    for m in range(begin, end):
        group = contacts.groups[m]
        if group.count == 1:
            warm_group(contacts, group, 0)
        else:
            warm_group(contacts, group, None)


@kernel
def position_constraints(contacts: Contacts, begin: int, end: int) -> None:
    """Go through the position pass of some groups."""
    for m in range(begin, end):
        group = contacts.groups[m]
        if group.count == 1:
            position_group(contacts, group, 0)
        else:
            position_group(contacts, group, None)


@kernel
def first_velocity_constraints(contacts: Contacts, begin: int, end: int) -> float:
    """Begin the velocity pass of some groups; return the largest change of velocity (m/s)."""
    largest = spread(0.0)
    single = 0.0
    for m in range(begin, end):
        group = contacts.groups[m]
        if group.count == 1:
            single = greater(first_velocity_group(contacts, group, 0), single)
        else:
            largest = greater(first_velocity_group(contacts, group, None), largest)
    return max(single, highest(largest))


@kernel
def velocity_constraints(contacts: Contacts, begin: int, end: int) -> float:
    """Go once more through the velocity pass of some groups; return the largest change of velocity (m/s)."""
    largest = spread(0.0)
    single = 0.0
    for m in range(begin, end):
        group = contacts.groups[m]
        if group.count == 1:
            single = greater(velocity_group(contacts, group, 0), single)
        else:
            largest = greater(velocity_group(contacts, group, None), largest)
    return max(single, highest(largest))


@kernel
def tally_constraints(contacts: Contacts, begin: int, end: int, gx: float, gy: float) -> None:
    """Tally the constraints of some groups; (gx, gy), m/s, is what velocities lack of gravity."""
    is_shaken = contacts.stepping[0].is_shaken
    for m in range(begin, end):
        group = contacts.groups[m]
        tally = contacts.tallies[m // PART]
        if group.count == 1:
            normal, shear, given = taken_by(contacts, contacts.before, group, 0, gx, gy)
            tally.impacts -= 0.5 * normal
            tally.friction -= 0.5 * shear
            if is_shaken:
                tally.to_support += given
        else:
            normals, shears, gifts = taken_by(contacts, contacts.before, group, None, gx, gy)
            tally.impacts -= 0.5 * total(normals, group.count)
            tally.friction -= 0.5 * total(shears, group.count)
            if is_shaken:
                tally.to_support += total(gifts, group.count)
