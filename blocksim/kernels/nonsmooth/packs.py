"""Active constraints in fours, packed for the registers of a processor, and their impulses brought back.

The constraints of a pack are of one colour, so they share no free body and can be solved at the same time. A pack
that is not full has its last constraint several times: all of these copies find the same, so that no lane needs to be
left out.
"""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, simd
from blocksim.kernels.nonsmooth.arrays import COLOURS, OPEN, TOUCHING, Contacts
from blocksim.kernels.nonsmooth.slip import Constraints, Slip, slip_of

LONELY = 2  # constraints: so many that are left make two packs of one, which are solved faster than one of two


class Bodies(NamedTuple):
    """Four bodies, fields as in STATE."""

    vx: simd.Lanes
    vy: simd.Lanes
    spin: simd.Lanes
    inverse_mass: simd.Lanes
    inverse_inertia: simd.Lanes
    dx: simd.Lanes
    dy: simd.Lanes
    turned: simd.Lanes


class Link(NamedTuple):
    """The constraints of a pack, or one of them, and the bodies on both sides."""

    its: Constraints
    a: Bodies
    b: Bodies


@jit.kernel
def bodies_at(contacts: Contacts, places: arrays.Integers, lane: simd.Lane) -> Bodies:
    """Return the bodies at the places of a pack."""
    vx, vy, spin, inverse_mass = simd.fields_0(lane, contacts.states, places)
    inverse_inertia, dx, dy, turned = simd.fields_4(lane, contacts.states, places)
    return Bodies(vx, vy, spin, inverse_mass, inverse_inertia, dx, dy, turned)


@jit.kernel
def link_of(contacts: Contacts, pack: arrays.Record, lane: simd.Lane) -> Link:
    """Return the constraints of a pack with their bodies as they are now."""
    constraints = Constraints(
        simd.load(lane, pack.nx),
        simd.load(lane, pack.ny),
        simd.load(lane, pack.arm_a),
        simd.load(lane, pack.arm_b),
        simd.load(lane, pack.width),
        simd.load(lane, pack.shear_arm_a),
        simd.load(lane, pack.shear_arm_b),
    )
    return Link(constraints, bodies_at(contacts, pack.a, lane), bodies_at(contacts, pack.b, lane))


@jit.kernel
def slip_now(link: Link) -> Slip:
    """Return the velocities at the points."""
    a, b = link.a, link.b
    return slip_of(link.its, a.vx - b.vx, a.vy - b.vy, a.spin, b.spin)


@jit.kernel
def slip_before(contacts: Contacts, pack: arrays.Record, lane: simd.Lane, its: Constraints) -> Slip:
    """Return the velocities at the points when the substep began."""
    vx_a, vy_a, spin_a, _ = simd.fields_0(lane, contacts.before, pack.a)
    vx_b, vy_b, spin_b, _ = simd.fields_0(lane, contacts.before, pack.b)
    return slip_of(its, vx_a - vx_b, vy_a - vy_b, spin_a, spin_b)


@jit.kernel
def normal_masses(link: Link) -> tuple[simd.Lanes, simd.Lanes, simd.Lanes]:
    """Return A (1/kg) of the two normals: of one, mixed, of two."""
    its, a, b = link
    together = a.inverse_mass + b.inverse_mass
    two_a = its.arm_a - its.width
    two_b = its.arm_b - its.width
    turned_a = a.inverse_inertia * its.arm_a
    turned_b = b.inverse_inertia * its.arm_b
    one = together + turned_a * its.arm_a + turned_b * its.arm_b
    mixed = together + turned_a * two_a + turned_b * two_b
    two = together + a.inverse_inertia * two_a * two_a + b.inverse_inertia * two_b * two_b
    return one, mixed, two


@jit.kernel
def tangent_mass(link: Link) -> simd.Lanes:
    """Return A (1/kg) along the tangent."""
    its, a, b = link
    coupled_a = a.inverse_inertia * its.shear_arm_a
    coupled_b = b.inverse_inertia * its.shear_arm_b
    return a.inverse_mass + b.inverse_mass + coupled_a * its.shear_arm_a + coupled_b * its.shear_arm_b


@jit.kernel
def material_of(contacts: Contacts, pack: arrays.Record, k: int) -> arrays.Record:
    """Return how the bodies of one constraint of a pack interact."""
    return contacts.materials[contacts.constraints[pack.constraint[k]].material]


@jit.kernel
def gather(contacts: Contacts, begins: arrays.Integers) -> None:
    """Make packs of the constraints within the margin, colour after colour.

    Those that touch come first, so that packs of which none does can be passed by.
    """
    stepping = contacts.stepping[0]
    constraints = contacts.constraints
    count = 0
    number = 0
    for colour in range(stepping.colours):
        contacts.ends[colour] = number
        most = 1 if colour == COLOURS - 1 else simd.WIDTH
        lane = 0
        for reach in (TOUCHING, OPEN):
            for r in range(begins[colour], begins[colour + 1]):
                if constraints[r].reach == reach:
                    contacts.packs[number].constraint[lane] = r
                    lane += 1
                    count += 1
                    if lane == most:
                        close(contacts.packs[number], lane)
                        number += 1
                        lane = 0
        if lane == LONELY:
            contacts.packs[number + 1].constraint[0] = contacts.packs[number].constraint[1]
            close(contacts.packs[number], 1)
            close(contacts.packs[number + 1], 1)
            number += 2
        elif lane > 0:
            close(contacts.packs[number], lane)
            number += 1
    contacts.ends[stepping.colours] = number
    stepping.active_count = count
    stepping.pack_count = number


@jit.kernel
def close(pack: arrays.Record, count: int) -> None:
    """Fill a pack of `count` constraints up with the last one."""
    pack.count = count
    for lane in range(count, simd.WIDTH):
        pack.constraint[lane] = pack.constraint[count - 1]


@jit.kernel
def pack_all(contacts: Contacts, begin: int, end: int) -> None:
    """Copy the constraints of some packs into them."""
    for m in range(begin, end):
        pack = contacts.packs[m]
        if pack.count == 1:
            fill(contacts, pack, 0)
        else:
            fill(contacts, pack, None)
        pack.are_simple = 1
        pack.is_coupled = 0
        for lane in range(1 if pack.count == 1 else simd.WIDTH):
            constraint = contacts.constraints[pack.constraint[lane]]
            pack.a[lane] = constraint.a
            pack.b[lane] = constraint.b
            material = contacts.materials[constraint.material]
            pack.friction[lane] = material.kinetic_friction
            pack.restitution[lane] = material.restitution
            if material.static_friction != material.kinetic_friction:
                pack.are_simple = 0
        if pack.count == 1:  # A is the same for all substeps of a step
            link = link_of(contacts, pack, 0)
            pack.one, pack.mixed, pack.two = normal_masses(link)
            pack.along = tangent_mass(link)


@jit.kernel
def fill(contacts: Contacts, pack: arrays.Record, lane: simd.Lane) -> None:
    """Copy the numbers of the constraints of a pack into it."""
    nx, ny, arm_a, arm_b = simd.fields_0(lane, contacts.constraints, pack.constraint)
    width, shear_arm_a, shear_arm_b, gap_one = simd.fields_4(lane, contacts.constraints, pack.constraint)
    gap_two, normal_one, normal_two, shear = simd.fields_8(lane, contacts.constraints, pack.constraint)
    bend, shear_bend, _, _ = simd.fields_12(lane, contacts.constraints, pack.constraint)
    simd.store(lane, pack.bend, bend)
    simd.store(lane, pack.shear_bend, shear_bend)
    simd.store(lane, pack.nx, nx)
    simd.store(lane, pack.ny, ny)
    simd.store(lane, pack.arm_a, arm_a)
    simd.store(lane, pack.arm_b, arm_b)
    simd.store(lane, pack.width, width)
    simd.store(lane, pack.shear_arm_a, shear_arm_a)
    simd.store(lane, pack.shear_arm_b, shear_arm_b)
    simd.store(lane, pack.gap_one, gap_one)
    simd.store(lane, pack.gap_two, gap_two)
    simd.store(lane, pack.normal_one, normal_one)
    simd.store(lane, pack.normal_two, normal_two)
    simd.store(lane, pack.shear, shear)


@jit.kernel
def unpack_all(contacts: Contacts, begin: int, end: int) -> None:
    """Bring the impulses of some packs back to their constraints."""
    for m in range(begin, end):
        pack = contacts.packs[m]
        for lane in range(pack.count):
            constraint = contacts.constraints[pack.constraint[lane]]
            constraint.normal_one = pack.normal_one[lane]
            constraint.normal_two = pack.normal_two[lane]
            constraint.shear = pack.shear[lane]


@jit.kernel
def total(lane: simd.Lane, x: simd.Lanes, count: int) -> float:
    """Return the sum of the first `count` lanes, at least two, or the number of a single one."""
    if lane is not None:
        return x
    one, two, three, four = simd.split(x)
    return (one + two) + ((three if count > 2 else 0.0) + (four if count > 3 else 0.0))


@jit.kernel
def highest(x: simd.Lanes) -> float:
    """Return the largest number."""
    one, two, three, four = simd.split(x)
    return max(one, two, three, four)
