"""Many copies of one scene with different numbers in them, one after the other in one compiled call."""

from blocksim.kernels.common.arrays import REACHED, Floats, Integers
from blocksim.kernels.common.jit import entry_kernel, rare_kernel
from blocksim.kernels.common.members import Watched, frame_to_watch, of_member, watch
from blocksim.kernels.common.members import member as world_of
from blocksim.kernels.nonsmooth.arrays import Contacts, Nonsmooth
from blocksim.kernels.nonsmooth.energy import measure_nonsmooth
from blocksim.kernels.nonsmooth.step import advance_single


@rare_kernel
def member(scenes: Nonsmooth, m: int) -> Nonsmooth:
    """Return the scene of one member; every array of `scenes` has the members along its first axis."""
    contacts = scenes.contacts
    return Nonsmooth(
        world_of(scenes.world, m),
        Contacts(
            contacts.states[m],
            contacts.before[m],
            contacts.constraints[m],
            contacts.groups[m],
            contacts.ends[m],
            contacts.materials[m],
            contacts.tallies[m],
            of_member(contacts.impacts, m),
            of_member(contacts.asides, m),
            contacts.residuals[m],
            contacts.stepping[m],
        ),
        scenes.kept[m],
        scenes.listed[m],
        scenes.firsts[m],
        scenes.begins[m],
        scenes.used[m],
        scenes.pushes[m],
    )


@rare_kernel
def advance_member(scene: Nonsmooth, last_step: int) -> int:
    """Step one member; see advance."""
    return advance_single(scene, last_step)


@entry_kernel
def advance_nonsmooth_members(
    scenes: Nonsmooth, members: Integers, last_steps: Integers, starts: Floats, codes: Integers, watched: Watched
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    As blocksim.kernels.explicit.ensemble.advance_members, with rows of `measure_nonsmooth`.
    """
    for m in members:
        scene = member(scenes, m)
        codes[m] = advance_member(scene, 0)
        measure_nonsmooth(scene, starts[m])
        clock = scene.world.clock[0]
        while codes[m] == REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = advance_member(scene, stop)
            if clock.steps == frame:
                watch(scene.world.bodies, watched, m, frame)
