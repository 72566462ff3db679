"""Candidate pairs: rebuilt when a body has used up its part of the skin, contact history carried over.

The list is sorted by both bodies; with that every sum over the pairs of a body has a fixed order. How far bodies have
come since it was made is looked at again before any can have come too far.
"""

import math

from blocksim.kernels.common import arrays, jit, loads, neighbours, supports, tolerances
from blocksim.kernels.explicit.models import near_slots

MOST_SLOTS = 32  # of corners of a pair
NEW_PAIR = arrays.zeros(1, arrays.PAIR)
PAIR_SHARE = 0.5 * tolerances.TRAVELLED  # of the skin, that a body may move; the rest covers what was not foreseen


@jit.rare_kernel
def list_reach(controls: arrays.Record) -> float:
    """Return up to which gap (m) two bodies are listed: they may move by 0.8 of the skin, and be on approach then."""
    return max(controls.skin, tolerances.TRAVELLED * controls.skin + controls.approach)


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
def move_pair(world: arrays.World, source: int, target: int) -> None:
    """Copy a pair, if it touches with its contacts and dashpots, from one place in the list to another."""
    world.pairs[target] = world.pairs[source]
    for k in range(world.pairs[source].active):
        world.contacts[target, k] = world.contacts[source, k]
    if world.pairs[source].active > 0:
        world.operators[target, arrays.NORMAL] = world.operators[source, arrays.NORMAL]
        world.operators[target, arrays.SHEAR] = world.operators[source, arrays.SHEAR]


@jit.rare_kernel
def overlap_limit(a: arrays.Record, b: arrays.Record, given: float) -> float:
    """Return how far (m) two bodies may overlap; `given` (m) is zero where nothing was asked for."""
    side = min(a.least_width, b.least_width)
    return min(given, tolerances.MIDDLE * side) if given > 0.0 else tolerances.OVERLAP_SHARE * side


@jit.rare_kernel
def carry_history(world: arrays.World, count: int) -> int:
    """Make the pairs of the new list, those that touch as they were in the old one; return how many have slots.

    Nothing of these changes, so that the motion does not depend on when lists are made. All that are in both lists move
    to the front first, then each to its place, as there is no memory for two lists of a large scene: both are sorted,
    so none is overtaken.
    """
    pairs, reach = world.pairs, list_reach(world.controls[0])
    listed = world.candidates.view(arrays.NEAR_PAIR)[:, 0]
    old_count = world.clock[0].pair_count
    q = kept = 0
    for p in range(count):
        a, b = listed[p].a, listed[p].b
        while q < old_count and (pairs[q].a < a or (pairs[q].a == a and pairs[q].b < b)):
            q += 1
        if q < old_count and pairs[q].a == a and pairs[q].b == b:
            move_pair(world, q, kept)
            kept += 1
    for p in range(count - 1, -1, -1):
        a, b, axis = listed[p].a, listed[p].b, 0
        is_old = kept > 0 and pairs[kept - 1].a == a and pairs[kept - 1].b == b
        if is_old:
            kept -= 1
            axis = pairs[kept].axis
            move_pair(world, kept, p)
        if not is_old or pairs[p].active == 0:
            pair = pairs[p]
            pairs[p] = NEW_PAIR[0]
            pair.a, pair.b, pair.axis = a, b, axis
            pair.limit = overlap_limit(world.bodies[a], world.bodies[b], world.controls[0].max_overlap)
        pairs[p].near = near_slots(world, a, b, reach, world.candidates[p], world.particles)
        pairs[p].idle = idle_candidates(pairs[p])
    used = 0
    for p in range(count):
        if pairs[p].near > 0:
            if used < p:
                move_pair(world, p, used)
                for k in range(pairs[p].near):
                    world.candidates[used, k] = world.candidates[p, k]
            used += 1
    return used


@jit.rare_kernel
def rebuild_pairs(world: arrays.World) -> bool:
    """Rebuild the pair list; return False, with the old list untouched but for candidates, where it does not fit."""
    listed = world.candidates.view(arrays.NEAR_PAIR)[:, 0]
    count = neighbours.list_pairs(world, listed, None, list_reach(world.controls[0]), False)
    if count > world.pairs.size:
        return False
    count = carry_history(world, count)
    neighbours.note_places(world.bodies)
    for body in world.bodies:
        body.counts = body.inverse_mass > 0.0 or (body.is_moved != 0 and supports.has_motion(world.controls[0]))
    world.clock[0].pair_count = count
    world.clock[0].rebuilds += 1
    return True


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
    most = tolerances.MOST_UNSEEN_DRIVEN if supports.has_motion(controls) else tolerances.MOST_UNSEEN
    drift = controls.step * (tolerances.SPEED_GROWTH * fastest + math.sqrt(2.0 * gravity * left))
    return most if left > drift * most else int(left / drift)


@jit.rare_kernel
def update_pairs(world: arrays.World) -> int:
    """Rebuild the pair list if a body has come too far since, and set the step of the next check.

    Returns PAIRS_FULL where the list does not fit into its arrays, TOO_FAST where two bodies could meet in one step
    that are not listed, or a corner pass through another body; nothing has changed then. Steps by the rules are far
    shorter (world/step.py), so the latter happens only with forced ones, and where blocks become many times as fast as
    was to be expected. Else REACHED.
    """
    clock = world.clock[0]
    controls = world.controls[0]
    way = controls.skin
    farthest = 0.0
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        way = min(way, tolerances.WAY_SHARE * body.least_width)
        fastest = max(fastest, neighbours.top_speed(body, 0.0, 0.0))
        if body.y > -math.inf:  # else the half-plane, out of reach
            farthest = max(farthest, neighbours.travel(body, 0.0, 0.0))
    if math.isfinite(fastest) and 2.0 * controls.step * fastest > way:
        return arrays.TOO_FAST
    for load in world.loads:
        fastest = max(fastest, loads.speed_given(world, load))
    if not math.isfinite(fastest + farthest):  # the next check ends the run
        clock.next_update = clock.steps + tolerances.MOST_UNSEEN
        return arrays.REACHED
    steps = unseen_steps(world, farthest, fastest) if clock.rebuilds > 0 else 0
    if steps == 0:
        if not rebuild_pairs(world):
            return arrays.PAIRS_FULL
        steps = max(1, unseen_steps(world, 0.0, fastest))
    clock.next_update = clock.steps + steps
    return arrays.REACHED
