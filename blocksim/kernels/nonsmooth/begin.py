"""The start of a run: velocities half a substep before positions, or those of time zero.

Contacts are not known at the start of a run, so that velocities are those of time zero, and the first substep has half
a kick of gravity. Of a scene that has settled they are: what holds the blocks are impulses of a whole substep, which
half a kick would not balance. There velocities go back by half of what gravity, loads and these impulses do in a
substep: those of blocks at rest by nothing, that of a block that was held and is let go by half a kick. The first
substep is one like all others then.
"""

from blocksim.kernels.arrays import Record
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.loads import accelerations
from blocksim.kernels.nonsmooth.arrays import AWAY, Nonsmooth


@kernel
def is_start(scene: Nonsmooth) -> bool:
    """Return True if velocities are those of time zero, not half a substep before."""
    stepping = scene.contacts.stepping[0]
    return scene.world.clock[0].steps == 0 and stepping.parts == 0 and stepping.is_settled == 0


@rare_kernel
def load_lines(scene: Nonsmooth) -> None:
    """Bring velocities and inverse masses of all bodies into their lines: at the start of a run."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    h = stepping.substep
    for i in range(scene.world.bodies.size):
        body = scene.world.bodies[i]
        line = scene.contacts.lines[i]
        line.vx = body.vx
        line.vy = body.vy
        line.spin = body.spin
        line.inverse_mass = body.inverse_mass
        line.inverse_inertia = body.inverse_inertia
        line.dx = line.dy = line.turned = 0.0
    if stepping.is_settled and scene.world.clock[0].steps == 0:
        go_back(scene)
    for i in range(scene.world.bodies.size):
        line = scene.contacts.lines[i]
        scene.contacts.before[i].lifted = h * (controls.gravity_x * line.vx + controls.gravity_y * line.vy)


@rare_kernel
def go_back(scene: Nonsmooth) -> None:
    """Take half of what gravity, loads and the impulses of a whole substep do to velocities from them."""
    world = scene.world
    controls = world.controls[0]
    contacts = scene.contacts
    half = 0.5 * contacts.stepping[0].substep
    count = world.bodies.size - 1
    if world.loads.size > 0:
        accelerations(world, contacts.lines, scene.pushes, 0, count, 0.0)
    for i in range(count):
        line = contacts.lines[i]
        if line.inverse_mass > 0.0:
            line.vx -= half * controls.gravity_x
            line.vy -= half * controls.gravity_y
            if world.loads.size > 0:
                line.vx -= half * scene.pushes[i].ax
                line.vy -= half * scene.pushes[i].ay
                line.spin -= half * scene.pushes[i].rate
    for r in range(contacts.stepping[0].row_count):
        row = contacts.rows[r]
        if row.reach != AWAY:
            push_back(row, contacts.lines[row.a], 1.0, row.arm_a, row.shear_arm_a)
            push_back(row, contacts.lines[row.b], -1.0, row.arm_b, row.shear_arm_b)


@rare_kernel
def push_back(row: Record, line: Record, sign: float, arm: float, shear_arm: float) -> None:
    """Take half of what the impulses of a row do to a body, with their `sign` and its arms (m), from its velocity."""
    share = -0.5 * sign
    normal = row.normal_one + row.normal_two
    line.vx += share * line.inverse_mass * (row.nx * normal - row.ny * row.shear)
    line.vy += share * line.inverse_mass * (row.ny * normal + row.nx * row.shear)
    line.spin += share * line.inverse_inertia * (arm * normal - row.width * row.normal_two + shear_arm * row.shear)
