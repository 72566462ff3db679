"""The time loop between two outputs, in one compiled call for every thread.

Forces of all pairs of one thread's share; its bodies continue as soon as the last of their pairs is done. Losses are
tallied where forces are added up (also in history.py); `measure` writes what the scene holds now.
"""

import math

from blocksim.kernels.common import arrays, jit, loads, mechanics, supports
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.members import Watched, frame_to_watch, member, watch
from blocksim.kernels.common.systems import Coupled, Systems, step_systems, survey_systems
from blocksim.kernels.explicit import broad_phase, contact, history, inertia, laws
from blocksim.kernels.explicit.partition import add_from_before, add_kept, add_to_first, add_to_second, keep, partition
from blocksim.kernels.explicit.persistent_forces import CHANGED, TOUCHING, persistent_forces


@jit.rare_kernel
def note(share: arrays.Record, action: arrays.Record) -> None:
    """Note of a pair that was evaluated what all threads have to know after the step."""
    share.is_too_deep |= action.is_too_deep
    share.asks |= action.asks


@jit.rare_kernel
def forces_between(world: arrays.World, share: arrays.Record, step: float) -> None:
    """Evaluate a thread's part of the pairs between shares after a drift of `step` (s), and keep what they do."""
    for m in range(share.first_task, share.last_task):
        p = world.between[m].pair
        kind, effect = persistent_forces(world, p, step, world.particles)
        if kind == CHANGED:
            contact.pair_forces(world, p, step)
            note(share, world.action[0])
            world.between[m] = world.action[0]
            world.between[m].pair = p
        else:
            keep(world.between[m], effect, kind == TOUCHING)


@jit.rare_kernel
def changed_forces(world: arrays.World, p: int, step: float, tally: arrays.Record) -> None:
    """Evaluate a pair whose contacts change, or which is not one that persistent_forces.py handles."""
    contact.pair_forces(world, p, step)
    add_kept(world, world.pairs[p], world.action[0], tally)


@jit.kernel
def move_group(world: arrays.World, first: int, end: int, step: float, goes_on: bool) -> None:
    """Kick the bodies from `first` to before `end` by their new forces, then into the next step if the run goes on."""
    for i in range(first, end):
        mechanics.accelerate_and_kick(world.bodies[i], world.controls[0], step)
        if goes_on:
            mechanics.kick(world.bodies[i], step)
            mechanics.drift(world.bodies[i], step)


@jit.kernel
def forces_of_group(world: arrays.World, share: arrays.Record, end: int, step: float, tally: arrays.Record) -> None:
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
            kind, effect = persistent_forces(world, p, step, world.particles)
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


@jit.kernel
def forces_within(world: arrays.World, share: arrays.Record, step: float, goes_on: bool) -> None:
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
        end = min(first + arrays.GROUP, last_body)
        forces_of_group(world, share, end, step, world.ledger[first // arrays.GROUP])
        move_group(world, first, end, step, goes_on)
        first = end


LEDGER_ROW = (
    "kinetic",
    "potential",
    "stored_normal",
    "stored_shear",
    "dashpot",
    "friction",
    "broken",
    "to_support",
    "to_loads",
    "events",
)


@jit.rare_kernel
def contact_summary(world: arrays.World) -> tuple[float, float, int, float]:
    """Return energy stored in normal and in shear springs (J), number of contacts, largest overlap (m)."""
    normal = 0.0
    shear = 0.0
    count = 0
    largest = 0.0
    exponent = world.controls[0].exponent
    for p in range(world.clock[0].pair_count):
        pair = world.pairs[p]
        if pair.active > 0:
            values = world.interactions[world.bodies[pair.a].contact_class, world.bodies[pair.b].contact_class]
            for k in range(pair.active):
                one = world.contacts[p, k]
                of_spring = history.stiffness_before(one, pair.stiffness, values, world.particles)
                stiffness = history.shear_stiffness_before(one, of_spring, values, exponent)
                normal += laws.stored_energy(exponent, of_spring, one.depth)
                shear += 0.5 * stiffness * one.spring * one.spring
                count += 1
                largest = max(largest, one.depth)
    return normal, shear, count, largest


@jit.rare_kernel
def tallied(ledger: arrays.Records) -> tuple[float, float, float]:
    """Return the losses (J) to dashpots, friction and broken contacts, summed over all groups of pairs in order."""
    dashpot = 0.0
    friction = 0.0
    broken = 0.0
    for tally in ledger:
        dashpot += tally.dashpot
        friction += tally.friction
        broken += tally.broken
    return dashpot, friction, broken


@jit.entry_kernel
def measure(world: arrays.World, row: arrays.Floats) -> None:
    """Write one row of the ledger: energies (J) as in `LEDGER_ROW`, number of contacts, largest overlap (m)."""
    ledger = world.ledger[0]
    normal, shear, count, largest = contact_summary(world)
    row[0] = mechanics.kinetic_energy(world)
    row[1] = mechanics.potential_energy(world)
    row[2] = normal
    row[3] = shear
    row[4], row[5], row[6] = tallied(world.ledger)
    row[7] = ledger.to_support
    row[8] = 0.0
    for tally in world.ledger:
        row[8] += tally.to_loads
    row[9] = ledger.events
    row[10] = count
    row[11] = largest


NEIGHBOURS, CHECK, MOVE, TALLY, SHARE_OUT = range(5)  # what one thread does for all


@jit.rare_kernel
def is_supported(bodies: arrays.Records, controls: arrays.Record) -> bool:
    """Return True if every free body touches something, where there is gravity: at the top of its flight none rests."""
    if controls.gravity_x == 0.0 and controls.gravity_y == 0.0 and controls.push == 0.0:
        return True
    for i in range(bodies.size - 1):
        if bodies[i].inverse_mass > 0.0 and bodies[i].pairs_before == 0:
            return False
    return True


@jit.rare_kernel
def check(world: arrays.World, systems: Systems | None) -> int:
    """Check that the run may continue: finite, no pair overlaps too far, not at rest for the hold time."""
    controls = world.controls[0]
    clock = world.clock[0]
    ledger = world.ledger[0]
    mechanics.renew_rotations(world.bodies)
    fastest = mechanics.fastest_point(world.bodies)
    kinetic = mechanics.kinetic_energy(world)
    power = mechanics.weights_power(world)
    if systems is not None:
        speed, energy, work = survey_systems(systems, world)
        fastest = max(fastest, speed)
        kinetic += energy
        power += work
    ledger.travel_work += controls.check_every * controls.step * power
    ledger.largest_kinetic = max(ledger.largest_kinetic, kinetic)
    if math.isinf(fastest):
        return arrays.NOT_FINITE
    if clock.ends_at > 0:
        clock.ends_at = clock.steps
        return arrays.OVERLAP_LIMIT
    rests = (
        fastest < controls.rest_speed and is_supported(world.bodies, controls) and supports.is_support_at_rest(world)
    )
    rests = rests and loads.are_loads_steady(world)
    clock.checks_at_rest = clock.checks_at_rest + 1 if rests else 0
    return arrays.AT_REST if 0 < controls.rest_checks <= clock.checks_at_rest else arrays.REACHED


@jit.rare_kernel
def update_neighbours(world: arrays.World) -> int:
    """Keep the pair list valid; return PAIRS_FULL where it does not fit, TOO_FAST where none would do, else REACHED."""
    rebuilds = world.clock[0].rebuilds
    status = broad_phase.update_pairs(world)
    if world.clock[0].rebuilds != rebuilds:
        partition(world, world.team[arrays.TEAM_SIZE])
    return status


@jit.rare_kernel
def supervise(world: arrays.World, k: int, task: int, step: float, systems: Systems | None) -> int:
    """Let the first thread do a task for all while the others wait; return the status code that all follow."""
    barrier(world.team)
    if k == 0:
        world.clock[0].steps = world.shares[0].steps
        world.team[arrays.STATUS] = arrays.REACHED
        if task == NEIGHBOURS:
            world.team[arrays.STATUS] = update_neighbours(world)
        elif task == CHECK:
            world.team[arrays.STATUS] = check(world, systems)
        elif task == MOVE:
            supports.move_support(world, step)
            supports.move_driven(world, step)
        elif task == SHARE_OUT:
            inertia.share_out(world)
        else:
            supports.tally_moved(world, step, False)
            supports.tally_moved(world, step, True)
    barrier(world.team)
    return world.team[arrays.STATUS]


@jit.rare_kernel
def exchange_forces(world: arrays.World, k: int, step: float) -> None:
    """Evaluate the pairs between shares, everyone some of them, and add what comes from shares before."""
    forces_between(world, world.shares[k], step)
    barrier(world.team)
    add_from_before(world, world.shares[k])


@jit.rare_kernel
def note_depth(clock: arrays.Record, share: arrays.Record) -> None:
    """End the run with the next step if a pair of a share overlapped too far; at once where checks are due.

    Bodies that were done early have started the next step by now. All threads that note it in the same step write the
    same, and none later, as all have met in between.
    """
    if share.is_too_deep and clock.ends_at == 0:
        clock.ends_at = share.steps + 1


@jit.kernel
def has_ended(clock: arrays.Record, steps: int) -> bool:
    """Return True if the last step of a run that failed is among so many steps."""
    return 0 < clock.ends_at <= steps


@jit.rare_kernel
def open_call(world: arrays.World, k: int, last_step: int) -> None:
    """Get ready for the steps of one call."""
    clock = world.clock[0]
    if k == 0:
        if clock.is_started == 0:
            mechanics.place_all_corners(world.bodies)
        partition(world, world.team[arrays.TEAM_SIZE])
    barrier(world.team)
    every = world.controls[0].check_every
    share = world.shares[k]
    share.steps = clock.steps
    share.is_started = clock.is_started
    share.last_step = last_step
    share.next_check = (clock.steps // every + 1) * every
    share.until = 0
    share.is_too_deep = 0
    share.asks = 0
    share.status = arrays.OVERLAP_LIMIT if has_ended(clock, clock.steps) else arrays.REACHED


@jit.rare_kernel
def close_call(world: arrays.World, k: int) -> int:
    """Note how far the run is and return its status code, once all threads are done."""
    share = world.shares[k]
    barrier(world.team)
    if k == 0:
        world.clock[0].steps = share.steps
        world.clock[0].is_started = share.is_started
    return share.status


@jit.rare_kernel
def begin_steps(world: arrays.World, k: int, step: float) -> bool:
    """Start a step of `step` (s), set up to which one nothing has to be checked, return whether the run continues."""
    share = world.shares[k]
    if share.steps >= world.clock[0].next_update:
        share.status = supervise(world, k, NEIGHBOURS, step, None)
        if share.status != arrays.REACHED:
            return False
    mechanics.kick_and_drift(world.bodies, share.first_body, share.last_body, step)
    if world.loads.size > 0:
        loads.push_bodies(world, share.first_body, share.last_body, share.steps * world.controls[0].step + step, step)
    if supports.has_motion(world.controls[0]):
        supervise(world, k, MOVE, step, None)
        return True
    barrier(world.team)
    if share.is_started != 0 and world.loads.size == 0:
        share.until = min(share.last_step, share.next_check, world.clock[0].next_update)
    return True


@jit.rare_kernel
def end_steps(world: arrays.World, k: int, step: float, systems: Systems | None) -> bool:
    """Do the checks that are due after some steps; return whether the run continues."""
    share = world.shares[k]
    if supports.has_motion(world.controls[0]):
        supervise(world, k, TALLY, step, None)
    if share.steps >= world.clock[0].next_share:
        supervise(world, k, SHARE_OUT, step, None)
    if share.steps == share.next_check:
        share.next_check += world.controls[0].check_every
        share.status = supervise(world, k, CHECK, step, systems)
    if has_ended(world.clock[0], share.steps) and share.status != arrays.NOT_FINITE:
        share.status = arrays.OVERLAP_LIMIT
    return share.status == arrays.REACHED


@jit.kernel
def goes_further(clock: arrays.Record, share: arrays.Record) -> bool:
    """Return True if a thread has another step to do; the last step of a run that failed may be one more than asked."""
    if share.status != arrays.REACHED:
        return False
    return share.steps < share.last_step or share.is_started == 0 or share.steps + 1 == clock.ends_at


@jit.rare_kernel
def advance_thread(
    world: arrays.World, last_step: int, k: int, team: arrays.Integers | None, systems: Systems | None
) -> int:
    """Be thread k of those that step a world until `last_step`, or until something ends the run.

    Without a `team`, which is world.team, what threads exchange is not compiled: a first run is for one thread. With
    further `systems` steps do not follow upon one another: each begins when all bodies have ended the one before.
    """
    open_call(world, k, last_step)
    share = world.shares[k]
    clock = world.clock[0]
    while goes_further(clock, share):
        step = world.controls[0].step if share.is_started else 0.0
        if share.steps >= share.until and not begin_steps(world, k, step):
            break
        if share.steps + 1 == clock.ends_at:
            share.until = clock.ends_at
        share.until = min(share.until, clock.next_share)
        share.steps += share.is_started
        share.is_started = 1
        if systems is not None:
            share.until = share.steps
            step_systems(systems, world, k, step)
        goes_on = share.steps < share.until
        if team is not None:
            exchange_forces(world, k, step)
        forces_within(world, share, step, goes_on)
        if share.is_too_deep or share.asks:  # most steps have nothing to tell, and call nothing
            note_depth(clock, share)
            inertia.note_contacts(clock, share)
        barrier(world.team)
        if not goes_on and not end_steps(world, k, step, systems):
            break
    return close_call(world, k)


@jit.rare_kernel
def advance_single(world: arrays.World, last_step: int) -> int:
    """Step a world with one thread; see advance."""
    world.team[arrays.TEAM_SIZE] = 1
    return advance_thread(world, last_step, 0, None, None)


@jit.entry_kernel
def advance_alone(world: arrays.World, last_step: int) -> int:
    """Step a world with one thread; see advance."""
    return advance_single(world, last_step)


@jit.entry_kernel
def advance_in_team(world: arrays.World, last_step: int, k: int) -> int:
    """Be thread k of the world.team[TEAM_SIZE] that advance one world together; see advance. All get the same answer.

    Every thread comes with work space of its own (points, matrices, before, action) and shares all other arrays.
    """
    return advance_thread(world, last_step, k, world.team, None)


def advance(world: arrays.World, last_step: int) -> int:
    """Step until `last_step` or until something ends the run; return one of the status codes of arrays.py.

    The first call also evaluates the contacts at the start, as if after a step of no length; `advance(world, 0)` does
    only that. Checks fall on fixed step numbers and all flags are part of the state, so the bits of a run do not
    depend on where outputs interrupt it. PAIRS_FULL returns before anything has moved: give the lists more room and
    call again.
    """
    return int(advance_alone(world, last_step))


@jit.entry_kernel
def advance_coupled_alone(scene: Coupled, last_step: int) -> int:
    """Step a world and further systems with one thread; see advance."""
    scene.world.team[arrays.TEAM_SIZE] = 1
    return advance_thread(scene.world, last_step, 0, None, scene.systems)


@jit.entry_kernel
def advance_coupled_in_team(scene: Coupled, last_step: int, k: int) -> int:
    """Be thread k of those that advance a world and further systems together; see advance_in_team."""
    return advance_thread(scene.world, last_step, k, scene.world.team, scene.systems)


@jit.entry_kernel
def advance_members(
    worlds: arrays.World,
    members: arrays.Integers,
    last_steps: arrays.Integers,
    starts: arrays.Floats,
    codes: arrays.Integers,
    watched: Watched,
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    `members` (k,) are the numbers of those to advance; by number, last_steps (n,) are steps, starts (n, r) gets the
    row of `measure` at the start, and codes (n,) the status codes. `watched` gets the first frame in
    which a block had moved. PAIRS_FULL leaves a member to the caller, who can give it more room. A member is advanced
    by the code that advances a single world, so the bits are the same.
    """
    for m in members:
        world = member(worlds, m)
        codes[m] = advance_single(world, 0)
        if codes[m] != arrays.PAIRS_FULL:
            measure(world, starts[m])
        clock = world.clock[0]
        while codes[m] == arrays.REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = advance_single(world, stop)
            if clock.steps == frame:
                watch(world.bodies, watched, m, frame)
