"""Energy where the corners and faces change at which two polygons touch: none comes up, and what goes is booked.

Two sharp or blunt corners that overlap by a sliver have next to no stiffness on the faces that are parallel, and all of
it on the faces beside these; a rectangle has no such neighbours. So where a contact passes from one to the other the
stiffness of the pair stays as it was, without which energy would come from nowhere. It is free again when the pair has
parted, or its stiffness would be less anyway.

The springs of a pair hold U before and U' after such a change, and the kicks on either side of it do the work
F c/2 + F' c'/2 over the drift, c and c' being how far the contacts closed in it. For linear springs the energy that is
left over, U - U' less that work, is the difference of U(k, g) before and after, with g the root of the overlaps at both
ends of the drift on the same face: k d (d + c)/2 each. For springs of another power it is that to first order in the
step. A change of stiffness by sliding and tilting is no loss, since it does work (tributary.py): what the old contacts
have is measured again on the faces that they had. Of the last drift that work is half done.
"""

import math

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.bearing import keep_bearing
from blocksim.kernels.explicit.damping import OPERATOR_LIFE
from blocksim.kernels.explicit.history import TAKEN
from blocksim.kernels.explicit.kinematics import resolve_point
from blocksim.kernels.explicit.laws import stored_energy
from blocksim.kernels.explicit.models import place_ended, slot_normal
from blocksim.kernels.explicit.tributary import PLANE, Bearing, bearing_of_facing, facing_of

MOST_RISE = 1.05  # of the energy of a pair, where its contacts change: more is no round-off and no motion of one step
NEGLIGIBLE = 1e-4  # of the limit of overlap: energies up to that of such an overlap are no matter, and may be round-off
LEAST_HELD = 0.01  # of its stiffness that a pair keeps in any case, so that nothing passes through


@kernel
def hold_down(
    world: World,
    p: int,
    count: int,
    had: int,
    is_changed: bool,
    before: float,
    left: int,
    step: float,
    tally: Record,
    corners: Records | None,
) -> None:
    """Hold down the stiffness of a pair of polygons where its contacts change, and book what energy goes; see the top.

    `had` contacts were there with the stiffness `before` (N/m), to be measured again in `left` steps, `count` are there
    now.
    """
    if corners is not None and world.pairs[p].bearing != PLANE and had > 0:
        was_held = world.pairs[p].is_held != 0
        hold_pair_down(world, p, count, had, is_changed, before)
        if is_changed and not was_held:
            now = stiffness_on_old_faces(world, p, count, had, before, corners)
            since = OPERATOR_LIFE - left + 1 if left > 0 else 1  # steps
            before += (1.0 - 0.5 / since) * (now - before)
        if is_changed or (was_held and world.pairs[p].is_held == 0):
            tally.broken += energy_gone(world, p, count, had if is_changed else 0, before, step)
    elif corners is not None:
        world.pairs[p].is_held = 0


@rare_kernel
def hold_pair_down(world: World, p: int, count: int, had: int, is_changed: bool, before: float) -> None:
    """Bound the stiffness of a pair whose contacts have changed by the energy that the old ones held; see hold_down."""
    pair = world.pairs[p]
    if pair.is_held != 0:
        if pair.stiffness >= before:
            keep_bearing(pair, Bearing(before, 0.0, 0.0), 1.0)
        else:
            pair.is_held = 0
    elif is_changed:
        law = world.controls[0].law
        held = 0.0
        for j in range(had):
            held += stored_energy(law, before, world.before[j].depth)
        now = 0.0
        for i in range(count):
            point = world.points[i]
            now += stored_energy(law, pair.stiffness, max(point.depth - point.closing, 0.0))
        if now > MOST_RISE * held + stored_energy(law, pair.stiffness, NEGLIGIBLE * pair.limit):
            pair.is_held = 1
            keep_bearing(pair, Bearing(pair.stiffness * max(held / now, LEAST_HELD), 0.0, 0.0), 1.0)


@kernel
def between(law: int, stiffness: float, depth: float, closing: float) -> float:
    """Return what a spring holds (J) between an overlap (m) and the one after it has closed by so much."""
    return stored_energy(law, stiffness, math.sqrt(depth * max(depth + closing, 0.0)))


@rare_kernel
def stiffness_on_old_faces(world: World, p: int, count: int, had: int, before: float, table: Records) -> float:
    """Return what the stiffness of a pair was `before`, of which `had` contacts are left, as it would be by now."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    deepest = 0.0
    nx = 0.0
    ny = 0.0
    for i in range(count):
        point = world.points[i]
        if world.contacts[p, i].depth > deepest:
            deepest = world.contacts[p, i].depth
            nx = point.nx
            ny = point.ny
    for j in range(had):
        old = world.before[j]
        if old.slot != TAKEN and old.depth > deepest:
            deepest = old.depth
            nx, ny = slot_normal(world, pair, old.slot, old.face)
    if deepest == 0.0:
        return before
    whole = world.interactions[a.contact_class, b.contact_class].normal_stiffness
    share: float = bearing_of_facing(facing_of(a, b, nx, ny, table)).share
    return whole * share


@rare_kernel
def energy_gone(world: World, p: int, count: int, had: int, before: float, step: float) -> float:
    """Return the energy (J) that a pair has lost as its contacts, `had` with the stiffness `before`, changed."""
    pair = world.pairs[p]
    law = world.controls[0].law
    turned = step * (world.bodies[pair.a].spin - world.bodies[pair.b].spin)
    gone = 0.0
    for i in range(count):
        point = world.points[i]
        contact = world.contacts[p, i]
        now = max(pair.stiffness - 0.5 * (pair.slide * point.slipping + pair.turn * turned), 0.0)
        gone += between(law, before, contact.depth, point.closing)
        gone -= between(law, now, point.depth, -point.closing)
    last = world.points[world.points.size - 1]
    for j in range(had):
        old = world.before[j]
        if old.slot != TAKEN:
            place_ended(world, p, old, last)
            resolve_point(last, world.bodies[pair.a], world.bodies[pair.b], step)
            gone += between(law, before, old.depth, last.closing)
    return gone
