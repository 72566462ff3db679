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

from blocksim.kernels.common import arrays, jit, neighbours, supports
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.common.tolerances import MOST_MARGIN, REACH_STEPS
from blocksim.kernels.nonsmooth.arrays import AWAY, COLOURS, KEPT, Nonsmooth
from blocksim.kernels.nonsmooth.packs import LONELY

ONE = 1
NEW_PAIR = arrays.zeros(1, KEPT)


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
    constraints, kept = scene.contacts.constraints, scene.kept
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
            copy_impulses(NEW_PAIR[0], one)


@jit.rare_kernel
def colour_pairs(scene: Nonsmooth, count: int) -> None:
    """Give every pair a colour, and set where the constraints of every colour begin.

    Colours are bits; the last one, which anybody can have, has none (and would be the sign).
    """
    states, used = scene.contacts.states, scene.used
    for i in range(used.size):
        used[i] = 0
    for colour in range(COLOURS + 1):
        scene.begins[colour] = 0
    last = 0
    for p in range(count):
        pair = scene.kept[p]
        free_a = states[pair.a].inverse_mass > 0.0
        free_b = states[pair.b].inverse_mass > 0.0
        taken = (used[pair.a] if free_a else 0) | (used[pair.b] if free_b else 0)
        colour = 0
        while colour < COLOURS - 1 and (taken >> colour) & ONE == ONE:
            colour += 1
        bit = ONE << colour if colour < COLOURS - 1 else 0
        if free_a:
            used[pair.a] |= bit
        if free_b:
            used[pair.b] |= bit
        pair.colour = colour
        scene.begins[colour + 1] += 1
        last = max(last, colour + 1)
    for colour in range(COLOURS):
        scene.begins[colour + 1] += scene.begins[colour]
    scene.contacts.stepping[0].colours = last


@jit.rare_kernel
def most_packs(scene: Nonsmooth) -> int:
    """Return how many packs the constraints can make, whichever are active; the last colour's are solved singly."""
    count = 0
    for colour in range(COLOURS):
        size = scene.begins[colour + 1] - scene.begins[colour]
        most_left = min(size, LONELY if size % WIDTH >= LONELY else 1)  # packs of fewer than four; see gather
        count += size if colour == COLOURS - 1 else size // WIDTH + most_left
    return count


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
        way += body.x - body.list_x
        speed += body.vx
    count = max(1, bodies.size - 1)
    return Frame(way / count, 0.0, speed / count, 0.0)


@jit.rare_kernel
def update_driven(scene: Nonsmooth, frame: Frame) -> tuple[float, bool]:
    """Return the speed (m/s) of the fastest driven body in the next step, and whether none uses up its reach.

    It is an upper bound of the mean speed of its points in a frame. A path may begin, end or turn back at once: the
    velocity until now does not show it.
    """
    world = scene.world
    step = world.controls[0].step
    fastest = 0.0
    is_good = True
    for one in world.moved:
        if supports.is_driven(one):
            body = world.bodies[one.body]
            way = supports.way_over(world, one, world.clock[0].steps * step, step)
            rate = math.sqrt((way.x / step - frame.vx) ** 2 + (way.y / step - frame.vy) ** 2)
            rate += body.radius * abs(way.angle) / step
            reach = scene.reaches[one.body]
            fastest = max(fastest, rate)
            gone = neighbours.travel(body, frame.x, frame.y)
            is_good = is_good and gone + min(rate * step, MOST_MARGIN * reach) <= reach
    return fastest, is_good


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
        reach = scene.reaches[i]
        rate = neighbours.top_speed(body, frame.vx, frame.vy) + falls
        fastest = max(fastest, rate)
        gone = neighbours.travel(body, frame.x, frame.y)
        is_finite = is_finite and math.isfinite(rate + gone)
        is_good = is_good and gone + min(2.0 * rate * controls.step, MOST_MARGIN * reach) <= reach
    if controls.driven != 0:
        coming, stays = update_driven(scene, frame)
        fastest = max(fastest, coming)
        is_good = is_good and stays
    stepping.margin = min(2.0 * controls.step * fastest, 2.0 * MOST_MARGIN * stepping.least_reach)
    return is_good or not is_finite or rebuild(scene, frame)  # what is not finite is found after the step


@jit.rare_kernel
def rebuild(scene: Nonsmooth, frame: Frame) -> bool:
    """Rebuild the pair list and its constraints, sorted by colour; how far a body reaches follows from its speed.

    Returns False, with the constraints untouched, where the list does not fit.
    """
    world, contacts = scene.world, scene.contacts
    stepping = contacts.stepping[0]
    neighbours.note_places(world.bodies)
    stepping.listed_x = stepping.support_x
    stepping.listed_y = stepping.support_y
    for i in range(world.bodies.size - 1):
        ahead = REACH_STEPS * world.controls[0].step * neighbours.top_speed(world.bodies[i], frame.vx, frame.vy)
        scene.reaches[i] = min(max(ahead, stepping.least_reach), stepping.most_reach)
    count = neighbours.list_pairs(world, scene.kept, scene.reaches, 0.0, False)
    fits = count <= scene.kept.size
    if fits:
        keep_impulses(scene, count)
        colour_pairs(scene, count)
        fits = most_packs(scene) <= contacts.packs.size
    if not fits:
        world.clock[0].rebuilds = 0
        return False
    next_place = contacts.ends
    for colour in range(next_place.size):
        next_place[colour] = scene.begins[colour]
    bodies, classes = world.bodies, world.interactions.shape[0]
    for p in range(count):
        pair = scene.kept[p]
        constraint = contacts.constraints[next_place[pair.colour]]
        next_place[pair.colour] += 1
        constraint.a = pair.a
        constraint.b = pair.b
        constraint.material = bodies[pair.a].contact_class * classes + bodies[pair.b].contact_class
        constraint.reach = AWAY
        copy_impulses(pair, constraint)
    stepping.constraint_count = count
    world.clock[0].pair_count = count
    world.clock[0].rebuilds += 1
    return True
