"""When the pair list has to be rebuilt: how far bodies have come since it was made, and when to check again."""

import math

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.energy import smallest_side
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.supports import has_motion
from blocksim.kernels.explicit.broad_phase import TRAVELLED, rebuild_pairs

PAIR_SHARE = 0.5 * TRAVELLED  # of the skin, that a body may move; the rest covers what was not foreseen
GROWTH = 4.0  # until the next check a body may become this many times as fast as the fastest one is now
MOST_UNSEEN = 1000  # steps
WAY_SHARE = 0.25  # of the smallest side, by which two bodies may come nearer in a step
MOST_UNSEEN_DRIVEN = 8  # steps, where a support moves: how fast it will, nothing here knows


@rare_kernel
def outruns_lists(world: World) -> bool:
    """Return True if two bodies could meet in one step that are not listed, or a corner pass through another body.

    Steps by the rules are far shorter (world/step.py), so this happens only with forced ones, and where blocks become
    many times as fast as was to be expected.
    """
    controls = world.controls[0]
    way = controls.skin
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        way = min(way, WAY_SHARE * smallest_side(body))
        fastest = max(fastest, math.sqrt(body.vx**2 + body.vy**2) + body.radius * abs(body.spin))
    return math.isfinite(fastest) and 2.0 * controls.step * fastest > way


@rare_kernel
def travel(body: Record) -> float:
    """Return how far (m) a corner of a body may have come since the pair list was made."""
    dx = body.x - body.list_x
    dy = body.y - body.list_y
    return math.sqrt(dx * dx + dy * dy) + body.radius * abs(body.angle - body.list_angle)


@rare_kernel
def unseen_steps(world: World, farthest: float, fastest: float) -> int:
    """Return for how many steps no body can come beyond its share of the skin.

    `farthest` (m) is how far one has come already and `fastest` (m/s) the speed of the fastest point of any. Falls over
    what is left are counted in: they add at most sqrt(2 g left) to a speed.
    """
    controls = world.controls[0]
    left = PAIR_SHARE * controls.skin - farthest
    if left <= 0.0:
        return 0
    gravity = math.sqrt(controls.gravity_x**2 + controls.gravity_y**2) + controls.push
    most = MOST_UNSEEN_DRIVEN if has_motion(controls) else MOST_UNSEEN
    drift = controls.step * (GROWTH * fastest + math.sqrt(2.0 * gravity * left))
    return most if left > drift * most else int(left / drift)


@rare_kernel
def update_pairs(world: World) -> bool:
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
