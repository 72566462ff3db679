"""The constraints of a new pair list: colours, and impulses carried over.

No two pairs of one colour share a free body, so that threads can go through a colour in parts, and what comes out does
not depend on who takes which part. Greedy in the order of the list: the same list has the same colours.
"""

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth.arrays import AWAY, COLOURS, Nonsmooth
from blocksim.kernels.nonsmooth.groups import LONELY

ONE = 1


@rare_kernel
def lowest_free(used: int) -> int:
    """Return the first colour whose bit is not set; the last one where there is none."""
    colour = 0
    while colour < COLOURS - 1 and (used >> colour) & ONE == ONE:
        colour += 1
    return colour


@rare_kernel
def bit_of(colour: int) -> int:
    """Return the bit of a colour; none for the last one, which anybody can have (and which would be the sign)."""
    return ONE << colour if colour < COLOURS - 1 else 0


@kernel
def forget(one: Record) -> None:
    """Set what a constraint keeps from step to step to zero."""
    one.nx = 0.0
    one.ny = 0.0
    one.normal_one = 0.0
    one.normal_two = 0.0
    one.shear = 0.0
    one.corner_one = 0
    one.corner_two = 0
    one.is_struck = 0


@kernel
def copy_impulses(source: Record, target: Record) -> None:
    """Copy what a constraint keeps from step to step."""
    target.nx = source.nx
    target.ny = source.ny
    target.normal_one = source.normal_one
    target.normal_two = source.normal_two
    target.shear = source.shear
    target.corner_one = source.corner_one
    target.corner_two = source.corner_two
    target.is_struck = source.is_struck


@rare_kernel
def keep_impulses(scene: Nonsmooth, count: int) -> None:
    """Copy the impulses of pairs that are in the old list and in the new one of `count` pairs."""
    constraints = scene.contacts.constraints
    kept = scene.kept
    for i in range(scene.firsts.size):
        scene.firsts[i] = 0
    for r in range(scene.contacts.stepping[0].constraint_count):
        if constraints[r].reach != AWAY:
            kept[r].next = scene.firsts[constraints[r].a]
            scene.firsts[constraints[r].a] = r + 1
    for p in range(count):
        one = kept[p]
        r = scene.firsts[one.a]
        while r > 0 and constraints[r - 1].b != one.b:
            r = kept[r - 1].next
        if r > 0:
            copy_impulses(constraints[r - 1], one)
        else:
            forget(one)


@rare_kernel
def colour_pairs(scene: Nonsmooth, count: int) -> None:
    """Give every pair a colour, and set where the constraints of every colour begin."""
    states = scene.contacts.states
    used = scene.used
    for i in range(used.size):
        used[i] = 0
    for colour in range(COLOURS + 1):
        scene.begins[colour] = 0
    last = 0
    for p in range(count):
        pair = scene.kept[p]
        free_a = states[pair.a].inverse_mass > 0.0
        free_b = states[pair.b].inverse_mass > 0.0
        colour = lowest_free((used[pair.a] if free_a else 0) | (used[pair.b] if free_b else 0))
        if free_a:
            used[pair.a] |= bit_of(colour)
        if free_b:
            used[pair.b] |= bit_of(colour)
        pair.colour = colour
        scene.begins[colour + 1] += 1
        last = max(last, colour + 1)
    for colour in range(COLOURS):
        scene.begins[colour + 1] += scene.begins[colour]
    scene.contacts.stepping[0].colours = last


@rare_kernel
def most_groups(scene: Nonsmooth) -> int:
    """Return how many groups the constraints can make, whichever are active; the last colour's are solved singly."""
    count = 0
    for colour in range(COLOURS):
        size = scene.begins[colour + 1] - scene.begins[colour]
        most_left = min(size, LONELY if size % WIDTH >= LONELY else 1)  # groups of fewer than four; see gather
        count += size if colour == COLOURS - 1 else size // WIDTH + most_left
    return count


@rare_kernel
def place_constraints(scene: Nonsmooth, count: int) -> None:
    """Make the constraints of all pairs, sorted by colour, with the impulses that were kept."""
    bodies = scene.world.bodies
    classes = scene.world.interactions.shape[0]
    next_place = scene.contacts.ends
    for colour in range(next_place.size):
        next_place[colour] = scene.begins[colour]
    for p in range(count):
        pair = scene.kept[p]
        constraint = scene.contacts.constraints[next_place[pair.colour]]
        next_place[pair.colour] += 1
        constraint.a = pair.a
        constraint.b = pair.b
        constraint.material = bodies[pair.a].contact_class * classes + bodies[pair.b].contact_class
        constraint.reach = AWAY
        copy_impulses(pair, constraint)
    scene.contacts.stepping[0].constraint_count = count
