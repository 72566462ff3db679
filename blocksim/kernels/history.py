"""Contact history when contacts begin, end, or pass from one corner to another.

A slot keeps what a contact remembers from step to step. A contact ends when its corner leaves, or touches another face;
what its springs hold is then lost and booked. Where two corners pass one another (blocks that become exactly aligned),
the contact itself goes on under another corner, and its history goes with it.
"""

from blocksim.kernels.arrays import NO_FACE, NORMAL, SHEAR, Record, Records, World
from blocksim.kernels.broad_phase import clear_slot
from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.kinematics import has_just_begun, resolve_point, weigh_first_step
from blocksim.kernels.models import SURFACE, place_ended
from blocksim.kernels.models.surface import slot_normal
from blocksim.kernels.models.twins import PARALLEL


@rare_kernel
def goes_on(k: int, face: int, points: Records, count: int) -> bool:
    """Tell whether the corner of slot k still touches the same face."""
    for i in range(count):
        if points[i].slot == k and points[i].face == face:
            return True
    return False


@rare_kernel
def release_slot(world: World, p: int, k: int, step: float) -> None:
    """End the contact of one slot: book its last half step and what its springs still hold; clear its history.

    The last kick was half of a trapezoid whose other half is empty: its work over the last drift is half the force
    times the relative displacement, along the normal and the tangent as they were.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    slot = world.slots[p, k]
    ledger = world.ledger[0]
    point = world.points[world.points.size - 1]
    place_ended(world, p, k, point)
    resolve_point(point, a, b, step)
    spring_force = slot.shear_stiffness * slot.spring
    ledger.dashpot += 0.5 * (slot.normal_loss * point.closing + slot.shear_loss * point.slipping)
    ledger.broken += 0.5 * spring_force * (slot.spring + point.slipping)
    clear_slot(slot)


@rare_kernel
def release_ended(world: World, p: int, count: int, step: float) -> None:
    """Release the slots of a pair whose corner is no longer in contact, or touches another face than before."""
    for k in range(world.slots.shape[1]):
        slot = world.slots[p, k]
        if slot.face != NO_FACE and not goes_on(k, slot.face, world.points, count):
            release_slot(world, p, k, step)


@rare_kernel
def take_over(point: Record, slots: Records, k: int) -> None:
    """Give the history of slot k of a pair to the corner that takes its place."""
    old = slots[k]
    point.before = old.normal_force
    slots[point.slot] = old
    slots[point.slot].face = point.face
    clear_slot(old)


@rare_kernel
def hand_over(world: World, p: int, count: int) -> None:
    """Find corners that come deeper than they closed; where one of the same normal ended, they take its place."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    for i in range(count):
        point = world.points[i]
        new = world.slots[p, point.slot]
        for k in range(world.slots.shape[1]):
            old = world.slots[p, k]
            is_late = new.face == NO_FACE and not has_just_begun(point)
            if is_late and old.face != NO_FACE and not goes_on(k, old.face, world.points, count):
                nx, ny = slot_normal(k, old.face, a, b, pair.b == world.bodies.size - 1)
                if nx * point.nx + ny * point.ny > PARALLEL:
                    take_over(point, world.slots[p], k)


@rare_kernel
def change_contacts(world: World, p: int, count: int, step: float) -> None:
    """Take up a changed set of contacts: pass on, release, weigh first steps, have the operators made anew."""
    if world.controls[0].model == SURFACE:
        hand_over(world, p, count)
    release_ended(world, p, count, step)
    for i in range(count):
        point = world.points[i]
        slot = world.slots[p, point.slot]
        if slot.face == NO_FACE:
            slot.face = point.face
            point.before = 0.0
            weigh_first_step(point, world.controls[0].law)
    world.operators[p, NORMAL].left = 0
    world.operators[p, SHEAR].left = 0
    world.pairs[p].active = count


@rare_kernel
def keep_places(world: World, p: int, count: int) -> None:
    """Note place and normal of every contact in its slot: that one has ended shows when its particle is gone."""
    for i in range(count):
        point = world.points[i]
        slot = world.slots[p, point.slot]
        slot.x = point.x
        slot.y = point.y
        slot.nx = point.nx
        slot.ny = point.ny
