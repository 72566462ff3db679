"""One substep of all bodies and constraints, shared by threads."""

from blocksim.kernels.common.arrays import TEAM_SIZE, Records
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.supports import has_motion
from blocksim.kernels.nonsmooth.arrays import Contacts, Nonsmooth
from blocksim.kernels.nonsmooth.gap_curvature import follow_curvature
from blocksim.kernels.nonsmooth.impacts import follow_impacts
from blocksim.kernels.nonsmooth.iterate import FIRST_VELOCITY, POSITION, WARM, sweep, velocity_pass
from blocksim.kernels.nonsmooth.loads import kick_by_loads, pull_of_loads, tally_loads
from blocksim.kernels.nonsmooth.motion import drift_all, kick_all, kick_all_warm
from blocksim.kernels.nonsmooth.rounds import bring_back, hold, keep_held
from blocksim.kernels.nonsmooth.supports import drive
from blocksim.kernels.nonsmooth.sweeps import part_of, tally_constraints


@kernel
def kick_share(number: int, is_first_step: bool) -> float:
    """Return the share of a whole kick of gravity in substep `number` of a step; the first of a run has half of one."""
    return 0.5 if is_first_step and number == 0 else 1.0


@kernel
def bodies_of(contacts: Contacts, k: int, size: int) -> tuple[int, int]:
    """Return the bodies of thread k, from the first to before the last; the ground belongs to no thread."""
    count = contacts.states.size - 1
    if size == 1:
        return 0, count
    return count * k // size, count * (k + 1) // size


@kernel
def prepare(scene: Nonsmooth, number: int, share: float) -> None:
    """Set what is the same for all bodies and constraints in substep `number`, with that share of a kick of gravity."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    stepping.is_shaken = has_motion(controls)
    if stepping.is_shaken:
        drive(scene, number)
    follow_curvature(stepping, number)
    stepping.fall_x = stepping.substep * controls.gravity_x
    stepping.fall_y = stepping.substep * controls.gravity_y
    stepping.pull_x = stepping.fall_x
    stepping.pull_y = stepping.fall_y
    if scene.world.loads.size > 0:
        time = scene.world.clock[0].steps * controls.step + number * stepping.substep
        ax, ay = pull_of_loads(scene.world, time)
        stepping.pull_x += stepping.substep * ax
        stepping.pull_y += stepping.substep * ay
    stepping.lag = share - 0.5
    stepping.has_rebounds = 0


@kernel
def start(scene: Nonsmooth, k: int, number: int, is_first_step: bool) -> None:
    """Kick the bodies of thread k with gravity and loads, and begin with the impulses of the last substep."""
    contacts = scene.contacts
    team = scene.world.team
    h = contacts.stepping[0].substep
    hx = h * scene.world.controls[0].gravity_x
    hy = h * scene.world.controls[0].gravity_y
    share = kick_share(number, is_first_step)
    first, last = bodies_of(contacts, k, team[TEAM_SIZE])
    if number == 0:
        kick_all(contacts.states, contacts.before, first, last, share, hx, hy)
        if scene.world.loads.size > 0:
            kick_by_loads(scene, number, first, last, share, 0.0)
        barrier(team)
        sweep(contacts, WARM, team, k)
    else:
        last_share = kick_share(number - 1, is_first_step)
        kick_all_warm(contacts.states, contacts.before, first, last, last_share, hx, hy)
        if scene.world.loads.size > 0:
            kick_by_loads(scene, number, first, last, share, last_share)
        barrier(team)


@kernel
def tally(scene: Nonsmooth, k: int, share: float) -> tuple[int, int]:
    """Tally bodies and constraints of thread k, whose groups are returned, in a substep with that share of a kick."""
    contacts = scene.contacts
    stepping = contacts.stepping[0]
    team = scene.world.team
    if scene.world.loads.size > 0:
        first, last = bodies_of(contacts, k, team[TEAM_SIZE])
        tally_loads(scene, first, last, share)
    first, last = part_of(0, stepping.group_count, k, team[TEAM_SIZE])
    hx = stepping.substep * scene.world.controls[0].gravity_x
    hy = stepping.substep * scene.world.controls[0].gravity_y
    tally_constraints(contacts, first, last, (share - 1.0) * hx, (share - 1.0) * hy)
    return first, last


@kernel
def note_what_presses(scene: Nonsmooth, k: int, number: int, is_first_step: bool, asides: Records | None) -> None:
    """Note what presses before substep `number` as thread k; `asides` as in go_through_impacts."""
    if asides is None:
        return
    contacts = scene.contacts
    first, last = part_of(0, contacts.stepping[0].group_count, k, scene.world.team[TEAM_SIZE])
    keep_held(contacts, first, last)
    if number == 0 and (is_first_step or contacts.stepping[0].has_forgotten):
        controls = scene.world.controls[0]
        share = 1.0 if is_first_step else 0.0
        hold(contacts, first, last, share * controls.gravity_x, share * controls.gravity_y)


@kernel
def go_through_impacts(scene: Nonsmooth, k: int, bodies: tuple[int, int], share: float, asides: Records | None) -> None:
    """Let impacts of a substep follow from one another as thread k; see follow_impacts.

    Where there are no `asides` nothing rebounds that much, and the compiler leaves this out altogether.
    """
    if asides is None:
        return
    if scene.contacts.stepping[0].has_rebounds:
        barrier(scene.world.team)
        follow_impacts(scene.contacts, scene.world.team, k, bodies, share, scene.pushes)


@kernel
def report_impacts(contacts: Contacts, first: int, last: int, asides: Records | None) -> None:
    """Give some groups the impulses of impacts at the end of a step; `asides` as in go_through_impacts."""
    if asides is None:
        return
    if contacts.stepping[0].has_rebounds:
        bring_back(contacts, first, last, True)


@kernel
def substep(scene: Nonsmooth, k: int, number: int, is_first_step: bool) -> None:
    """Go through substep `number` of a step as thread k; the first one of a run has half a kick of gravity."""
    contacts = scene.contacts
    team = scene.world.team
    stepping = contacts.stepping[0]
    share = kick_share(number, is_first_step)
    first, last = bodies_of(contacts, k, team[TEAM_SIZE])
    if k == 0:
        prepare(scene, number, share)
    note_what_presses(scene, k, number, is_first_step, contacts.asides)
    start(scene, k, number, is_first_step)
    sweep(contacts, POSITION, team, k)
    ground = last + (k == team[TEAM_SIZE] - 1)  # which may move, is the last
    drift_all(contacts.states, first, ground, stepping.substep)
    barrier(team)
    velocity_pass(contacts, team, k, FIRST_VELOCITY, stepping.tolerance)
    go_through_impacts(scene, k, (first, last), share, contacts.asides)
    first, last = tally(scene, k, share)
    if number == stepping.substeps - 1:
        report_impacts(contacts, first, last, contacts.asides)
    barrier(team)
