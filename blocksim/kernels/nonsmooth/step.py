"""A step of the non-smooth scheme, and the loop over steps between two outputs: one compiled call for every thread.

Threads go through the same stages, each with its own bodies and constraints; they meet at barriers, and what is the
same for all is done by the first one between two of them.
"""

from blocksim.kernels.common import jit, mechanics, supports
from blocksim.kernels.common.arrays import PAIRS_FULL, REACHED, STATUS, TEAM_SIZE, Floats, Integers, Records
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.members import Watched, frame_to_watch, member as world_of, of_member, watch
from blocksim.kernels.nonsmooth import (
    arrays,
    cuts,
    energy,
    flush_joints,
    impact_rounds,
    impacts,
    motion,
    narrow_phase,
    neighbours,
    packs,
    passes,
    slip,
)

UNDER_WAY = -1  # beside the status codes: the step goes on with another interval


@jit.kernel
def take_step(scene: arrays.Nonsmooth, k: int, impact_lanes: Records | None) -> int:
    """Take one step as thread k; return the status code.

    A step has one interval, unless it is cut at impacts. Where there are no `impact_lanes`, no impact follows from
    another, and the compiler leaves out what is about that.
    """
    contacts, team = scene.contacts, scene.world.team
    stepping = contacts.stepping[0]
    size = team[TEAM_SIZE]
    if impact_lanes is not None:
        first, last = passes.range_of_thread(0, stepping.constraint_count, k, size)
        impact_rounds.forget_struck(contacts, first, last)
    barrier(team)
    if k == 0:
        team[STATUS] = begin_step(scene, impact_lanes)
    barrier(team)
    while team[STATUS] == UNDER_WAY:
        first, last = passes.range_of_thread(0, stepping.constraint_count, k, size)
        if impact_lanes is not None and stepping.cuts > 0:
            impact_rounds.forget_struck(contacts, first, last)
        contacts.residuals[0, 8 * k] = narrow_phase.find_manifolds(scene, first, last)
        barrier(team)
        if k == 0:
            team[STATUS] = gather(scene, impact_lanes)
        barrier(team)
        if team[STATUS] == UNDER_WAY:
            continue
        first, last = passes.range_of_thread(0, stepping.pack_count, k, size)
        packs.pack_all(contacts, first, last)
        is_first = cuts.is_start(scene)
        for number in range(stepping.substeps):
            substep(scene, k, number, is_first, impact_lanes)
        packs.unpack_all(contacts, first, last)
        first, last = bodies_of_thread(contacts, k, size)
        motion.place_all(scene, first, last, kick_share(stepping.substeps - 1, is_first))
        barrier(team)
        if k == 0:
            team[STATUS] = end_interval(scene, impact_lanes)
        barrier(team)
    return team[STATUS]


@jit.kernel
def substep(scene: arrays.Nonsmooth, k: int, number: int, is_first: bool, impact_lanes: Records | None) -> None:
    """Go through substep `number` of an interval as thread k; `is_first` of the first interval of a run."""
    contacts, team = scene.contacts, scene.world.team
    stepping = contacts.stepping[0]
    has_loads = scene.world.loads.size > 0
    share = kick_share(number, is_first)
    first, last = bodies_of_thread(contacts, k, team[TEAM_SIZE])
    begin, end = passes.range_of_thread(0, stepping.pack_count, k, team[TEAM_SIZE])
    if k == 0:
        prepare(scene, number, share)
    if impact_lanes is not None:
        impact_rounds.keep_held(contacts, begin, end)
        if number == 0 and (is_first or stepping.has_forgotten):
            impact_rounds.hold(scene, begin, end, 1.0 if is_first else 0.0)
    hx = stepping.substep * scene.world.controls[0].gravity_x
    hy = stepping.substep * scene.world.controls[0].gravity_y
    last_share = kick_share(number - 1, is_first) if number > 0 else 0.0
    if number == 0:
        motion.kick(contacts.states, contacts.before, first, last, share, hx, hy)
    else:
        motion.kick_warm(contacts.states, contacts.before, first, last, last_share, hx, hy)
    if has_loads:
        motion.kick_by_loads(scene, number, first, last, share, last_share)
    barrier(team)
    if number == 0:
        passes.sweep(contacts, passes.WARM, team, k)
    passes.sweep(contacts, passes.POSITION, team, k)
    motion.drift(contacts.states, first, last + (k == team[TEAM_SIZE] - 1), stepping.substep)  # the ground is the last
    barrier(team)
    passes.velocity_pass(contacts, team, k, passes.FIRST_VELOCITY, stepping.tolerance)
    if impact_lanes is not None and stepping.has_rebounds:
        barrier(team)
        impacts.follow_impacts(contacts, team, k, (first, last), share, scene.pushes)
    if has_loads:
        motion.tally_loads(scene, first, last, share)
    passes.tally_constraints(contacts, begin, end, (share - 1.0) * stepping.fall_x, (share - 1.0) * stepping.fall_y)
    if impact_lanes is not None and number == stepping.substeps - 1 and stepping.has_rebounds:
        impact_rounds.bring_back(contacts, begin, end, True)
    barrier(team)


@jit.kernel
def kick_share(number: int, is_first: bool) -> float:
    """Return the share of a whole kick of gravity in substep `number` of a step; the first of a run has half of one."""
    return 0.5 if is_first and number == 0 else 1.0


@jit.kernel
def bodies_of_thread(contacts: arrays.Contacts, k: int, size: int) -> tuple[int, int]:
    """Return the bodies of thread k, from the first to before the last; the ground belongs to no thread."""
    count = contacts.states.size - 1
    if size == 1:
        return 0, count
    return count * k // size, count * (k + 1) // size


@jit.kernel
def begin_step(scene: arrays.Nonsmooth, impact_lanes: Records | None) -> int:
    """Bring the list of neighbours up to date, and begin a step with one interval; return UNDER_WAY or PAIRS_FULL."""
    if not neighbours.update_pairs(scene):
        return PAIRS_FULL
    if impact_lanes is not None and scene.contacts.stepping[0].is_guarded:
        cuts.begin_interval(scene, True)
    return UNDER_WAY


@jit.kernel
def gather(scene: arrays.Nonsmooth, impact_lanes: Records | None) -> int:
    """Make packs of the constraints that are near; where an impact comes first, shorten the interval: UNDER_WAY."""
    flush_joints.decide_all(scene)
    if impact_lanes is not None and scene.contacts.stepping[0].is_guarded and cuts.cut(scene):
        return UNDER_WAY
    packs.gather(scene.contacts, scene.begins)
    return REACHED


@jit.kernel
def prepare(scene: arrays.Nonsmooth, number: int, share: float) -> None:
    """Set what is the same for all bodies and constraints in substep `number`, with that share of a kick of gravity."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    stepping.is_shaken = supports.has_motion(controls)
    if stepping.is_shaken:
        motion.drive(scene, number)
    slip.follow_curvature(stepping, number)
    stepping.fall_x = stepping.pull_x = stepping.substep * controls.gravity_x
    stepping.fall_y = stepping.pull_y = stepping.substep * controls.gravity_y
    if scene.world.loads.size > 0:
        time = cuts.begin_of_interval(scene) + number * stepping.substep
        ax, ay = motion.pull_of_loads(scene.world, time)
        stepping.pull_x += stepping.substep * ax
        stepping.pull_y += stepping.substep * ay
    stepping.lag = share - 0.5
    stepping.has_rebounds = 0


@jit.kernel
def end_interval(scene: arrays.Nonsmooth, impact_lanes: Records | None) -> int:
    """End an interval; return UNDER_WAY where another follows, else the status of a step that has come to its end."""
    clock = scene.world.clock[0]
    scene.contacts.stepping[0].has_forgotten = 0
    if supports.has_motion(scene.world.controls[0]):
        motion.place_supports(scene)
    if impact_lanes is not None and cuts.is_continued(scene):
        cuts.begin_interval(scene, False)
        return UNDER_WAY
    clock.steps += 1
    return energy.check(scene) if clock.steps % scene.world.controls[0].check_every == 0 else REACHED


@jit.rare_kernel
def advance_thread(scene: arrays.Nonsmooth, last_step: int, k: int) -> int:
    """Be thread k of those that step a world until `last_step`, or until something ends the run."""
    if k == 0 and scene.world.clock[0].is_started == 0:
        motion.load_states(scene)
        mechanics.renew_angles(scene.world.bodies)
        scene.world.clock[0].is_started = 1
    barrier(scene.world.team)
    status = REACHED
    while status == REACHED and scene.world.clock[0].steps < last_step:
        status = take_step(scene, k, scene.contacts.impact_lanes)
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


@jit.entry_kernel
def advance_nonsmooth_members(
    scenes: arrays.Nonsmooth, members: Integers, last_steps: Integers, starts: Floats, codes: Integers, watched: Watched
) -> None:
    """Advance some members from their start to their last step, or to what ends them before.

    As blocksim.kernels.explicit.step.advance_members, with rows of `measure_nonsmooth`.
    """
    for m in members:
        scene = member(scenes, m)
        scene.world.team[TEAM_SIZE] = 1
        codes[m] = advance_thread(scene, 0, 0)
        energy.measure_nonsmooth(scene, starts[m])
        clock = scene.world.clock[0]
        while codes[m] == REACHED and clock.steps < last_steps[m]:
            frame = frame_to_watch(watched, m, clock.steps)
            stop = min(frame, last_steps[m]) if frame > 0 else last_steps[m]
            codes[m] = advance_thread(scene, stop, 0)
            if clock.steps == frame:
                watch(scene.world.bodies, watched, m, frame)
