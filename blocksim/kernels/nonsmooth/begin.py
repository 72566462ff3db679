"""The start of a run: velocities half a substep before positions, or those of time zero.

Contacts are not known at the start of a run, so that velocities are those of time zero, and the first substep has half
a kick of gravity. Of a scene that has settled they are: what holds the blocks are impulses of a whole substep, which
half a kick would not balance. There velocities go back by half of what gravity, loads and these impulses do in a
substep: those of blocks at rest by nothing, that of a block that was held and is let go by half a kick. The first
substep is one like all others then.
"""

from blocksim.kernels.common import arrays, jit, loads
from blocksim.kernels.nonsmooth.arrays import AWAY, Nonsmooth


@jit.kernel
def is_start(scene: Nonsmooth) -> bool:
    """Return True if velocities are those of time zero, not half a substep before."""
    stepping = scene.contacts.stepping[0]
    return scene.world.clock[0].steps == 0 and stepping.cuts == 0 and stepping.is_settled == 0


@jit.rare_kernel
def load_states(scene: Nonsmooth) -> None:
    """Bring velocities and inverse masses of all bodies into their states: at the start of a run."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    h = stepping.substep
    for i in range(scene.world.bodies.size):
        body = scene.world.bodies[i]
        state = scene.contacts.states[i]
        state.vx = body.vx
        state.vy = body.vy
        state.spin = body.spin
        state.inverse_mass = body.inverse_mass
        state.inverse_inertia = body.inverse_inertia
        state.dx = state.dy = state.turned = 0.0
    if stepping.is_settled and scene.world.clock[0].steps == 0:
        go_back(scene)
    for i in range(scene.world.bodies.size):
        state = scene.contacts.states[i]
        scene.contacts.before[i].lifted = h * (controls.gravity_x * state.vx + controls.gravity_y * state.vy)


@jit.rare_kernel
def go_back(scene: Nonsmooth) -> None:
    """Take half of what gravity, loads and the impulses of a whole substep do to velocities from them."""
    world = scene.world
    controls = world.controls[0]
    contacts = scene.contacts
    half = 0.5 * contacts.stepping[0].substep
    count = world.bodies.size - 1
    if world.loads.size > 0:
        loads.accelerations(world, contacts.states, scene.pushes, 0, count, 0.0)
    for i in range(count):
        state = contacts.states[i]
        if state.inverse_mass > 0.0:
            state.vx -= half * controls.gravity_x
            state.vy -= half * controls.gravity_y
            if world.loads.size > 0:
                state.vx -= half * scene.pushes[i].ax
                state.vy -= half * scene.pushes[i].ay
                state.spin -= half * scene.pushes[i].rate
    for r in range(contacts.stepping[0].constraint_count):
        constraint = contacts.constraints[r]
        if constraint.reach != AWAY:
            push_back(constraint, contacts.states[constraint.a], 1.0, constraint.arm_a, constraint.shear_arm_a)
            push_back(constraint, contacts.states[constraint.b], -1.0, constraint.arm_b, constraint.shear_arm_b)


@jit.rare_kernel
def push_back(constraint: arrays.Record, state: arrays.Record, sign: float, arm: float, shear_arm: float) -> None:
    """Take half of what the impulses of a constraint do to a body, with its arms (m), from its velocity."""
    share = -0.5 * sign
    normal = constraint.normal_one + constraint.normal_two
    state.vx += share * state.inverse_mass * (constraint.nx * normal - constraint.ny * constraint.shear)
    state.vy += share * state.inverse_mass * (constraint.ny * normal + constraint.nx * constraint.shear)
    state.spin += (
        share
        * state.inverse_inertia
        * (arm * normal - constraint.width * constraint.normal_two + shear_arm * constraint.shear)
    )
