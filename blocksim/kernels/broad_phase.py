"""Candidate pairs: rebuilt when a body has used up its part of the skin, contact history carried over."""

from blocksim.kernels.arrays import NO_FACE, NORMAL, SHEAR, Record, World
from blocksim.kernels.geometry import ground_gap, separation
from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.models import near_slots


@rare_kernel
def clear_slot(slot: Record) -> None:
    """Forget all contact history of a slot."""
    slot.face = NO_FACE
    slot.spring = 0.0
    slot.depth = 0.0
    slot.normal_force = 0.0
    slot.shear_force = 0.0
    slot.normal_loss = 0.0
    slot.shear_loss = 0.0
    slot.shear_stiffness = 0.0


@rare_kernel
def are_near(body: Record, other: Record, reach: float) -> bool:
    """Tell whether two bodies, at least one of them free, may be closer than `reach` (m)."""
    if body.inverse_mass == 0.0 and other.inverse_mass == 0.0:
        return False
    dx = body.x - other.x
    dy = body.y - other.y
    limit = body.radius + other.radius + reach
    return dx * dx + dy * dy <= limit * limit and separation(body, other) <= reach


@rare_kernel
def add_pair(world: World, count: int, a: int, b: int) -> int:
    """Append a pair with its candidate slots, if it has any and there is room; return the count needed."""
    fits = count < world.spare_pairs.size
    row = count if fits else world.spare_pairs.size - 1
    near = near_slots(world, a, b, world.controls[0].skin, world.spare_candidates[row])
    if near > 0 and fits:
        pair = world.spare_pairs[count]
        pair.a = a
        pair.b = b
        pair.near = near
        pair.active = 0
        for k in range(world.spare_slots.shape[1]):
            clear_slot(world.spare_slots[count, k])
    return count + 1 if near > 0 else count


@rare_kernel
def comes_before(one: Record, two: Record) -> bool:
    """Tell whether a pair comes before another in the order of the list."""
    return one.a < two.a or (one.a == two.a and one.b < two.b)


@rare_kernel
def carry_history(world: World, count: int) -> None:
    """Bring the contact history of pairs that are in both lists over to the new one; both are sorted."""
    q = 0
    old_count = world.clock[0].pair_count
    for p in range(count):
        new = world.spare_pairs[p]
        while q < old_count and comes_before(world.pairs[q], new):
            q += 1
        if q < old_count and world.pairs[q].a == new.a and world.pairs[q].b == new.b:
            new.active = world.pairs[q].active
            for k in range(world.slots.shape[1]):
                world.spare_slots[p, k] = world.slots[q, k]


@rare_kernel
def collect_pairs(world: World) -> int:
    """Write all pairs within reach into the spare list, sorted; return how many there are, fitting or not."""
    bodies = world.bodies
    ground = bodies.size - 1
    reach = world.controls[0].skin
    count = 0
    for i in range(ground):
        for j in range(i + 1, ground):
            if are_near(bodies[i], bodies[j], reach):
                count = add_pair(world, count, i, j)
        if bodies[i].inverse_mass > 0.0 and ground_gap(bodies[i]) <= bodies[ground].y + reach:
            count = add_pair(world, count, i, ground)
    return count


@rare_kernel
def rebuild_pairs(world: World) -> bool:
    """Make the pair list anew; return False, with the old list untouched, where it does not fit."""
    count = collect_pairs(world)
    if count > world.spare_pairs.size:
        return False
    carry_history(world, count)
    for p in range(count):
        world.pairs[p] = world.spare_pairs[p]
        world.operators[p, NORMAL].left = 0
        world.operators[p, SHEAR].left = 0
        for k in range(world.slots.shape[1]):
            world.candidates[p, k] = world.spare_candidates[p, k]
            world.slots[p, k] = world.spare_slots[p, k]
    for i in range(world.bodies.size):
        body = world.bodies[i]
        body.list_x = body.x
        body.list_y = body.y
        body.list_angle = body.angle
    world.clock[0].pair_count = count
    world.clock[0].rebuilds += 1
    return True
