"""Many copies of one scene with different numbers in them, one after the other in one compiled call."""

from blocksim.kernels.common.arrays import PAIRS_FULL, REACHED, Floats, Integers, World
from blocksim.kernels.common.jit import entry_kernel, rare_kernel
from blocksim.kernels.common.members import Watched, frame_to_watch, member, watch
from blocksim.kernels.explicit.energy import measure
from blocksim.kernels.explicit.step import advance_single


@rare_kernel
def advance_member(world: World, last_step: int) -> int:
    """Step one member; see advance."""
    return advance_single(world, last_step)


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
        codes[m] = advance_member(world, 0)
        if codes[m] != PAIRS_FULL:
            measure(world, starts[m])
        clock = world.clock[0]
        while codes[m] == REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = advance_member(world, stop)
            if clock.steps == frame:
                watch(world.bodies, watched, m, frame)
