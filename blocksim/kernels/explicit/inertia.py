"""Which part of a body the dashpots of one of its pairs stand for, while others bear it too.

A block that lands flat on several others is one mass on all their springs, and its dashpots must be those of that: the
damping of the body is 2 z M^(1/2) (M^(-1/2) K M^(-1/2))^(1/2) M^(1/2), K the stiffness of all its contacts. The
dashpots of a pair (damping.py) know the inverse masses that its points see. With the whole body for each of two pairs
they add up to the root of two times that, and restitution 0.5 comes out as 0.43; with half the body each, but its own
centre, each brakes the spin that it makes itself.

So a body is cut into pieces, one for each pair, as if sawn through above the joints. The piece of a pair with the
stiffness k has

    mass           s m,  s = k / (sum of k over all pairs, along the normal of this one)
    centre         above the centre of the pair's stiffness, less the centre of all: c = x - sum(s x)
    gyration       r^2 - s c^2 / (1 - s),  r^2 = I/m of the body: for two pieces what Steiner's terms leave,
                   so that both together have the inertia of the body; at least LEAST_GYRATION of r^2

In a flat landing, where sum(s c) = 0, every piece moves as the body does and has its frequency. Each is then damped as
a block of its own, all forces are in proportion, none is clipped before the others, and no spin comes up: exact. A pair
alone is a piece with s = 1 and c = 0: the body. Each piece has its own positive dashpot matrix: passive whatever moves.

The sums of a body are recomputed two steps after its contacts have changed, but at most every SHARE_PERIOD steps, and
all of them every SUM_PERIOD steps. Pairs about to touch count already: else the first steps of an impact, in which
dashpots are strongest, would have the wrong ones. Two thirds of the time that the nearest pair needs to touch pass
before they are searched for again.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import ALL, SHEAR, Corners, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import APPROACH, LEAST_GYRATION, MOST_PERIOD, SHARE_PERIOD, SUM_PERIOD
from blocksim.kernels.explicit import sides
from blocksim.kernels.explicit.bearing import are_blocks, bearing_along
from blocksim.kernels.explicit.models import SURFACE, surface

APPROACH_STEPS = APPROACH * SHARE_PERIOD  # two bodies that may touch within so many steps count as touching
NEVER = 2**62


class Piece(NamedTuple):
    """What of a body the dashpots of a pair stand for."""

    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2), about its own centre
    arm: float  # m, lever arm of the normal through its centre, about that of the body


@kernel
def piece_of(body: Record, stiffness: float, nx: float, ny: float, arm: float, direction: int) -> Piece:
    """Return the piece of a body for a pair of a stiffness (N/m) along the normal, with the mean lever arm (m)."""
    if body.seats < 2:
        return Piece(body.inverse_mass, body.inverse_inertia, 0.0)
    total = nx * nx * body.k_xx + 2.0 * nx * ny * body.k_xy + ny * ny * body.k_yy
    if total <= stiffness:
        return Piece(body.inverse_mass, body.inverse_inertia, 0.0)
    s = stiffness / total
    if direction == SHEAR:
        return Piece(body.inverse_mass / s, body.inverse_inertia / s, 0.0)
    offset = arm - (nx * body.k_x + ny * body.k_y) / total
    gyration = body.inverse_mass / body.inverse_inertia
    left = max(gyration - offset * offset * stiffness / (total - stiffness), LEAST_GYRATION * gyration)
    return Piece(body.inverse_mass / s, body.inverse_mass / (s * left), offset)


@kernel
def inverse_mass_of(
    one_a: float, one_b: float, two_a: float, two_b: float, cosine: float, of_a: Piece, of_b: Piece
) -> float:
    """Return the inverse mass (1/kg) that two points see of one another; arms (m) about the centres of the bodies.

    `cosine` is that of the angle between their normals.
    """
    translation = cosine * (of_a.inverse_mass + of_b.inverse_mass)
    turning_a = (one_a - of_a.arm) * (two_a - of_a.arm) * of_a.inverse_inertia
    return translation + turning_a + (one_b - of_b.arm) * (two_b - of_b.arm) * of_b.inverse_inertia


@kernel
def closing_bound(a: Record, b: Record, nx: float, ny: float) -> float:
    """Return an upper bound (m/s) of how fast any points of two bodies close along a normal from b to a."""
    turning = abs(a.spin) * a.radius + abs(b.spin) * b.radius
    return turning - nx * (a.vx - b.vx) - ny * (a.vy - b.vy)


@rare_kernel
def steps_apart(pair: Record, a: Record, b: Record, is_ground: bool, controls: Record, table: Corners) -> float:
    """Return after how many steps two bodies apart may touch, along their widest gap now; infinity if not near."""
    if sides.gap_on(pair.axis, a, b, is_ground, table) >= controls.approach:
        return math.inf
    pair.axis, gap = sides.widest_gap(a, b, is_ground, table)
    nx, ny = sides.way_over(pair, a, b, is_ground, table)
    closing = closing_bound(a, b, nx, ny)
    is_near = 0.0 <= gap < controls.approach
    return gap / (controls.step * closing) if is_near and closing > 0.0 else math.inf


@rare_kernel
def steps_to_ground(body: Record, ground: Record, controls: Record, table: Corners) -> float:
    """Return after how many steps a body that is not near the half-plane may touch it at the earliest."""
    gap = sides.gap_on(0, body, ground, True, table)
    closing = ground.vy - body.vy + body.radius * abs(body.spin)
    return gap / (controls.step * closing) if gap >= controls.approach and closing > 0.0 else math.inf


@rare_kernel
def steps_to_approach(bodies: Records, controls: Record, table: Corners) -> float:
    """Return after how many steps two bodies that are not near may touch at the earliest.

    Speeds are those against the mean of the free bodies: blocks that fly together have the same sums in any frame.
    """
    vx, vy, count = 0.0, 0.0, 0
    for i in range(bodies.size - 1):
        if bodies[i].inverse_mass > 0.0:
            vx, vy, count = vx + bodies[i].vx, vy + bodies[i].vy, count + 1
    vx, vy = vx / max(count, 1), vy / max(count, 1)
    ground = bodies[bodies.size - 1]
    fastest = 0.0
    soonest = math.inf
    for i in range(bodies.size - 1):
        body = bodies[i]
        fastest = max(fastest, math.sqrt((body.vx - vx) ** 2 + (body.vy - vy) ** 2) + body.radius * abs(body.spin))
        if body.inverse_mass > 0.0:
            soonest = min(soonest, steps_to_ground(body, ground, controls, table))
    return min(soonest, 0.5 * controls.approach / (controls.step * fastest)) if fastest > 0.0 else soonest


@rare_kernel
def add_to_body(body: Record, stiffness: float, nx: float, ny: float, arm: float) -> None:
    """Add a spring (N/m) along a normal with a lever arm (m) to the sums of a body that asks for it."""
    if body.is_asked:
        body.k_xx += stiffness * nx * nx
        body.k_xy += stiffness * nx * ny
        body.k_yy += stiffness * ny * ny
        body.k_x += stiffness * nx * arm
        body.k_y += stiffness * ny * arm


@rare_kernel
def add_spring(a: Record, b: Record, stiffness: float, x: float, y: float, nx: float, ny: float) -> None:
    """Add a spring (N/m) between two bodies at a place (m, from the centre of b) to the sums of both."""
    arm = x * ny - y * nx
    add_to_body(a, stiffness, nx, ny, arm - (a.x - b.x) * ny + (a.y - b.y) * nx)
    add_to_body(b, stiffness, nx, ny, arm)


@rare_kernel
def add_touching(world: World, p: int) -> None:
    """Add the contacts that a pair has to the sums."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    for k in range(pair.active):
        contact = world.contacts[p, k]
        nx, ny = surface.slot_normal(world, pair, contact.slot, contact.face)
        x, y = surface.slot_place(world, pair, contact.slot)
        add_spring(a, b, pair.stiffness, x - b.x, y - b.y, nx, ny)


@rare_kernel
def add_coming_corners(
    block: Record, base: Record, is_ground: bool, nx: float, ny: float, reach: float, stiffness: float, table: Corners
) -> None:
    """Add the corners of a block within a reach (m) above the ground or a piece of it; (nx, ny) is its normal."""
    below = 0.0 if is_ground else base.half_y
    for corner in range(sides.number_of_corners(block, table)):
        x, y = sides.corner_vector(block, table, corner)
        x += block.x - base.x
        y += block.y - base.y
        is_over = is_ground or abs(nx * y - ny * x) <= base.half_x
        if is_over and nx * x + ny * y - below < reach:
            add_spring(block, base, stiffness, x, y, nx, ny)


@rare_kernel
def add_coming(world: World, p: int, stiffness: float, step: float) -> None:
    """Add the contacts that a pair is about to have to the sums: both ends of the faces of two blocks."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    is_ground = pair.b == world.bodies.size - 1
    nx, ny = sides.way_over(pair, a, b, is_ground, world.corners)
    if is_ground or b.faces < ALL:
        reach = 2.0 * APPROACH_STEPS * step * closing_bound(a, b, nx, ny)
        add_coming_corners(a, b, is_ground, nx, ny, reach, stiffness, world.corners)
    elif are_blocks(a, b):
        found, bearing, _ = bearing_along(a, b, nx, ny, world.corners)
        along = 0.5 * (found.left + found.right)
        add_spring(a, b, 2.0 * stiffness * bearing.share, -along * ny, along * nx, nx, ny)


@rare_kernel
def find_coming(world: World) -> float:
    """Count for every body the pairs that are about to touch; return after how many steps the next of others may.

    Only pairs that are listed whatever the skin count, so that the motion does not depend on it.
    """
    controls = world.controls[0]
    soonest = steps_to_approach(world.bodies, controls, world.corners)
    for body in world.bodies:
        body.coming = 0
    for p in range(world.clock[0].pair_count):
        pair = world.pairs[p]
        pair.is_coming = 0
        if pair.active == 0:
            a = world.bodies[pair.a]
            b = world.bodies[pair.b]
            left = steps_apart(pair, a, b, pair.b == world.bodies.size - 1, controls, world.corners)
            if left < APPROACH_STEPS:
                pair.is_coming = 1
                a.coming += 1
                b.coming += 1
            else:
                soonest = min(soonest, left)
    return soonest


@rare_kernel
def choose_bodies(bodies: Records, is_due: bool) -> bool:
    """Mark the bodies whose sums are recomputed, and clear those; return whether there are any.

    These are bodies with several pairs where their number or that of their contacts has changed, or all where `is_due`
    says so. Of bodies that have or had several, and now another number, the dashpots are rebuilt.
    """
    are_any = False
    for i in range(bodies.size - 1):
        body = bodies[i]
        if body.inverse_mass > 0.0:
            before = body.seats
            body.seats = body.pairs_before + body.coming
            is_other = body.seats != before
            body.is_asked = body.seats > 1 and (is_due or is_other or body.is_asked != 0)
            if body.is_asked or (is_other and before > 1):
                body.sums_changed = 1
            if body.is_asked:
                are_any = True
                body.k_xx = body.k_xy = body.k_yy = body.k_x = body.k_y = 0.0
    return are_any


@rare_kernel
def make_sums(world: World, step: float) -> None:
    """Make the sums of the bodies that ask for it."""
    for p in range(world.clock[0].pair_count):
        pair = world.pairs[p]
        a = world.bodies[pair.a]
        b = world.bodies[pair.b]
        if a.is_asked or b.is_asked:
            if pair.active > 0:
                add_touching(world, p)
            elif pair.is_coming:
                add_coming(world, p, world.interactions[a.contact_class, b.contact_class].normal_stiffness, step)
    for i in range(world.bodies.size - 1):
        world.bodies[i].is_asked = 0


@rare_kernel
def share_out(world: World) -> None:
    """Renew what the pieces of bodies follow from, after the last pair of a step.

    Does nothing in models with particles, whose pairs have dashpots of the whole body each.
    """
    clock = world.clock[0]
    if world.controls[0].model != SURFACE:
        clock.next_share = NEVER
        return
    soonest = find_coming(world)
    clock.last_share = clock.steps
    clock.next_share = clock.steps + int(min(max(soonest / APPROACH, SHARE_PERIOD), MOST_PERIOD))
    is_due = clock.steps - clock.last_sums >= SUM_PERIOD
    if is_due:
        clock.last_sums = clock.steps
    if choose_bodies(world.bodies, is_due):
        make_sums(world, world.controls[0].step)


@rare_kernel
def note_contacts(clock: Record, share: Record) -> None:
    """Have the sums checked soon where contacts of a share have changed in this step.

    Not before the step after the next one: all threads that note it in the same step write the same, and a thread that
    does so in the next step, while others have yet to begin it, changes nothing that is asked in that one.
    """
    if share.asks:
        share.asks = 0
        clock.next_share = min(clock.next_share, max(share.steps + 2, clock.last_share + SHARE_PERIOD))
