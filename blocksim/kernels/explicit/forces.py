"""Forces of all pairs of one thread's share; its bodies continue as soon as the last of their pairs is done."""

from blocksim.kernels.common.arrays import GROUP, Record, World
from blocksim.kernels.common.integrate import finish_step, start_step
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.partition import add_kept, add_to_first, add_to_second, keep
from blocksim.kernels.explicit.persistent_forces import CHANGED, TOUCHING
from blocksim.kernels.explicit.persistent_pairs import persistent_forces


@rare_kernel
def note(share: Record, action: Record) -> None:
    """Note of a pair that was evaluated what all threads have to know after the step."""
    share.is_too_deep |= action.is_too_deep
    share.asks |= action.asks


@rare_kernel
def forces_between(world: World, share: Record, step: float) -> None:
    """Evaluate a thread's part of the pairs between shares after a drift of `step` (s), and keep what they do."""
    for m in range(share.first_task, share.last_task):
        p = world.between[m].pair
        kind, effect = persistent_forces(world, p, step, world.particles, world.corners)
        if kind == CHANGED:
            pair_forces(world, p, step)
            note(share, world.action[0])
            world.between[m] = world.action[0]
            world.between[m].pair = p
        else:
            keep(world.between[m], effect, kind == TOUCHING)


@rare_kernel
def changed_forces(world: World, p: int, step: float, tally: Record) -> None:
    """Evaluate a pair whose contacts change, or which is not one that persistent_pairs.py handles."""
    pair_forces(world, p, step)
    add_kept(world, world.pairs[p], world.action[0], tally)


@kernel
def finish_group(world: World, first: int, end: int, step: float, goes_on: bool) -> None:
    """Finish the step of the bodies from `first` to before `end`, and start their next one where the run continues."""
    for i in range(first, end):
        finish_step(world.bodies[i], world.controls[0], step)
        if goes_on:
            start_step(world.bodies[i], step)


@kernel
def forces_of_group(world: World, share: Record, end: int, step: float, tally: Record) -> None:
    """Evaluate the next pairs of a share, those whose first body is before `end`, and tally what they lose."""
    p = share.next_pair
    dashpot = 0.0
    friction = 0.0
    while p < share.last_pair and world.pairs[p].a < end:
        pair = world.pairs[p]
        if pair.is_between:
            lost, rubbed = add_kept(world, pair, world.between[share.next_between], tally)
            dashpot += lost
            friction += rubbed
            share.next_between += 1
        else:
            a = world.bodies[pair.a]
            b = world.bodies[pair.b]
            kind, effect = persistent_forces(world, p, step, world.particles, world.corners)
            if kind == TOUCHING:
                add_to_first(a, effect.fx, effect.fy, effect.torque_a)
                add_to_second(b, effect.fx, effect.fy, effect.torque_b)
                dashpot += effect.dashpot
                friction += effect.friction
            elif kind == CHANGED:
                changed_forces(world, p, step, tally)
                note(share, world.action[0])
        p += 1
    share.next_pair = p
    tally.dashpot += dashpot
    tally.friction += friction


@kernel
def forces_within(world: World, share: Record, step: float, goes_on: bool) -> None:
    """Evaluate the pairs of a share after a drift of `step` (s), and finish the step of its bodies.

    A body is complete after the last pair of which it is the first body, since its pairs with bodies before come
    earlier in the list. So the bodies of a group finish their step, and start the next where the run continues at once,
    while they are still at hand.
    """
    share.next_pair = share.first_pair
    share.next_between = share.first_between
    last_body = min(share.last_body, world.bodies.size - 1)  # the ground does not move by itself
    first = share.first_body
    while first < last_body:
        end = min(first + GROUP, last_body)
        forces_of_group(world, share, end, step, world.ledger[first // GROUP])
        finish_group(world, first, end, step, goes_on)
        first = end
