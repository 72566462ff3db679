"""Many copies of one scene with different numbers in them, one after the other in one compiled call."""

from blocksim.kernels.advance import march_alone
from blocksim.kernels.arrays import PAIRS_FULL, REACHED, Floats, Integers, Records, World
from blocksim.kernels.energy import measure
from blocksim.kernels.jit import entry_kernel, kernel, rare_kernel
from blocksim.kernels.watch import Watched, frame_to_watch, watch


@kernel
def of_member(records: Records | None, m: int) -> Records | None:
    """Return the particles or corners of one member; None where there are none."""
    if records is None:
        return None
    return records[m]


@rare_kernel
def member(worlds: World, m: int) -> World:
    """Return the world of one member; every array of `worlds` has the members along its first axis."""
    return World(
        worlds.bodies[m],
        worlds.pairs[m],
        worlds.contacts[m],
        worlds.candidates[m],
        worlds.operators[m],
        worlds.interactions[m],
        of_member(worlds.particles, m),
        of_member(worlds.corners, m),
        worlds.points[m],
        worlds.spare_pairs[m],
        worlds.spare_candidates[m],
        worlds.heads[m],
        worlds.links[m],
        worlds.large[m],
        worlds.neighbours[m],
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


@rare_kernel
def march_member(world: World, last_step: int) -> int:
    """Step one member; see advance."""
    return march_alone(world, last_step)


@entry_kernel
def advance_members(
    worlds: World, members: Integers, last_steps: Integers, starts: Floats, codes: Integers, watched: Watched
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    `members` (k,) are the numbers of those to advance; by number, last_steps (n,) are steps, starts (n, r) gets the
    row of `measure` at the start, and codes (n,) the status codes. `watched` gets the first frame in
    which a block had moved. PAIRS_FULL leaves a member to the caller, who can give it more room. A member is advanced
    by the code that advances a single world, so the bits are the same.
    """
    for m in members:
        world = member(worlds, m)
        codes[m] = march_member(world, 0)
        if codes[m] != PAIRS_FULL:
            measure(world, starts[m])
        clock = world.clock[0]
        while codes[m] == REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = march_member(world, stop)
            if clock.steps == frame:
                watch(world.bodies, watched, m, frame)
