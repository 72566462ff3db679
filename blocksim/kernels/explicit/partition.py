"""Which thread does what: bodies in shares, pairs by their first body, pairs between shares apart.

Sums over the pairs of a body have the order of the list, whatever the number of threads. The list is sorted by both
bodies, and the first is the smaller one; so what a body gets from pairs with bodies of shares before comes first, then
what it gets within its share, then pairs with bodies of shares after. Pairs between shares are evaluated first, by
anyone, and kept; then every thread adds what comes from before, and goes through its own pairs in their order.
"""

from blocksim.kernels.common.arrays import GROUP, Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.forces import Effect


@rare_kernel
def end_of_share(world: World, k: int, size: int, first: int) -> int:
    """Return the body after the last one of share k: whole groups, pairs divided evenly."""
    bodies = world.bodies.size
    if k == size - 1:
        return bodies
    count = world.clock[0].pair_count
    aim = count * (k + 1) // size
    if count == 0 or aim >= count:
        return first
    return min(bodies, max(first, (world.pairs[aim].a + GROUP // 2) // GROUP * GROUP))


@rare_kernel
def pairs_before(world: World, body: int) -> int:
    """Return how many pairs of the list have a first body before this one."""
    low = 0
    high = world.clock[0].pair_count
    while low < high:
        middle = (low + high) // 2
        if world.pairs[middle].a < body:
            low = middle + 1
        else:
            high = middle
    return low


@rare_kernel
def is_between(world: World, share: Record, pair: Record) -> bool:
    """Return True if the second body of a pair of a share is another share's and gets a force."""
    return pair.b >= share.last_body and world.bodies[pair.b].counts != 0


@rare_kernel
def fill_share(world: World, share: Record, kept: int) -> int:
    """Mark the pairs of a share that reach into others and list them, from place `kept`; return the place after."""
    share.first_between = kept
    for p in range(share.first_pair, share.last_pair):
        pair = world.pairs[p]
        pair.is_between = is_between(world, share, pair)
        if pair.is_between:
            world.between[kept].pair = p
            kept += 1
    share.last_between = kept
    return kept


@rare_kernel
def partition(world: World, size: int) -> None:
    """Divide bodies and pairs among `size` threads."""
    first = 0
    kept = 0
    for k in range(size):
        share = world.shares[k]
        share.first_body = first
        share.last_body = first = end_of_share(world, k, size, first)
        share.first_pair = pairs_before(world, share.first_body)
        share.last_pair = pairs_before(world, share.last_body)
        kept = fill_share(world, share, kept)
    for k in range(size):
        world.shares[k].first_task = kept * k // size
        world.shares[k].last_task = kept * (k + 1) // size


@kernel
def add_to_first(body: Record, fx: float, fy: float, torque: float) -> None:
    """Add force (N) and torque (N m) of a pair to the totals of its first body."""
    if body.counts:
        body.fx += fx
        body.fy += fy
        body.torque += torque
        body.pairs_now += 1


@kernel
def add_to_second(body: Record, fx: float, fy: float, torque: float) -> None:
    """Add force (N) and torque (N m) of a pair, which are against its second body, to the totals of that one."""
    if body.counts:
        body.fx -= fx
        body.fy -= fy
        body.torque -= torque
        body.pairs_now += 1


@rare_kernel
def keep(action: Record, effect: Effect, touches: bool) -> None:
    """Keep what a pair between shares does."""
    action.fx = effect.fx
    action.fy = effect.fy
    action.torque_a = effect.torque_a
    action.torque_b = effect.torque_b
    action.dashpot = effect.dashpot
    action.friction = effect.friction
    action.touches = touches
    action.is_changed = 0
    action.asks = 0


@rare_kernel
def add_kept(world: World, pair: Record, action: Record, tally: Record) -> tuple[float, float]:
    """Add what a pair does to the totals of its bodies; to those of the second one only where it is of the share.

    Losses of changed contacts are tallied at once, others are returned (J, to dashpots and friction): which, must
    not depend on who evaluates a pair, since a sum in another order has other bits.
    """
    if action.asks:  # for sums made anew
        world.bodies[pair.a].is_asked = 1
        if not pair.is_between:
            world.bodies[pair.b].is_asked = 1
    if action.touches:
        add_to_first(world.bodies[pair.a], action.fx, action.fy, action.torque_a)
        if not pair.is_between:
            add_to_second(world.bodies[pair.b], action.fx, action.fy, action.torque_b)
    if not action.is_changed:
        return action.dashpot, action.friction
    tally.dashpot += action.dashpot
    tally.friction += action.friction
    tally.broken += action.broken
    return 0.0, 0.0


@rare_kernel
def add_from_before(world: World, share: Record) -> None:
    """Add what pairs with bodies of shares before do to the bodies of a share."""
    for m in range(share.first_between):
        action = world.between[m]
        b = world.pairs[action.pair].b
        if share.first_body <= b < share.last_body:
            world.bodies[b].is_asked |= action.asks
            if action.touches:
                add_to_second(world.bodies[b], action.fx, action.fy, action.torque_b)
