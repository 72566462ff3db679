"""Steps cut at impacts: few blocks come to an impact at the end of one interval, and go through it in a short one.

A block that meets something stays where it touches until the substep ends, though it has the velocity after the impact
already, and it is struck with the arms that it had when the interval began. So an impact is off by what happens in the
rest of its substep, first order in the length of that. Hops multiply it: a change of restitution from 0.8 to 0.80008
moves the fourth peak of a block of 32 x 50 mm that rocks by 0.9 %. So the time t at which the next point meets
something is predicted from gap s, approach u and the pull p of gravity,

    s + u t + p t^2 / 2 = 0,

an interval ends just before it, one of FINE of a step follows, then it is predicted again. An interval has as many
substeps as a step. The springs of the position pass keep their stiffness in seconds, so that what is at rest does not
move when the length changes, and impulses that a substep begins with go with it. Velocities live half a substep behind
and are shifted with its length: by gravity and loads in flight, by their own change where something holds a body.
"""

import math

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import FINE, MOST_CUTS, MOST_RESTRAINT
from blocksim.kernels.nonsmooth import arrays, slip


@kernel
def is_start(scene: arrays.Nonsmooth) -> bool:
    """Return True if velocities are those of time zero, not half a substep before."""
    stepping = scene.contacts.stepping[0]
    return scene.world.clock[0].steps == 0 and stepping.cuts == 0 and stepping.is_settled == 0


@kernel
def begin_of_interval(scene: arrays.Nonsmooth) -> float:
    """Return the time (s) at which the current interval begins."""
    return scene.world.clock[0].steps * scene.world.controls[0].step + scene.contacts.stepping[0].gone


@kernel
def is_continued(scene: arrays.Nonsmooth) -> bool:
    """Return True if the step goes on after the current interval."""
    stepping = scene.contacts.stepping[0]
    return stepping.length < scene.world.controls[0].step - stepping.gone


@kernel
def end_of_interval(scene: arrays.Nonsmooth) -> float:
    """Return the time (s) at which the current interval ends; a step ends at a multiple of its length."""
    if is_continued(scene):
        return begin_of_interval(scene) + scene.contacts.stepping[0].length
    return (scene.world.clock[0].steps + 1) * scene.world.controls[0].step


@rare_kernel
def begin_interval(scene: arrays.Nonsmooth, is_first: bool) -> None:
    """Begin the first interval of a step, or continue one that was cut; it is as long as what is left of the step."""
    stepping = scene.contacts.stepping[0]
    stepping.cuts = 0 if is_first else stepping.cuts + 1
    stepping.gone = 0.0 if is_first else stepping.gone + stepping.length
    stepping.last_substep = stepping.substep
    set_length(scene, scene.world.controls[0].step - stepping.gone)


@rare_kernel
def set_length(scene: arrays.Nonsmooth, length: float) -> None:
    """Give the next interval a length (s)."""
    stepping = scene.contacts.stepping[0]
    h = length / stepping.substeps
    if h == stepping.substep:
        stepping.length = length
        return
    shift_velocities(scene, h)
    ratio = h / stepping.substep
    for r in range(stepping.constraint_count):
        constraint = scene.contacts.constraints[r]
        constraint.normal_one *= ratio
        constraint.normal_two *= ratio
        constraint.shear *= ratio
    turn = stepping.frequency * h
    stepping.length = length
    stepping.substep = h
    stepping.open_bias = 1.0 / h
    stepping.closed_bias = turn / h / (turn + 2.0 * stepping.damping)
    stepping.softness = 1.0 / (turn * (turn + 2.0 * stepping.damping))


@rare_kernel
def shift_velocities(scene: arrays.Nonsmooth, h: float) -> None:
    """Bring velocities from half of the last substep behind to half of the next, h (s), by what the last one changed.

    In flight that is gravity and loads, of what something holds it is what the last substep has left of them
    (`held_change`). The ledger (energy.py) counts with velocities half a substep on, and with the displacements that
    velocities alone would give; what loads bring a body so is their work.
    """
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    old = stepping.substep
    behind = 0.0 if is_start(scene) else 0.5
    scene.used[:] = 0  # bodies with a contact that presses, not only in an impact
    states = scene.contacts.states
    for r in range(stepping.constraint_count):
        constraint = scene.contacts.constraints[r]
        inverse_mass = states[constraint.a].inverse_mass + states[constraint.b].inverse_mass
        impulse = constraint.normal_one + constraint.normal_two
        if slip.presses(impulse, inverse_mass, stepping) and not constraint.is_struck:
            scene.used[constraint.a] = scene.used[constraint.b] = 1
    for i in range(scene.world.bodies.size - 1):
        state = scene.contacts.states[i]
        if state.inverse_mass > 0.0:
            before = scene.contacts.before[i]
            share = behind * (old - h)
            ax, ay, turn = controls.gravity_x, controls.gravity_y, 0.0
            if scene.pushes.size > 1:
                ax += scene.pushes[i].ax
                ay += scene.pushes[i].ay
                turn = scene.pushes[i].rate
            if scene.used[i]:
                ax, ay, turn = held_change(state, before, stepping.last_substep, ax * ax + ay * ay)
            elif scene.pushes.size > 1:
                tally_shift(scene, i, share, behind * h)
            vx = state.vx + share * ax
            vy = state.vy + share * ay
            spin = state.spin + share * turn
            lifted = h * (controls.gravity_x * vx + controls.gravity_y * vy)
            lifted -= old * (controls.gravity_x * state.vx + controls.gravity_y * state.vy)
            lifted -= kinetic_ahead(vx, vy, behind * h, controls)
            lifted += kinetic_ahead(state.vx, state.vy, behind * old, controls)
            lifted += 0.5 * (state.spin * state.spin - spin * spin) * state.inverse_mass / state.inverse_inertia
            before.lifted += lifted
            before.vx += share * ax  # so that the change is still known where a length is given twice
            before.vy += share * ay
            before.spin += share * turn
            state.vx = vx
            state.vy = vy
            state.spin = spin


@rare_kernel
def tally_shift(scene: arrays.Nonsmooth, i: int, share: float, ahead: float) -> None:
    """Tally what loads bring a body in flight that is shifted by a time `share` (s), at velocities `ahead` (s) on."""
    controls, body = scene.world.controls[0], scene.world.bodies[i]
    state, one = scene.contacts.states[i], scene.pushes[i]
    vx = state.vx + share * controls.gravity_x
    vy = state.vy + share * controls.gravity_y
    gain = kinetic_ahead(vx + share * one.ax, vy + share * one.ay, ahead, controls) - kinetic_ahead(
        vx, vy, ahead, controls
    )
    spin = state.spin + share * one.rate
    one.work += body.mass * gain + 0.5 * body.inertia * (spin * spin - state.spin * state.spin)
    scene.contacts.before[i].lifted += gain + 0.5 * (spin * spin - state.spin * state.spin) * body.inertia / body.mass


@rare_kernel
def held_change(state: Record, before: Record, h: float, free: float) -> tuple[float, float, float]:
    """Return the accelerations (m/s2, m/s2, rad/s2) of a body that something holds, from its last substep h (s).

    One that rolls about a corner speeds up until the other meets the ground, and strikes it too slowly with the
    velocity of half a substep ago. Contacts that do no work take a part of the acceleration of gravity and loads away,
    so that the rest, measured by its kinetic energy, is no more than theirs, squared `free` (m2/s4); where it is, the
    change was none of motion alone but, say, a contact that closed, and nothing is known of the acceleration.
    """
    ax = (state.vx - before.vx) / h
    ay = (state.vy - before.vy) / h
    turn = (state.spin - before.spin) / h
    size = ax * ax + ay * ay + turn * turn * state.inverse_mass / state.inverse_inertia
    if size > MOST_RESTRAINT * free:
        return 0.0, 0.0, 0.0
    return ax, ay, turn


@rare_kernel
def kinetic_ahead(vx: float, vy: float, time: float, controls: Record) -> float:
    """Return the kinetic energy (J/kg) that a velocity (m/s) has a time (s) later in flight."""
    x = vx + time * controls.gravity_x
    y = vy + time * controls.gravity_y
    return 0.5 * (x * x + y * y)


@rare_kernel
def cut(scene: arrays.Nonsmooth) -> bool:
    """Cut the current interval, which ends the step, before or after the next impact; return True if it was cut."""
    stepping = scene.contacts.stepping[0]
    if is_continued(scene) or stepping.cuts >= MOST_CUTS:
        return False
    fine = FINE * scene.world.controls[0].step
    time = time_to_impact(scene)
    length = time - 0.5 * fine if time > fine else fine
    is_all = stepping.gone + length >= scene.world.controls[0].step  # to round-off: what is left has a length
    if length >= stepping.length or is_all:
        return False
    set_length(scene, length)
    return True


@rare_kernel
def time_to_impact(scene: arrays.Nonsmooth) -> float:
    """Return the time (s) until a point meets something fast enough to rebound; infinite if none does."""
    contacts = scene.contacts
    bodies = scene.world.bodies
    controls = scene.world.controls[0]
    least = math.inf
    for r in range(contacts.stepping[0].constraint_count):
        constraint = contacts.constraints[r]
        if constraint.reach != arrays.AWAY:
            a, b = bodies[constraint.a], bodies[constraint.b]
            free = (1.0 if a.inverse_mass > 0.0 else 0.0) - (1.0 if b.inverse_mass > 0.0 else 0.0)
            pull = free * (constraint.nx * controls.gravity_x + constraint.ny * controls.gravity_y)
            if scene.pushes.size > 1:
                pull += constraint.nx * (scene.pushes[constraint.a].ax - scene.pushes[constraint.b].ax)
                pull += constraint.ny * (scene.pushes[constraint.a].ay - scene.pushes[constraint.b].ay)
            one = (
                constraint.nx * (a.vx - b.vx)
                + constraint.ny * (a.vy - b.vy)
                + constraint.arm_a * a.spin
                - constraint.arm_b * b.spin
            )
            two = one - constraint.width * (a.spin - b.spin)
            least = min(least, meeting_time(constraint.gap_one, one, pull, contacts.stepping[0]))
            least = min(least, meeting_time(constraint.gap_two, two, pull, contacts.stepping[0]))
    return least


@rare_kernel
def meeting_time(gap: float, rate: float, pull: float, stepping: Record) -> float:
    """Return when (s) a gap (m) closes that changes at a rate (m/s), with a pull (m/s2); infinite if too slowly."""
    if gap >= arrays.FAR or rate >= -stepping.threshold:
        return math.inf
    square = rate * rate - 2.0 * pull * max(gap, 0.0)
    if square <= stepping.threshold * stepping.threshold:
        return math.inf
    return 2.0 * max(gap, 0.0) / (math.sqrt(square) - rate)
