"""Loads in the substeps: like gravity, but body by body. In scenes without loads nothing of this is called.

A kick over a substep is that of the loads as they are when it begins, at the places then: halfway between the
velocities before and after it. What the kick brings a body is its impulse times the mean of the velocities before and
after the substep, contacts included; so their work adds up exactly, see energy.py.
"""

from blocksim.kernels.common.arrays import LOAD_FORCE, Records, World
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.loads import acceleration_at, accelerations
from blocksim.kernels.nonsmooth.arrays import Contacts, Nonsmooth
from blocksim.kernels.nonsmooth.motion import IN_FLIGHT


@rare_kernel
def pull_of_loads(world: World, time: float) -> tuple[float, float]:
    """Return the acceleration (m/s2) that loads give all free bodies at a time (s)."""
    x = 0.0
    y = 0.0
    for load in world.loads:
        if load.kind < LOAD_FORCE:
            ax, ay = acceleration_at(world, load, time)
            x += ax
            y += ay
    return x, y


@rare_kernel
def kick_by_loads(scene: Nonsmooth, number: int, first: int, last: int, share: float, last_share: float) -> None:
    """Add the kick of loads to bodies that gravity has kicked in substep `number` of a step.

    Bodies that were warm-started have that of the last substep once more, of which there was a share `last_share`.
    """
    h = scene.contacts.stepping[0].substep
    time = scene.world.clock[0].steps * scene.world.controls[0].step + number * h
    accelerations(scene.world, scene.contacts.states, scene.pushes, first, last, time)
    new = share * h
    old = last_share * h
    for i in range(first, last):
        state = scene.contacts.states[i]
        one = scene.pushes[i]
        if state.inverse_mass > 0.0:
            state.vx += new * one.ax - old * one.last_ax
            state.vy += new * one.ay - old * one.last_ay
            state.spin += new * one.rate - old * one.last_rate


@rare_kernel
def kick_again(contacts: Contacts, pushes: Records, first: int, last: int, share: float) -> None:
    """Add the kick of loads to bodies of clusters that were hit, whose substep begins after the last impact."""
    kick = share * contacts.stepping[0].substep
    for i in range(first, last):
        if contacts.impacts[i].is_hit and contacts.states[i].inverse_mass > 0.0:
            state = contacts.states[i]
            state.vx += kick * pushes[i].ax
            state.vy += kick * pushes[i].ay
            state.spin += kick * pushes[i].rate


@rare_kernel
def tally_loads(scene: Nonsmooth, first: int, last: int, share: float) -> None:
    """Tally what loads have brought the bodies from `first` to before `last` in a substep with that share of a kick."""
    half = 0.5 * share * scene.contacts.stepping[0].substep
    for i in range(first, last):
        state = scene.contacts.states[i]
        if state.inverse_mass > 0.0:
            body = scene.world.bodies[i]
            before = scene.contacts.before[i]
            one = scene.pushes[i]
            along = one.ax * (before.vx + state.vx) + one.ay * (before.vy + state.vy)
            turning = one.rate * (before.spin + state.spin)
            one.work += half * (body.mass * along + body.inertia * turning)


@rare_kernel
def show_velocities(scene: Nonsmooth, first: int, last: int, share: float) -> None:
    """Bring the velocities of bodies in flight up to their places, at the end of a step; `share` is of the last kick.

    As motion.place does with gravity alone.
    """
    h = scene.contacts.stepping[0].substep
    controls = scene.world.controls[0]
    for i in range(first, last):
        state = scene.contacts.states[i]
        if state.inverse_mass > 0.0:
            body = scene.world.bodies[i]
            before = scene.contacts.before[i]
            one = scene.pushes[i]
            kx = h * (controls.gravity_x + one.ax)
            ky = h * (controls.gravity_y + one.ay)
            off = abs(state.vx - before.vx - share * kx) + abs(state.vy - before.vy - share * ky)
            flies = off <= IN_FLIGHT * (abs(kx) + abs(ky))
            body.vx = state.vx + (0.5 * kx if flies else 0.0)
            body.vy = state.vy + (0.5 * ky if flies else 0.0)
            body.spin = state.spin + (0.5 * h * one.rate if flies else 0.0)
