"""Active constraints in fours, packed for the registers of a processor, and their impulses brought back.

The constraints of a group are of one colour, so they share no free body and can be solved at the same time. A group
that is not full has its last constraint several times: all of these copies find the same, so that no lane needs to be
left out.
"""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.simd import (
    WIDTH,
    Lane,
    Lanes,
    fields_0,
    fields_4,
    fields_8,
    fields_12,
    load,
    split,
    store,
)
from blocksim.kernels.nonsmooth.arrays import COLOURS, OPEN, TOUCHING, Contacts
from blocksim.kernels.nonsmooth.slip import Constraints

LONELY = 2  # constraints: so many that are left make two groups of one, which are solved faster than one of two


class Bodies(NamedTuple):
    """Four bodies, fields as in STATE."""

    vx: Lanes
    vy: Lanes
    spin: Lanes
    inverse_mass: Lanes
    inverse_inertia: Lanes
    dx: Lanes
    dy: Lanes
    turned: Lanes


@jit.kernel
def constraints_of(group: arrays.Record, lane: Lane) -> Constraints:
    """Return the constraints of a group."""
    return Constraints(
        load(lane, group.nx),
        load(lane, group.ny),
        load(lane, group.arm_a),
        load(lane, group.arm_b),
        load(lane, group.width),
        load(lane, group.shear_arm_a),
        load(lane, group.shear_arm_b),
    )


@jit.kernel
def bodies_at(contacts: Contacts, places: arrays.Integers, lane: Lane) -> Bodies:
    """Return the bodies of a group."""
    vx, vy, spin, inverse_mass = fields_0(lane, contacts.states, places)
    inverse_inertia, dx, dy, turned = fields_4(lane, contacts.states, places)
    return Bodies(vx, vy, spin, inverse_mass, inverse_inertia, dx, dy, turned)


@jit.kernel
def normal_masses(constraint: Constraints, a: Bodies, b: Bodies) -> tuple[Lanes, Lanes, Lanes]:
    """Return A (1/kg) of the two normals: of one, mixed, of two."""
    together = a.inverse_mass + b.inverse_mass
    two_a = constraint.arm_a - constraint.width
    two_b = constraint.arm_b - constraint.width
    turned_a = a.inverse_inertia * constraint.arm_a
    turned_b = b.inverse_inertia * constraint.arm_b
    one = together + turned_a * constraint.arm_a + turned_b * constraint.arm_b
    mixed = together + turned_a * two_a + turned_b * two_b
    two = together + a.inverse_inertia * two_a * two_a + b.inverse_inertia * two_b * two_b
    return one, mixed, two


@jit.kernel
def tangent_mass(constraint: Constraints, a: Bodies, b: Bodies) -> Lanes:
    """Return A (1/kg) along the tangent."""
    coupled_a = a.inverse_inertia * constraint.shear_arm_a
    coupled_b = b.inverse_inertia * constraint.shear_arm_b
    return a.inverse_mass + b.inverse_mass + coupled_a * constraint.shear_arm_a + coupled_b * constraint.shear_arm_b


@jit.kernel
def material_of(contacts: Contacts, group: arrays.Record, k: int) -> arrays.Record:
    """Return how the bodies of one constraint of a group interact."""
    return contacts.materials[contacts.constraints[group.constraint[k]].material]


@jit.kernel
def gather(contacts: Contacts, begins: arrays.Integers) -> None:
    """Make groups of the constraints within the margin, colour after colour.

    Those that touch come first, so that groups of which none does can be passed by.
    """
    stepping = contacts.stepping[0]
    constraints = contacts.constraints
    count = 0
    number = 0
    for colour in range(stepping.colours):
        contacts.ends[colour] = number
        most = 1 if colour == COLOURS - 1 else WIDTH
        lane = 0
        for reach in (TOUCHING, OPEN):
            for r in range(begins[colour], begins[colour + 1]):
                if constraints[r].reach == reach:
                    contacts.groups[number].constraint[lane] = r
                    lane += 1
                    count += 1
                    if lane == most:
                        close(contacts.groups[number], lane)
                        number += 1
                        lane = 0
        if lane == LONELY:
            contacts.groups[number + 1].constraint[0] = contacts.groups[number].constraint[1]
            close(contacts.groups[number], 1)
            close(contacts.groups[number + 1], 1)
            number += 2
        elif lane > 0:
            close(contacts.groups[number], lane)
            number += 1
    contacts.ends[stepping.colours] = number
    stepping.active_count = count
    stepping.group_count = number


@jit.kernel
def close(group: arrays.Record, count: int) -> None:
    """Fill a group of `count` constraints up with the last one."""
    group.count = count
    for lane in range(count, WIDTH):
        group.constraint[lane] = group.constraint[count - 1]


@jit.kernel
def pack_groups(contacts: Contacts, begin: int, end: int) -> None:
    """Copy the constraints of some groups into them."""
    for m in range(begin, end):
        group = contacts.groups[m]
        if group.count == 1:
            pack(contacts, group, 0)
        else:
            pack(contacts, group, None)
        group.are_simple = 1
        group.is_coupled = 0
        for lane in range(1 if group.count == 1 else WIDTH):
            constraint = contacts.constraints[group.constraint[lane]]
            group.a[lane] = constraint.a
            group.b[lane] = constraint.b
            material = contacts.materials[constraint.material]
            group.friction[lane] = material.kinetic_friction
            group.restitution[lane] = material.restitution
            if material.static_friction != material.kinetic_friction:
                group.are_simple = 0
        if group.count == 1:
            keep_masses(contacts, group)


@jit.kernel
def keep_masses(contacts: Contacts, group: arrays.Record) -> None:
    """Keep A of a group of one, the same for all substeps of a step."""
    constraint = constraints_of(group, 0)
    a = bodies_at(contacts, group.a, 0)
    b = bodies_at(contacts, group.b, 0)
    group.one, group.mixed, group.two = normal_masses(constraint, a, b)
    group.along = tangent_mass(constraint, a, b)


@jit.kernel
def pack(contacts: Contacts, group: arrays.Record, lane: Lane) -> None:
    """Copy the numbers of the constraints of a group into it."""
    nx, ny, arm_a, arm_b = fields_0(lane, contacts.constraints, group.constraint)
    width, shear_arm_a, shear_arm_b, gap_one = fields_4(lane, contacts.constraints, group.constraint)
    gap_two, normal_one, normal_two, shear = fields_8(lane, contacts.constraints, group.constraint)
    bend, shear_bend, _, _ = fields_12(lane, contacts.constraints, group.constraint)
    store(lane, group.bend, bend)
    store(lane, group.shear_bend, shear_bend)
    store(lane, group.nx, nx)
    store(lane, group.ny, ny)
    store(lane, group.arm_a, arm_a)
    store(lane, group.arm_b, arm_b)
    store(lane, group.width, width)
    store(lane, group.shear_arm_a, shear_arm_a)
    store(lane, group.shear_arm_b, shear_arm_b)
    store(lane, group.gap_one, gap_one)
    store(lane, group.gap_two, gap_two)
    store(lane, group.normal_one, normal_one)
    store(lane, group.normal_two, normal_two)
    store(lane, group.shear, shear)


@jit.kernel
def unpack_groups(contacts: Contacts, begin: int, end: int) -> None:
    """Bring the impulses of some groups back to their constraints."""
    for m in range(begin, end):
        group = contacts.groups[m]
        for lane in range(group.count):
            constraint = contacts.constraints[group.constraint[lane]]
            constraint.normal_one = group.normal_one[lane]
            constraint.normal_two = group.normal_two[lane]
            constraint.shear = group.shear[lane]


@jit.kernel
def total(lane: Lane, x: Lanes, count: int) -> float:
    """Return the sum of the first `count` lanes, at least two, or the number of a single one."""
    if lane is not None:
        return x
    one, two, three, four = split(x)
    return (one + two) + ((three if count > 2 else 0.0) + (four if count > 3 else 0.0))


@jit.kernel
def highest(x: Lanes) -> float:
    """Return the largest number."""
    one, two, three, four = split(x)
    return max(one, two, three, four)
