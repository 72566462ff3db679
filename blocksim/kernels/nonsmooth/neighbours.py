"""The pair list: when it has to be rebuilt, and what is in it.

Every body looks for neighbours within its reach, farther where it is faster. A pair is listed where two reaches meet,
and is good until one of its bodies has used up its own, less what it may move in the next step. Travel is measured
against the supports, which are at rest or move together.

Bodies are listed anew one by one, when their own reach is used up: so what is listed of them, when and in which order,
follows from them and their neighbours alone, and what is out of reach changes no bit of their motion. Where each had
its own time, there would be some of them in every step. So in one of LIST_STEPS steps those are listed anew whose reach
would not last until the next of these steps.

The constraints of a new pair list: colours, and impulses carried over.

No two pairs of one colour share a free body, so that threads can go through a colour in parts, and what comes out does
not depend on who takes which part. Greedy in the order of the list: the same list has the same colours.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, neighbours, supports
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.common.tolerances import LIST_STEPS, MOST_MARGIN, REACH_STEPS
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
    """The motion of the supports: displacement since the run began (m), and velocity (m/s)."""

    x: float
    y: float
    vx: float
    vy: float


@jit.kernel
def frame_of_supports(scene: Nonsmooth) -> Frame:
    """Return the motion of the supports."""
    one = scene.contacts.stepping[0]
    return Frame(one.support_x, one.support_y, one.support_vx, one.support_vy)


@jit.kernel
def most_fall(scene: Nonsmooth) -> float:
    """Return an upper bound (m/s) of what gravity and loads add to velocities in two steps."""
    controls = scene.world.controls[0]
    return 2.0 * controls.step * (math.sqrt(controls.gravity_x**2 + controls.gravity_y**2) + controls.push)


@jit.kernel
def uses_up_reach(scene: Nonsmooth, i: int, frame: Frame, speed: float, falls: float) -> bool:
    """Return True if a body is to be listed anew that has a speed (m/s) in a frame, and gains `falls` (m/s)."""
    step, reach = scene.world.controls[0].step, scene.reaches[i]
    gone = neighbours.travel(scene.world.bodies[i], frame.x, frame.y)
    is_early = scene.world.clock[0].steps % LIST_STEPS == 0
    way = min(2.0 * step * (speed + falls), MOST_MARGIN * reach)
    if is_early:  # with the mean speed until the next such step
        way = (LIST_STEPS + 2.0) * step * (speed + 0.25 * LIST_STEPS * falls)
    return not gone + way <= reach


@jit.rare_kernel
def rate_of_driven(scene: Nonsmooth, number: int, frame: Frame) -> float:
    """Return an upper bound (m/s) of the mean speed of the points of a driven body in the next step, in a frame.

    A path may begin, end or turn back at once: the velocity until now does not show it.
    """
    world = scene.world
    step = world.controls[0].step
    one = world.moved[number]
    way = supports.way_over(world, one, world.clock[0].steps * step, step)
    rate = math.sqrt((way.x / step - frame.vx) ** 2 + (way.y / step - frame.vy) ** 2)
    return rate + world.bodies[one.body].radius * abs(way.angle) / step


@jit.kernel
def update_pairs(scene: Nonsmooth) -> bool:
    """Set the margin of the next step, and rebuild the pair list of bodies that have come too far.

    Returns False where the list does not fit into its arrays; nothing has changed then.
    """
    world, marks = scene.world, scene.firsts
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    frame = frame_of_supports(scene)
    falls = most_fall(scene)
    is_new = world.clock[0].rebuilds == 0
    fastest = 0.0
    is_finite = True
    count = 0
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        speed = neighbours.top_speed(body, frame.vx, frame.vy)
        is_finite = is_finite and math.isfinite(speed + body.x + body.y)
        fastest = max(fastest, speed + falls)
        marks[i] = 1 if is_new or uses_up_reach(scene, i, frame, speed, falls) else 0
        count += marks[i]
    marks[world.bodies.size - 1] = 0
    if controls.driven != 0:
        for number in range(world.moved.size):
            if supports.is_driven(world.moved[number]):
                i = world.moved[number].body
                rate = rate_of_driven(scene, number, frame)
                fastest = max(fastest, rate)
                if uses_up_reach(scene, i, frame, rate, 0.0):
                    marks[i] = 1
                    count += 1
    stepping.margin = min(2.0 * controls.step * fastest, 2.0 * MOST_MARGIN * stepping.least_reach)
    # what is not finite is found after the step
    return count == 0 or not is_finite or rebuild(scene, frame)


@jit.rare_kernel
def keep_fresh(scene: Nonsmooth, count: int) -> int:
    """Add listed pairs without a marked body to `count` pairs that are listed anew, if there is room for them.

    They keep their order, but that those with a lower colour come first. Returns the count needed.
    """
    constraints, kept, marks = scene.contacts.constraints, scene.kept, scene.firsts
    for r in range(scene.contacts.stepping[0].constraint_count):
        if marks[constraints[r].a] + marks[constraints[r].b] == 0:
            if count < kept.size:
                kept[count].a = constraints[r].a
                kept[count].b = constraints[r].b
            count += 1
    return count


@jit.rare_kernel
def rebuild(scene: Nonsmooth, frame: Frame) -> bool:
    """Rebuild the pair list of marked bodies, which reach as far as they are fast, and all constraints.

    Returns False, with the constraints untouched, where the list does not fit.
    """
    world, contacts = scene.world, scene.contacts
    stepping = contacts.stepping[0]
    for i in range(world.bodies.size - 1):
        if scene.firsts[i] > 0:
            body = world.bodies[i]
            body.list_x = body.x - frame.x
            body.list_y = body.y - frame.y
            body.list_angle = body.angle
            ahead = REACH_STEPS * world.controls[0].step * neighbours.top_speed(body, frame.vx, frame.vy)
            scene.reaches[i] = min(max(ahead, stepping.least_reach), stepping.most_reach)
    stale = neighbours.Stale(scene.firsts, scene.reaches)
    count = keep_fresh(scene, neighbours.list_pairs(world, scene.kept, stale, 0.0, world.clock[0].rebuilds == 0))
    fits = count <= scene.kept.size
    if fits:
        colour_pairs(scene, count)
        fits = most_packs(scene) <= contacts.packs.size
    if not fits:
        for i in range(world.bodies.size - 1):
            if scene.firsts[i] > 0:
                scene.reaches[i] = -1.0  # so that the same bodies are listed anew by the next call
        return False
    keep_impulses(scene, count)
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
