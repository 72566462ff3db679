"""Prescribed motion of the support: the ground, its pieces, walls and all fixed bodies together; see driven.py too."""

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel


@kernel
def has_motion(controls: Record) -> bool:
    """Return True if the support moves at all, or any body is driven."""
    return controls.motion_x != 0.0 or controls.motion_y != 0.0 or controls.driven != 0


@kernel
def is_driven(one: Record) -> bool:
    """Return True for the record of a body with a motion of its own, among those that move."""
    return one.shift_end > 0


@rare_kernel
def piece_at(motion: Records, piece: int, time: float) -> int:
    """Return the piece that holds at a time (s), sought from `piece` on."""
    while piece + 1 < motion.size and motion[piece + 1].start <= time:
        piece += 1
    return piece


@rare_kernel
def displacement(piece: Record, time: float) -> float:
    """Return the displacement (m) at a time (s)."""
    t = time - piece.start
    return piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3))


@rare_kernel
def rate(piece: Record, time: float) -> float:
    """Return the velocity (m/s) at a time (s)."""
    t = time - piece.start
    return piece.c1 + t * (2.0 * piece.c2 + 3.0 * t * piece.c3)


@rare_kernel
def acceleration(piece: Record, time: float) -> float:
    """Return the acceleration (m/s2) at a time (s)."""
    return 2.0 * piece.c2 + 6.0 * piece.c3 * (time - piece.start)


@rare_kernel
def move_support(world: World, step: float) -> None:
    """Bring everything that moves with the support to the end of the current drift.

    Positions are exact at every step, never summed up. The velocity is that of the drift, displacement over time, as
    the contacts want it: all relative displacements of the drift are exact.
    """
    controls = world.controls[0]
    clock = world.clock[0]
    before = clock.steps * controls.step
    now = before + step
    last = displacement(world.motion[piece_at(world.motion, clock.motion_piece, before)], before)
    clock.motion_piece = piece_at(world.motion, clock.motion_piece, before)
    piece = world.motion[piece_at(world.motion, clock.motion_piece, now)]
    moved = displacement(piece, now)
    speed = (moved - last) / step if step > 0.0 else rate(piece, now)
    change = acceleration(piece, now)
    for base in world.moved:
        if is_driven(base):
            break
        body = world.bodies[base.body]
        body.x = base.x + controls.motion_x * moved
        body.y = base.y + controls.motion_y * moved
        body.vx = controls.motion_x * speed
        body.vy = controls.motion_y * speed
        body.ax = controls.motion_x * change
        body.ay = controls.motion_y * change


@rare_kernel
def tally_support(world: World, step: float) -> None:
    """Tally the work that contacts have done on the support over the last drift, by the trapezoid rule as all work.

    Clears the totals.
    """
    total = 0.0
    for before in world.moved:
        if is_driven(before):
            break
        body = world.bodies[before.body]
        total += (before.fx + body.fx) * body.vx + (before.fy + body.fy) * body.vy
        before.fx = body.fx
        before.fy = body.fy
        body.fx = 0.0
        body.fy = 0.0
        body.torque = 0.0
        body.pairs_now = 0
    world.ledger[0].to_support += 0.5 * step * total


@rare_kernel
def is_support_at_rest(world: World) -> bool:
    """Return True if the motion of the support and of all driven bodies is over, or there is none."""
    time = world.clock[0].steps * world.controls[0].step
    for one in world.moved:
        if is_driven(one) and time < one.rest_time:
            return False
    last = world.motion[world.motion.size - 1]
    is_constant = last.c1 == 0.0 and last.c2 == 0.0 and last.c3 == 0.0
    return is_constant and time >= last.start
