"""Members of ensembles: one world out of many copies of a scene, and what is seen of it while it advances.

Members record no frames. Compiled code keeps the first step at which a block has moved and the places then; which
block was first is decided by blocksim.simulation.observables, as for a run with frames.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, jit


@jit.kernel
def of_member(records: arrays.Records | None, m: int) -> arrays.Records | None:
    """Return the particles or corners of one member; None where there are none."""
    if records is None:
        return None
    return records[m]


@jit.rare_kernel
def member(worlds: arrays.World, m: int) -> arrays.World:
    """Return the world of one member; every array of `worlds` has the members along its first axis."""
    return arrays.World(
        worlds.bodies[m],
        worlds.pairs[m],
        worlds.contacts[m],
        worlds.candidates[m],
        worlds.operators[m],
        worlds.interactions[m],
        of_member(worlds.particles, m),
        of_member(worlds.corners, m),
        worlds.points[m],
        worlds.starts[m],
        worlds.order[m],
        worlds.large[m],
        worlds.action[m],
        worlds.before[m],
        worlds.matrices[m],
        worlds.moved[m],
        worlds.motion[m],
        worlds.controls[m],
        worlds.clock[m],
        worlds.ledger[m],
        worlds.shares[m],
        worlds.between[m],
        worlds.team[m],
        worlds.loads[m],
        worlds.load_pieces[m],
    )


class Watched(NamedTuple):
    """What is watched of m members with b blocks each."""

    frames: arrays.Floats  # (m,) steps between two frames, zero where peaks are not followed
    periods: arrays.Floats  # (m,) the same, zero where it is not watched what moves first
    steps: arrays.Integers  # (m,) output: the first frame in which a block had moved, zero before
    places: arrays.Floats  # (m, 3, b) output: x, y (m), angle (rad) then
    start: arrays.Floats  # (m, 3, b) x, y (m), angle (rad)
    reach: arrays.Floats  # (m, b) m, half a diagonal
    thresholds: arrays.Floats  # (m, b) m, infinite for fixed blocks
    peaks: arrays.Floats  # (m,) output: rad, the largest rotation of a block that can move


def next_frame(done: int, period: float) -> int:
    """Return the next step with a frame after `done` steps, given the steps (not rounded) between two frames.

    Plain Python, as it is asked outside of compiled code too.
    """
    number = int(done / period)
    while round(number * period) <= done:
        number += 1
    return round(number * period)


step_of_next = jit.rare_kernel(next_frame)


@jit.rare_kernel
def frame_to_watch(watched: Watched, m: int, done: int) -> int:
    """Return the next step with a frame of a member that is of interest, zero where there is none.

    Every stop costs: without peaks there is none after the first move.
    """
    if watched.frames[m] > 0.0:
        return step_of_next(done, watched.frames[m])
    is_watched = watched.periods[m] > 0.0 and watched.steps[m] == 0
    return step_of_next(done, watched.periods[m]) if is_watched else 0


@jit.rare_kernel
def has_moved(bodies: arrays.Records, watched: Watched, m: int) -> bool:
    """Return True if some block of a member is farther than its threshold from where it began, or not finite."""
    for i in range(watched.thresholds.shape[1]):
        body = bodies[i]
        way = math.sqrt((body.x - watched.start[m, 0, i]) ** 2 + (body.y - watched.start[m, 1, i]) ** 2)
        turned = abs(body.angle - watched.start[m, 2, i]) * watched.reach[m, i]
        threshold = watched.thresholds[m, i]
        if not (way <= threshold and turned <= threshold):
            return True
    return False


@jit.rare_kernel
def watch(bodies: arrays.Records, watched: Watched, m: int, step: int) -> None:
    """Examine a frame of a member: how far blocks are turned, and what has moved if nothing had before."""
    for i in range(watched.thresholds.shape[1]):
        turn = abs(bodies[i].angle - watched.start[m, 2, i])
        if turn > watched.peaks[m] and watched.thresholds[m, i] < math.inf:
            watched.peaks[m] = turn
    if watched.periods[m] > 0.0 and watched.steps[m] == 0 and has_moved(bodies, watched, m):
        watched.steps[m] = step
        for i in range(watched.thresholds.shape[1]):
            watched.places[m, 0, i] = bodies[i].x
            watched.places[m, 1, i] = bodies[i].y
            watched.places[m, 2, i] = bodies[i].angle
