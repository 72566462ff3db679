"""The time loop of the non-smooth scheme between two outputs, in one compiled call for every thread.

One substep of all bodies and constraints, shared by threads.
"""

import math

from blocksim.kernels.common import integrate, jit, loads, supports
from blocksim.kernels.common.arrays import (
    AT_REST,
    NOT_FINITE,
    OVERLAP_LIMIT,
    PAIRS_FULL,
    REACHED,
    STATUS,
    TEAM_SIZE,
    Floats,
    Integers,
    Records,
)
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.energy import weights_power
from blocksim.kernels.common.members import Watched, frame_to_watch, member as world_of, of_member, watch
from blocksim.kernels.nonsmooth import (
    arrays,
    cuts,
    energy,
    impact_rounds,
    impacts,
    motion,
    narrow_phase,
    neighbours,
    packs,
    passes,
    slip,
    sweeps,
)
from blocksim.kernels.nonsmooth.begin import is_start, load_states


@jit.kernel
def kick_share(number: int, is_first_step: bool) -> float:
    """Return the share of a whole kick of gravity in substep `number` of a step; the first of a run has half of one."""
    return 0.5 if is_first_step and number == 0 else 1.0


@jit.kernel
def bodies_of_thread(contacts: arrays.Contacts, k: int, size: int) -> tuple[int, int]:
    """Return the bodies of thread k, from the first to before the last; the ground belongs to no thread."""
    count = contacts.states.size - 1
    if size == 1:
        return 0, count
    return count * k // size, count * (k + 1) // size


@jit.kernel
def prepare(scene: arrays.Nonsmooth, number: int, share: float) -> None:
    """Set what is the same for all bodies and constraints in substep `number`, with that share of a kick of gravity."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    stepping.is_shaken = supports.has_motion(controls)
    if stepping.is_shaken:
        motion.drive(scene, number)
    slip.follow_curvature(stepping, number)
    stepping.fall_x = stepping.substep * controls.gravity_x
    stepping.fall_y = stepping.substep * controls.gravity_y
    stepping.pull_x = stepping.fall_x
    stepping.pull_y = stepping.fall_y
    if scene.world.loads.size > 0:
        time = scene.world.clock[0].steps * controls.step + number * stepping.substep
        ax, ay = motion.pull_of_loads(scene.world, time)
        stepping.pull_x += stepping.substep * ax
        stepping.pull_y += stepping.substep * ay
    stepping.lag = share - 0.5
    stepping.has_rebounds = 0


@jit.kernel
def start(scene: arrays.Nonsmooth, k: int, number: int, is_first_step: bool) -> None:
    """Kick the bodies of thread k with gravity and loads, and begin with the impulses of the last substep."""
    contacts = scene.contacts
    team = scene.world.team
    h = contacts.stepping[0].substep
    hx = h * scene.world.controls[0].gravity_x
    hy = h * scene.world.controls[0].gravity_y
    share = kick_share(number, is_first_step)
    first, last = bodies_of_thread(contacts, k, team[TEAM_SIZE])
    if number == 0:
        motion.kick_all(contacts.states, contacts.before, first, last, share, hx, hy)
        if scene.world.loads.size > 0:
            motion.kick_by_loads(scene, number, first, last, share, 0.0)
        barrier(team)
        sweeps.sweep(contacts, passes.WARM, team, k)
    else:
        last_share = kick_share(number - 1, is_first_step)
        motion.kick_all_warm(contacts.states, contacts.before, first, last, last_share, hx, hy)
        if scene.world.loads.size > 0:
            motion.kick_by_loads(scene, number, first, last, share, last_share)
        barrier(team)


@jit.kernel
def tally(scene: arrays.Nonsmooth, k: int, share: float) -> tuple[int, int]:
    """Tally bodies and constraints of thread k, whose packs are returned, in a substep with that share of a kick."""
    contacts = scene.contacts
    stepping = contacts.stepping[0]
    team = scene.world.team
    if scene.world.loads.size > 0:
        first, last = bodies_of_thread(contacts, k, team[TEAM_SIZE])
        motion.tally_loads(scene, first, last, share)
    first, last = sweeps.range_of_thread(0, stepping.pack_count, k, team[TEAM_SIZE])
    sweeps.tally_constraints(contacts, first, last, (share - 1.0) * stepping.fall_x, (share - 1.0) * stepping.fall_y)
    return first, last


@jit.kernel
def note_what_presses(
    scene: arrays.Nonsmooth, k: int, number: int, is_first_step: bool, impact_lanes: Records | None
) -> None:
    """Note what presses before substep `number` as thread k; `impact_lanes` as in go_through_impacts."""
    if impact_lanes is None:
        return
    contacts = scene.contacts
    first, last = sweeps.range_of_thread(0, contacts.stepping[0].pack_count, k, scene.world.team[TEAM_SIZE])
    impact_rounds.keep_held(contacts, first, last)
    if number == 0 and (is_first_step or contacts.stepping[0].has_forgotten):
        controls = scene.world.controls[0]
        share = 1.0 if is_first_step else 0.0
        impact_rounds.hold(contacts, first, last, share * controls.gravity_x, share * controls.gravity_y)


@jit.kernel
def go_through_impacts(
    scene: arrays.Nonsmooth, k: int, bodies: tuple[int, int], share: float, impact_lanes: Records | None
) -> None:
    """Let impacts of a substep follow from one another as thread k; see follow_impacts.

    Where there are no `impact_lanes` nothing rebounds that much, and the compiler leaves this out altogether.
    """
    if impact_lanes is None:
        return
    if scene.contacts.stepping[0].has_rebounds:
        barrier(scene.world.team)
        impacts.follow_impacts(scene.contacts, scene.world.team, k, bodies, share, scene.pushes)


@jit.kernel
def report_impacts(contacts: arrays.Contacts, first: int, last: int, impact_lanes: Records | None) -> None:
    """Give some packs the impulses of impacts at the end of a step; `impact_lanes` as in go_through_impacts."""
    if impact_lanes is None:
        return
    if contacts.stepping[0].has_rebounds:
        impact_rounds.bring_back(contacts, first, last, True)


@jit.kernel
def substep(scene: arrays.Nonsmooth, k: int, number: int, is_first_step: bool) -> None:
    """Go through substep `number` of a step as thread k; the first one of a run has half a kick of gravity."""
    contacts = scene.contacts
    team = scene.world.team
    stepping = contacts.stepping[0]
    share = kick_share(number, is_first_step)
    first, last = bodies_of_thread(contacts, k, team[TEAM_SIZE])
    if k == 0:
        prepare(scene, number, share)
    note_what_presses(scene, k, number, is_first_step, contacts.impact_lanes)
    start(scene, k, number, is_first_step)
    sweeps.sweep(contacts, passes.POSITION, team, k)
    ground = last + (k == team[TEAM_SIZE] - 1)  # which may move, is the last
    motion.drift_all(contacts.states, first, ground, stepping.substep)
    barrier(team)
    sweeps.velocity_pass(contacts, team, k, passes.FIRST_VELOCITY, stepping.tolerance)
    go_through_impacts(scene, k, (first, last), share, contacts.impact_lanes)
    first, last = tally(scene, k, share)
    if number == stepping.substeps - 1:
        report_impacts(contacts, first, last, contacts.impact_lanes)
    barrier(team)


NEIGHBOURS, GATHER, CHECK = range(3)  # what one thread does for all
UNDER_WAY = -1  # beside the status codes: the step goes on


@jit.kernel
def is_supported(scene: arrays.Nonsmooth) -> bool:
    """Return True if every free body has a contact that presses, where there is gravity."""
    world = scene.world
    controls = world.controls[0]
    if controls.gravity_x == 0.0 and controls.gravity_y == 0.0 and controls.push == 0.0:
        return True
    scene.used[:] = 0
    contacts = scene.contacts
    for r in range(contacts.stepping[0].constraint_count):
        constraint = contacts.constraints[r]
        if constraint.normal_one > 0.0 or constraint.normal_two > 0.0:
            scene.used[constraint.a] = 1
            scene.used[constraint.b] = 1
    for i in range(world.bodies.size - 1):
        if world.bodies[i].inverse_mass > 0.0 and scene.used[i] == 0:
            return False
    return True


@jit.kernel
def check(scene: arrays.Nonsmooth) -> int:
    """Check that the run may continue: finite, not at rest for the hold time."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    integrate.renew_angles(world.bodies)
    ledger = world.ledger[0]
    ledger.travel_work += controls.check_every * controls.step * weights_power(world)
    ledger.largest_kinetic = max(ledger.largest_kinetic, integrate.kinetic_energy(world))
    fastest = integrate.fastest_point(world.bodies)
    if math.isinf(fastest):
        return NOT_FINITE
    if energy.has_excessive_overlap(scene):
        return OVERLAP_LIMIT
    rests = fastest < controls.rest_speed and is_supported(scene) and supports.is_support_at_rest(world)
    rests = rests and loads.are_loads_steady(world)
    clock.checks_at_rest = clock.checks_at_rest + 1 if rests else 0
    return AT_REST if 0 < controls.rest_checks <= clock.checks_at_rest else REACHED


@jit.kernel
def end_interval(scene: arrays.Nonsmooth) -> int:
    """End an interval of a step for all; return UNDER_WAY, or the status of a step that has come to its end."""
    clock = scene.world.clock[0]
    scene.contacts.stepping[0].has_forgotten = 0
    if supports.has_motion(scene.world.controls[0]):
        motion.place_supports(scene)
    if cuts.is_continued(scene, scene.contacts.impact_lanes):
        return UNDER_WAY
    clock.steps += 1
    return check(scene) if clock.steps % scene.world.controls[0].check_every == 0 else REACHED


@jit.kernel
def supervise(scene: arrays.Nonsmooth, k: int, task: int) -> int:
    """Let the first thread do a task for all while the others wait; return the status code that all follow."""
    team = scene.world.team
    barrier(team)
    if k == 0:
        team[STATUS] = REACHED
        if task == NEIGHBOURS:
            if neighbours.update_pairs(scene):
                cuts.begin_step(scene, scene.contacts.impact_lanes)
            else:
                team[STATUS] = PAIRS_FULL
        elif task == GATHER:
            if cuts.is_shortened(scene, scene.contacts.impact_lanes):
                team[STATUS] = UNDER_WAY
            else:
                packs.gather(scene.contacts, scene.begins)
        else:
            team[STATUS] = end_interval(scene)
    barrier(team)
    return team[STATUS]


@jit.kernel
def do_step(scene: arrays.Nonsmooth, k: int) -> int:
    """Take one step as thread k, in as many intervals as it takes; return the status code."""
    contacts = scene.contacts
    if contacts.stepping[0].is_guarded:
        first, last = sweeps.range_of_thread(0, contacts.stepping[0].constraint_count, k, scene.world.team[TEAM_SIZE])
        impact_rounds.forget_struck(contacts, first, last)
    status = supervise(scene, k, NEIGHBOURS)
    if status != REACHED:
        return status
    status = UNDER_WAY
    while status == UNDER_WAY:
        status = take_interval(scene, k)
    return status


@jit.kernel
def take_interval(scene: arrays.Nonsmooth, k: int) -> int:
    """Take one interval of a step as thread k, or find that it must be shorter; return UNDER_WAY or the status code."""
    world = scene.world
    contacts = scene.contacts
    size = world.team[TEAM_SIZE]
    first, last = sweeps.range_of_thread(0, contacts.stepping[0].constraint_count, k, size)
    if contacts.stepping[0].cuts > 0:
        impact_rounds.forget_struck(contacts, first, last)
    narrow_phase.find_manifolds(scene, first, last)
    if supervise(scene, k, GATHER) == UNDER_WAY:
        return UNDER_WAY
    begin, end = sweeps.range_of_thread(0, contacts.stepping[0].pack_count, k, size)
    packs.pack_all(contacts, begin, end)
    count = contacts.stepping[0].substeps
    is_first = is_start(scene)
    for number in range(count):
        substep(scene, k, number, is_first)
    packs.unpack_all(contacts, begin, end)
    first, last = bodies_of_thread(contacts, k, size)
    motion.place_all(scene, first, last, kick_share(count - 1, is_first))
    return supervise(scene, k, CHECK)


@jit.kernel
def advance_thread(scene: arrays.Nonsmooth, last_step: int, k: int) -> int:
    """Be thread k of those that step a world until `last_step`, or until something ends the run."""
    if k == 0 and scene.world.clock[0].is_started == 0:
        load_states(scene)
        integrate.renew_angles(scene.world.bodies)
        scene.world.clock[0].is_started = 1
    barrier(scene.world.team)
    status = REACHED
    while status == REACHED and scene.world.clock[0].steps < last_step:
        status = do_step(scene, k)
    barrier(scene.world.team)
    return status


@jit.entry_kernel
def advance_nonsmooth_in_team(scene: arrays.Nonsmooth, last_step: int, k: int) -> int:
    """Be thread k of the team[TEAM_SIZE] that advance one world together. All get the same answer."""
    return advance_thread(scene, last_step, k)


def advance_nonsmooth(scene: arrays.Nonsmooth, last_step: int) -> int:
    """Step until `last_step` or until something ends the run; return one of the status codes of arrays.py.

    PAIRS_FULL returns before anything of the step has moved: give the lists more room and call again.
    """
    scene.world.team[TEAM_SIZE] = 1
    return int(advance_nonsmooth_in_team(scene, last_step, 0))


@jit.rare_kernel
def member(scenes: arrays.Nonsmooth, m: int) -> arrays.Nonsmooth:
    """Return the scene of one member; every array of `scenes` has the members along its first axis."""
    contacts = scenes.contacts
    return arrays.Nonsmooth(
        world_of(scenes.world, m),
        arrays.Contacts(
            contacts.states[m],
            contacts.before[m],
            contacts.constraints[m],
            contacts.packs[m],
            contacts.ends[m],
            contacts.materials[m],
            contacts.tallies[m],
            of_member(contacts.impacts, m),
            of_member(contacts.impact_lanes, m),
            contacts.residuals[m],
            contacts.stepping[m],
        ),
        scenes.kept[m],
        scenes.reaches[m],
        scenes.firsts[m],
        scenes.begins[m],
        scenes.used[m],
        scenes.pushes[m],
    )


@jit.rare_kernel
def advance_member(scene: arrays.Nonsmooth, last_step: int) -> int:
    """Step one member; see advance."""
    scene.world.team[TEAM_SIZE] = 1
    return advance_thread(scene, last_step, 0)


@jit.entry_kernel
def advance_nonsmooth_members(
    scenes: arrays.Nonsmooth, members: Integers, last_steps: Integers, starts: Floats, codes: Integers, watched: Watched
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    As blocksim.kernels.explicit.step.advance_members, with rows of `measure_nonsmooth`.
    """
    for m in members:
        scene = member(scenes, m)
        codes[m] = advance_member(scene, 0)
        energy.measure_nonsmooth(scene, starts[m])
        clock = scene.world.clock[0]
        while codes[m] == REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = advance_member(scene, stop)
            if clock.steps == frame:
                watch(scene.world.bodies, watched, m, frame)
