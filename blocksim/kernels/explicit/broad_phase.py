"""Candidate pairs: rebuilt when a body has used up its part of the skin, contact history carried over.

A linked-cell grid finds them: every body but the few largest lies in the cell of its centre, cells are as wide as two
of them can reach, and the largest are tested one by one. Cells are hashed, so that it does not matter how far bodies
fly. The list is sorted by both bodies; with that every sum over the pairs of a body has a fixed order.

When the pair list has to be rebuilt: how far bodies have come since it was made, and when to check again.
"""

import math

from blocksim.kernels.common import arrays, energy, grid, jit, shapes, supports
from blocksim.kernels.explicit.depth import overlap_limit
from blocksim.kernels.explicit.models import near_slots

MOST_SLOTS = 32  # of corners of a pair
TRAVELLED = 0.8  # of the skin, by which two bodies may have come nearer since the list was made


@jit.rare_kernel
def are_near(body: arrays.Record, other: arrays.Record, reach: float) -> bool:
    """Return True if two bodies, at least one of them free, may be closer than `reach` (m)."""
    if body.inverse_mass == 0.0 and other.inverse_mass == 0.0:
        return False
    dx = body.x - other.x
    dy = body.y - other.y
    limit = body.radius + other.radius + reach
    return dx * dx + dy * dy <= limit * limit and shapes.separation(body, other) <= reach


@jit.rare_kernel
def list_reach(controls: arrays.Record) -> float:
    """Return up to which gap (m) two bodies are listed: they may move by 0.8 of the skin, and be on approach then."""
    return max(controls.skin, TRAVELLED * controls.skin + controls.approach)


@jit.rare_kernel
def add_pair(world: arrays.World, count: int, a: int, b: int) -> int:
    """Append a pair with its candidate slots, if it has any and there is room; return the count needed."""
    fits = count < world.spare_pairs.size
    row = count if fits else world.spare_pairs.size - 1
    near = near_slots(world, a, b, list_reach(world.controls[0]), world.spare_candidates[row])
    if near > 0 and fits:
        pair = world.spare_pairs[count]
        pair.a = a
        pair.b = b
        pair.near = near
        pair.limit = overlap_limit(world.bodies[a], world.bodies[b], world.controls[0].max_overlap)
        pair.stiffness = 0.0
        pair.slide = 0.0
        pair.turn = 0.0
        pair.bearing = 0
        pair.is_coming = 0
        pair.active = 0
        pair.duplicates = 0
        pair.is_sliver = 0
        pair.axis = 0
        pair.normal_left = 0
        pair.shear_left = 0
        pair.slides = 0
    return count + 1 if near > 0 else count


@jit.rare_kernel
def insert_sorted(row: arrays.Integers, count: int, j: int) -> int:
    """Insert a number into the first `count` of a sorted row, unless it is there; return the new count."""
    k = count
    while k > 0 and row[k - 1] > j:
        k -= 1
    if k > 0 and row[k - 1] == j:
        return count
    for m in range(count, k, -1):
        row[m] = row[m - 1]
    row[k] = j
    return count + 1


@jit.rare_kernel
def neighbours_in_cell(world: arrays.World, i: int, column: int, row: int, count: int) -> int:
    """Add the bodies after i in one cell that are within the skin of it to the work space; return their number."""
    reach = list_reach(world.controls[0])
    j = world.heads[grid.bucket(column, row, world.heads.size)]
    while j > 0:
        if j - 1 > i and are_near(world.bodies[i], world.bodies[j - 1], reach):
            count = insert_sorted(world.neighbours, count, j - 1)
        j = world.links[j - 1]
    return count


@jit.rare_kernel
def neighbours_of_large(world: arrays.World, i: int) -> int:
    """Write the bodies after i that are within the skin of it into the work space, sorted; return their number."""
    count = 0
    for j in range(i + 1, world.bodies.size - 1):
        if are_near(world.bodies[i], world.bodies[j], list_reach(world.controls[0])):
            world.neighbours[count] = j
            count += 1
    return count


@jit.rare_kernel
def neighbours_of(world: arrays.World, i: int) -> int:
    """Write the bodies after i that are within the skin of it into the work space, sorted; return their number."""
    controls = world.controls[0]
    body = world.bodies[i]
    if body.radius > controls.cell_radius:
        return neighbours_of_large(world, i)
    count = 0
    column = grid.cell_of(body.x, controls.cell_width)
    row = grid.cell_of(body.y, controls.cell_width)
    for x in range(column - 1, column + 2):
        for y in range(row - 1, row + 2):
            count = neighbours_in_cell(world, i, x, y, count)
    for j in world.large:
        if j > i and are_near(body, world.bodies[j], list_reach(controls)):
            count = insert_sorted(world.neighbours, count, j)
    return count


@jit.rare_kernel
def collect_pairs(world: arrays.World) -> int:
    """Write all pairs within reach into the spare list, sorted; return how many there are, fitting or not."""
    bodies = world.bodies
    ground = bodies.size - 1
    reach = list_reach(world.controls[0])
    count = 0
    grid.fill_grid(world)
    for i in range(ground):
        for k in range(neighbours_of(world, i)):
            count = add_pair(world, count, i, world.neighbours[k])
        if bodies[i].inverse_mass > 0.0 and shapes.ground_gap(bodies[i]) <= bodies[ground].y + reach:
            count = add_pair(world, count, i, ground)
    return count


@jit.rare_kernel
def comes_before(one: arrays.Record, two: arrays.Record) -> bool:
    """Return True if a pair comes before another in the order of the list."""
    return one.a < two.a or (one.a == two.a and one.b < two.b)


@jit.rare_kernel
def move_contacts(world: arrays.World, source: int, target: int, count: int) -> None:
    """Copy the first `count` contacts and the dashpots of one pair's place in the list to another's."""
    for k in range(count):
        world.contacts[target, k] = world.contacts[source, k]
    world.operators[target, arrays.NORMAL] = world.operators[source, arrays.NORMAL]
    world.operators[target, arrays.SHEAR] = world.operators[source, arrays.SHEAR]


@jit.rare_kernel
def carry_history(world: arrays.World, count: int) -> None:
    """Bring the contacts of pairs that are in both lists to their new places.

    Nothing of them changes, so that the motion does not depend on when lists are made. In place, as there is no memory
    for two of them in a large scene. Both lists are sorted, so the places keep their order: first all contacts move to
    the front, then from the last one on to where they belong.
    """
    q = 0
    kept = 0
    old_count = world.clock[0].pair_count
    for p in range(count):
        new = world.spare_pairs[p]
        while q < old_count and comes_before(world.pairs[q], new):
            q += 1
        if q < old_count and world.pairs[q].a == new.a and world.pairs[q].b == new.b:
            new.axis = world.pairs[q].axis
            if world.pairs[q].active > 0:
                new.active = world.pairs[q].active
                new.stiffness = world.pairs[q].stiffness
                new.bearing = world.pairs[q].bearing
                new.slide = world.pairs[q].slide
                new.turn = world.pairs[q].turn
                new.duplicates = world.pairs[q].duplicates
                new.is_sliver = world.pairs[q].is_sliver
                new.normal_left = world.pairs[q].normal_left
                new.shear_left = world.pairs[q].shear_left
                new.sticking = world.pairs[q].sticking
                new.slides = world.pairs[q].slides
                move_contacts(world, q, kept, new.active)
                kept += 1
    for p in range(count - 1, -1, -1):
        if world.spare_pairs[p].active > 0:
            kept -= 1
            move_contacts(world, kept, p, world.spare_pairs[p].active)


@jit.rare_kernel
def idle_candidates(pair: arrays.Record) -> int:
    """Return how many candidates of a pair are neither in contact nor the duplicate of one that is.

    Discs can have two contacts each, so that there may be more of those than candidates.
    """
    duplicates = 0
    for k in range(MOST_SLOTS):
        duplicates += int(pair.duplicates >> k) & 1
    return max(0, int(pair.near) - int(pair.active) - duplicates)


@jit.rare_kernel
def rebuild_pairs(world: arrays.World) -> bool:
    """Rebuild the pair list; return False, with the old list untouched, where it does not fit."""
    count = collect_pairs(world)
    if count > world.spare_pairs.size:
        return False
    carry_history(world, count)
    for p in range(count):
        pair = world.pairs[p]
        world.pairs[p] = world.spare_pairs[p]
        pair.idle = idle_candidates(pair)
        for k in range(pair.near):
            world.candidates[p, k] = world.spare_candidates[p, k]
    for i in range(world.bodies.size):
        body = world.bodies[i]
        body.list_x = body.x
        body.list_y = body.y
        body.list_angle = body.angle
        body.counts = body.inverse_mass > 0.0 or (body.is_moved != 0 and supports.has_motion(world.controls[0]))
    world.clock[0].pair_count = count
    world.clock[0].rebuilds += 1
    return True


PAIR_SHARE = 0.5 * TRAVELLED  # of the skin, that a body may move; the rest covers what was not foreseen
GROWTH = 4.0  # until the next check a body may become this many times as fast as the fastest one is now
MOST_UNSEEN = 1000  # steps
WAY_SHARE = 0.25  # of the smallest side, by which two bodies may come nearer in a step
MOST_UNSEEN_DRIVEN = 8  # steps, where a support moves: how fast it will, nothing here knows


@jit.rare_kernel
def outruns_lists(world: arrays.World) -> bool:
    """Return True if two bodies could meet in one step that are not listed, or a corner pass through another body.

    Steps by the rules are far shorter (world/step.py), so this happens only with forced ones, and where blocks become
    many times as fast as was to be expected.
    """
    controls = world.controls[0]
    way = controls.skin
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        way = min(way, WAY_SHARE * energy.smallest_side(body))
        fastest = max(fastest, math.sqrt(body.vx**2 + body.vy**2) + body.radius * abs(body.spin))
    return math.isfinite(fastest) and 2.0 * controls.step * fastest > way


@jit.rare_kernel
def travel(body: arrays.Record) -> float:
    """Return how far (m) a corner of a body may have come since the pair list was made."""
    dx = body.x - body.list_x
    dy = body.y - body.list_y
    return math.sqrt(dx * dx + dy * dy) + body.radius * abs(body.angle - body.list_angle)


@jit.rare_kernel
def unseen_steps(world: arrays.World, farthest: float, fastest: float) -> int:
    """Return for how many steps no body can come beyond its share of the skin.

    `farthest` (m) is how far one has come already and `fastest` (m/s) the speed of the fastest point of any. Falls over
    what is left are counted in: they add at most sqrt(2 g left) to a speed.
    """
    controls = world.controls[0]
    left = PAIR_SHARE * controls.skin - farthest
    if left <= 0.0:
        return 0
    gravity = math.sqrt(controls.gravity_x**2 + controls.gravity_y**2) + controls.push
    most = MOST_UNSEEN_DRIVEN if supports.has_motion(controls) else MOST_UNSEEN
    drift = controls.step * (GROWTH * fastest + math.sqrt(2.0 * gravity * left))
    return most if left > drift * most else int(left / drift)


@jit.rare_kernel
def update_pairs(world: arrays.World) -> bool:
    """Rebuild the pair list if a body has come too far since, and set the step of the next check.

    Returns False where the list does not fit into its arrays; nothing has changed then.
    """
    clock = world.clock[0]
    farthest = 0.0
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        fastest = max(fastest, math.sqrt(body.vx**2 + body.vy**2) + body.radius * abs(body.spin))
        if body.y > -math.inf:  # else the half-plane, out of reach
            farthest = max(farthest, travel(body))
    if not math.isfinite(fastest + farthest):  # the next check ends the run
        clock.next_update = clock.steps + MOST_UNSEEN
        return True
    steps = unseen_steps(world, farthest, fastest) if clock.rebuilds > 0 else 0
    if steps == 0:
        if not rebuild_pairs(world):
            return False
        steps = max(1, unseen_steps(world, 0.0, fastest))
    clock.next_update = clock.steps + steps
    return True
