"""The pair list: when it has to be rebuilt, and what is in it.

Every body looks for neighbours within its reach: farther where it is faster, so that a few that fly do not have the
whole list rebuilt at every step. A pair is listed where two reaches meet, and the list is good until a body has
used up its own, less what it may move in the next step.

Bodies that all move alike come no nearer to each other, and over level ground only their descent counts. So travel is
measured against the mean motion along x, unless something fixed stands in its way: then against that of the supports,
which are at rest or move together.

The constraints of a new pair list: colours, and impulses carried over.

No two pairs of one colour share a free body, so that threads can go through a colour in parts, and what comes out does
not depend on who takes which part. Greedy in the order of the list: the same list has the same colours.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, grid, jit, shapes, supports
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth.arrays import AWAY, COLOURS, Nonsmooth
from blocksim.kernels.nonsmooth.groups import LONELY

ONE = 1


@jit.rare_kernel
def lowest_free(used: int) -> int:
    """Return the first colour whose bit is not set; the last one where there is none."""
    colour = 0
    while colour < COLOURS - 1 and (used >> colour) & ONE == ONE:
        colour += 1
    return colour


@jit.rare_kernel
def bit_of(colour: int) -> int:
    """Return the bit of a colour; none for the last one, which anybody can have (and which would be the sign)."""
    return ONE << colour if colour < COLOURS - 1 else 0


@jit.kernel
def forget(one: arrays.Record) -> None:
    """Set what a constraint keeps from step to step to zero."""
    one.nx = 0.0
    one.ny = 0.0
    one.normal_one = 0.0
    one.normal_two = 0.0
    one.shear = 0.0
    one.corner_one = 0
    one.corner_two = 0
    one.is_struck = 0


@jit.kernel
def copy_impulses(source: arrays.Record, target: arrays.Record) -> None:
    """Copy what a constraint keeps from step to step."""
    target.nx = source.nx
    target.ny = source.ny
    target.normal_one = source.normal_one
    target.normal_two = source.normal_two
    target.shear = source.shear
    target.corner_one = source.corner_one
    target.corner_two = source.corner_two
    target.is_struck = source.is_struck


@jit.rare_kernel
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


@jit.rare_kernel
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


@jit.rare_kernel
def most_groups(scene: Nonsmooth) -> int:
    """Return how many groups the constraints can make, whichever are active; the last colour's are solved singly."""
    count = 0
    for colour in range(COLOURS):
        size = scene.begins[colour + 1] - scene.begins[colour]
        most_left = min(size, LONELY if size % WIDTH >= LONELY else 1)  # groups of fewer than four; see gather
        count += size if colour == COLOURS - 1 else size // WIDTH + most_left
    return count


@jit.rare_kernel
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


STEPS = 16.0  # that a body should be able to continue before its reach is used up
MOST_MARGIN = 0.5  # of the least reach of two bodies


class Frame(NamedTuple):
    """Motion that brings no two bodies nearer: displacement since the list was built (m), and velocity (m/s)."""

    x: float
    y: float
    vx: float
    vy: float


@jit.kernel
def frame_of_supports(scene: Nonsmooth) -> Frame:
    """Return the motion of the supports."""
    one = scene.contacts.stepping[0]
    return Frame(one.support_x - one.listed_x, one.support_y - one.listed_y, one.support_vx, one.support_vy)


@jit.kernel
def common_frame(scene: Nonsmooth) -> Frame:
    """Return the mean motion of the bodies along x, or that of the supports where anything but the ground is fixed."""
    bodies = scene.world.bodies
    way = 0.0
    speed = 0.0
    if supports.has_motion(scene.world.controls[0]):
        return frame_of_supports(scene)
    for i in range(bodies.size - 1):
        body = bodies[i]
        if body.inverse_mass == 0.0:
            return frame_of_supports(scene)
        way += body.x - scene.listed[i].x
        speed += body.vx
    count = max(1, bodies.size - 1)
    return Frame(way / count, 0.0, speed / count, 0.0)


@jit.kernel
def corner_speed(body: arrays.Record, frame: Frame) -> float:
    """Return an upper bound (m/s) of the speed of a body's points in a frame."""
    return math.sqrt((body.vx - frame.vx) ** 2 + (body.vy - frame.vy) ** 2) + body.radius * abs(body.spin)


@jit.kernel
def travel(scene: Nonsmooth, i: int, frame: Frame) -> float:
    """Return how far (m) a corner of a body may have come in a frame since the pair list was made."""
    body = scene.world.bodies[i]
    dx = body.x - scene.listed[i].x - frame.x
    dy = body.y - scene.listed[i].y - frame.y
    return math.sqrt(dx * dx + dy * dy) + body.radius * abs(body.angle - body.list_angle)


@jit.rare_kernel
def update_driven(scene: Nonsmooth, frame: Frame) -> tuple[float, bool]:
    """Return the speed (m/s) of the fastest driven body in the next step, and whether none uses up its reach."""
    step = scene.world.controls[0].step
    fastest = 0.0
    is_good = True
    for one in scene.world.moved:
        if supports.is_driven(one):
            rate = coming_speed(scene, one, frame)
            reach = scene.listed[one.body].reach
            fastest = max(fastest, rate)
            is_good = is_good and travel(scene, one.body, frame) + min(rate * step, MOST_MARGIN * reach) <= reach
    return fastest, is_good


@jit.rare_kernel
def coming_speed(scene: Nonsmooth, one: arrays.Record, frame: Frame) -> float:
    """Return an upper bound (m/s) of the mean speed of the points of a driven body in the next step, in a frame.

    A path may begin, end or turn back at once: the velocity until now does not show it.
    """
    world = scene.world
    step = world.controls[0].step
    way = supports.way_over(world, one, world.clock[0].steps * step, step)
    rate = math.sqrt((way.x / step - frame.vx) ** 2 + (way.y / step - frame.vy) ** 2)
    return rate + world.bodies[one.body].radius * abs(way.angle) / step


@jit.kernel
def update_pairs(scene: Nonsmooth) -> bool:
    """Set the margin of the next step, and rebuild the pair list if bodies have come too far.

    Returns False where the list does not fit into its arrays; nothing has changed then.
    """
    world = scene.world
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    frame = common_frame(scene)
    falls = 2.0 * controls.step * (math.sqrt(controls.gravity_x**2 + controls.gravity_y**2) + controls.push)
    fastest = 0.0
    is_good = world.clock[0].rebuilds > 0
    is_finite = True
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        listed = scene.listed[i]
        rate = corner_speed(body, frame) + falls
        fastest = max(fastest, rate)
        gone = travel(scene, i, frame)
        is_finite = is_finite and math.isfinite(rate + gone)
        is_good = is_good and gone + min(2.0 * rate * controls.step, MOST_MARGIN * listed.reach) <= listed.reach
    if controls.driven != 0:
        coming, stays = update_driven(scene, frame)
        fastest = max(fastest, coming)
        is_good = is_good and stays
    stepping.margin = min(2.0 * controls.step * fastest, 2.0 * MOST_MARGIN * stepping.least_reach)
    return is_good or not is_finite or rebuild(scene, frame)  # what is not finite is found after the step


@jit.rare_kernel
def note_places(scene: Nonsmooth, frame: Frame) -> None:
    """Write where all bodies are and how far they reach."""
    world = scene.world
    stepping = scene.contacts.stepping[0]
    stepping.listed_x = stepping.support_x
    stepping.listed_y = stepping.support_y
    for i in range(world.bodies.size):
        body = world.bodies[i]
        listed = scene.listed[i]
        ahead = STEPS * world.controls[0].step * corner_speed(body, frame)
        listed.x = body.x
        listed.y = body.y
        listed.reach = min(max(ahead, stepping.least_reach), stepping.most_reach)
        listed.radius = body.radius + listed.reach
        body.list_angle = body.angle


@jit.kernel
def add(scene: Nonsmooth, count: int, i: int, j: int) -> int:
    """List a pair, if there is room; return the count needed."""
    if count < scene.kept.size:
        scene.kept[count].a = min(i, j)
        scene.kept[count].b = max(i, j)
    return count + 1


@jit.kernel
def are_near(scene: Nonsmooth, i: int, j: int) -> bool:
    """Return True if the reaches of two bodies meet, at least one of them free."""
    one = scene.listed[i]
    two = scene.listed[j]
    dx = one.x - two.x
    dy = one.y - two.y
    limit = one.radius + two.radius
    if dx * dx + dy * dy > limit * limit:
        return False
    states = scene.contacts.states
    if states[i].inverse_mass + states[j].inverse_mass == 0.0:
        return False
    return shapes.separation(scene.world.bodies[i], scene.world.bodies[j]) <= one.reach + two.reach


@jit.rare_kernel
def add_from_cell(scene: Nonsmooth, i: int, column: int, row: int, least: int, count: int) -> int:
    """List the neighbours of body i in one cell, from body number `least` on; return the count needed."""
    world = scene.world
    width = world.controls[0].cell_width
    j = world.heads[grid.bucket(column, row, world.heads.size)]
    while j > 0:
        if j > least and are_near(scene, i, j - 1):
            other = scene.listed[j - 1]  # cells share buckets
            if grid.cell_of(other.x, width) == column and grid.cell_of(other.y, width) == row:
                count = add(scene, count, i, j - 1)
        j = world.links[j - 1]
    return count


@jit.rare_kernel
def add_large(scene: Nonsmooth, i: int, count: int) -> int:
    """List the neighbours of body i among those too large for the grid."""
    for j in scene.world.large:
        is_new = j > i or scene.world.bodies[i].radius <= scene.world.controls[0].cell_radius
        if j != i and is_new and are_near(scene, i, j):
            count = add(scene, count, i, j)
    return count


@jit.rare_kernel
def list_pairs(scene: Nonsmooth) -> int:
    """List all pairs whose reaches meet; return how many there are, fitting or not.

    Every two neighbouring cells are visited from one of them only.
    """
    world = scene.world
    width = world.controls[0].cell_width
    ground = world.bodies.size - 1
    level = world.bodies[ground].y
    grid.fill_grid(world)
    count = 0
    for i in range(ground):
        body = world.bodies[i]
        if body.radius <= world.controls[0].cell_radius:
            column = grid.cell_of(body.x, width)
            row = grid.cell_of(body.y, width)
            count = add_from_cell(scene, i, column, row, i + 1, count)
            count = add_from_cell(scene, i, column + 1, row, 0, count)
            for x in range(column - 1, column + 2):
                count = add_from_cell(scene, i, x, row + 1, 0, count)
        count = add_large(scene, i, count)
        if body.inverse_mass > 0.0 and shapes.ground_gap(body) <= level + scene.listed[i].reach:
            count = add(scene, count, i, ground)
    return count


@jit.rare_kernel
def rebuild(scene: Nonsmooth, frame: Frame) -> bool:
    """Rebuild the pair list; return False, with the constraints untouched, where it does not fit."""
    note_places(scene, frame)
    count = list_pairs(scene)
    if count > scene.kept.size:
        scene.world.clock[0].rebuilds = 0
        return False
    keep_impulses(scene, count)
    colour_pairs(scene, count)
    if most_groups(scene) > scene.contacts.groups.size:
        scene.world.clock[0].rebuilds = 0
        return False
    place_constraints(scene, count)
    scene.world.clock[0].pair_count = count
    scene.world.clock[0].rebuilds += 1
    return True
