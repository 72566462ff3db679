"""Many copies of one scene with different numbers in them, one after the other in one compiled call."""

from blocksim.kernels.arrays import Floats, Integers
from blocksim.kernels.ensemble import member as world_of
from blocksim.kernels.jit import entry_kernel, rare_kernel
from blocksim.kernels.nonsmooth.advance import march_alone
from blocksim.kernels.nonsmooth.arrays import Contacts, Nonsmooth
from blocksim.kernels.nonsmooth.energy import measure_nonsmooth


@rare_kernel
def member(scenes: Nonsmooth, m: int) -> Nonsmooth:
    """Return the scene of one member; every array of `scenes` has the members along its first axis."""
    contacts = scenes.contacts
    return Nonsmooth(
        world_of(scenes.world, m),
        Contacts(
            contacts.lines[m],
            contacts.before[m],
            contacts.rows[m],
            contacts.groups[m],
            contacts.ends[m],
            contacts.touches[m],
            contacts.books[m],
            contacts.impacts[m],
            contacts.asides[m],
            contacts.residuals[m],
            contacts.stepping[m],
        ),
        scenes.kept[m],
        scenes.spots[m],
        scenes.firsts[m],
        scenes.begins[m],
        scenes.used[m],
    )


@entry_kernel
def advance_nonsmooth_members(
    scenes: Nonsmooth, members: Integers, last_steps: Integers, starts: Floats, codes: Integers
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    As blocksim.kernels.ensemble.advance_members, with rows of `measure_nonsmooth` (n, 8).
    """
    for m in members:
        scene = member(scenes, m)
        march_alone(scene, 0)
        measure_nonsmooth(scene, starts[m])
        codes[m] = march_alone(scene, last_steps[m])
