"""What happens to bodies one by one: kick and warm start, drift, poses.

Loads in the substeps: like gravity, but body by body. Without loads `kick_by_loads` and its like are not called.

A kick over a substep is that of the loads as they are when it begins, at the places then: halfway between the
velocities before and after it. What the kick brings a body is its impulse times the mean of the velocities before and
after the substep, contacts included; so their work adds up exactly, see energy.py.

Prescribed motion: of the supports (the ground, its pieces, walls, fixed bodies) and of driven bodies.

Contacts are not known at the start of a run, so that velocities are those of time zero, and the first substep has half
a kick of gravity. Of a scene that has settled they are: what holds the blocks are impulses of a whole substep, which
half a kick would not balance. There velocities go back by half of what gravity, loads and these impulses do in a
substep: those of blocks at rest by nothing, that of a block that was held and is let go by half a kick. The first
substep is one like all others then.
"""

from blocksim.kernels.common import jit, loads, shapes, supports
from blocksim.kernels.common.arrays import LOAD_FORCE, Record, Records, World
from blocksim.kernels.common.tolerances import IN_FLIGHT
from blocksim.kernels.nonsmooth import arrays, cuts


@jit.rare_kernel
def load_states(scene: arrays.Nonsmooth) -> None:
    """Bring velocities and inverse masses of all bodies into their states: at the start of a run."""
    controls = scene.world.controls[0]
    stepping = scene.contacts.stepping[0]
    h = stepping.substep
    for i in range(scene.world.bodies.size):
        body = scene.world.bodies[i]
        state = scene.contacts.states[i]
        before = scene.contacts.before[i]
        state.vx = before.vx = body.vx
        state.vy = before.vy = body.vy
        state.spin = before.spin = body.spin
        state.inverse_mass = body.inverse_mass
        state.inverse_inertia = body.inverse_inertia
        state.dx = state.dy = state.turned = 0.0
    if stepping.is_settled and scene.world.clock[0].steps == 0:
        go_back(scene)
    for i in range(scene.world.bodies.size):
        state = scene.contacts.states[i]
        scene.contacts.before[i].lifted = h * (controls.gravity_x * state.vx + controls.gravity_y * state.vy)


@jit.rare_kernel
def go_back(scene: arrays.Nonsmooth) -> None:
    """Take half of what gravity, loads and the impulses of a whole substep do to velocities from them."""
    world = scene.world
    controls = world.controls[0]
    contacts = scene.contacts
    half = 0.5 * contacts.stepping[0].substep
    count = world.bodies.size - 1
    if world.loads.size > 0:
        loads.accelerations(world, contacts.states, contacts.before, scene.pushes, 0, count, 0.0)
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
        if constraint.reach != arrays.AWAY:
            push_back(constraint, contacts.states[constraint.a], 1.0, constraint.arm_a, constraint.shear_arm_a)
            push_back(constraint, contacts.states[constraint.b], -1.0, constraint.arm_b, constraint.shear_arm_b)


@jit.rare_kernel
def push_back(constraint: Record, state: Record, sign: float, arm: float, shear_arm: float) -> None:
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


@jit.kernel
def kick(states: Records, before: Records, first: int, last: int, share: float, hx: float, hy: float) -> None:
    """Begin the first substep of free bodies from `first` to before `last`, with a share of a kick of gravity (m/s).

    What velocities are before it is kept in `before`.
    """
    for i in range(first, last):
        if states[i].inverse_mass > 0.0:
            state, then = states[i], before[i]
            then.vx = state.vx
            then.vy = state.vy
            then.spin = state.spin
            then.lifted -= state.vx * hx + state.vy * hy
            state.vx += share * hx
            state.vy += share * hy


@jit.kernel
def kick_warm(states: Records, before: Records, first: int, last: int, share: float, hx: float, hy: float) -> None:
    """Begin another substep of these bodies, with a kick of gravity (m/s) and the last impulses.

    Manifolds do not change within a step, so that all impulses of the last substep together have changed a velocity by
    what it gained beyond gravity, of which there was a `share` of a kick.
    """
    for i in range(first, last):
        if states[i].inverse_mass > 0.0:
            state, then = states[i], before[i]
            vx = state.vx
            vy = state.vy
            spin = state.spin
            then.lifted -= vx * hx + vy * hy
            state.vx += vx - (then.vx - (1.0 - share) * hx)
            state.vy += vy - (then.vy - (1.0 - share) * hy)
            state.spin += spin - then.spin
            then.vx = vx
            then.vy = vy
            then.spin = spin


@jit.kernel
def drift(states: Records, first: int, last: int, h: float) -> None:
    """Move the bodies from `first` to before `last` for h (s)."""
    for i in range(first, last):
        state = states[i]
        state.dx += h * state.vx
        state.dy += h * state.vy
        state.turned += h * state.spin


@jit.kernel
def is_in_flight(state: Record, before: Record, kx: float, ky: float) -> bool:
    """Return True if nothing but the last kick (m/s) has changed a velocity in the last substep."""
    off = abs(state.vx - before.vx - kx) + abs(state.vy - before.vy - ky)
    return off <= IN_FLIGHT * (abs(kx) + abs(ky))


@jit.kernel
def place(body: Record, state: Record, before: Record, share: float, kick: tuple[float, float, float]) -> None:
    """End a step: bring the pose of a body up to date, exactly turned, and its velocities too.

    Velocities live half a substep before positions; that of a body in flight is brought up to the positions. That of
    one in touch is left: a support holds against the half kick too. `kick` is what a substep of gravity and loads
    changes velocities by (m/s, m/s, rad/s), `share` is that of the last one.
    """
    kx, ky, turned = kick
    body.vx = state.vx
    body.vy = state.vy
    body.spin = state.spin
    if is_in_flight(state, before, share * kx, share * ky):
        body.vx += 0.5 * kx
        body.vy += 0.5 * ky
        body.spin += 0.5 * turned
    body.x += state.dx
    body.y += state.dy
    body.angle += state.turned
    body.cos, body.sin = shapes.turn(body.cos, body.sin, state.turned)
    state.dx = state.dy = state.turned = 0.0


@jit.kernel
def place_all(scene: arrays.Nonsmooth, first: int, last: int, share: float) -> None:
    """End a step of the free bodies from `first` to before `last`."""
    contacts = scene.contacts
    h = contacts.stepping[0].substep
    gx, gy = scene.world.controls[0].gravity_x, scene.world.controls[0].gravity_y
    kick = (h * gx, h * gy, 0.0)
    for i in range(first, last):
        state = contacts.states[i]
        if state.inverse_mass > 0.0:
            contacts.before[i].lifted += state.dx * gx + state.dy * gy
            if scene.pushes.size > 1:
                one = scene.pushes[i]
                kick = (h * (gx + one.ax), h * (gy + one.ay), h * one.rate)
            place(scene.world.bodies[i], state, contacts.before[i], share, kick)


@jit.rare_kernel
def pull_of_loads(world: World, time: float) -> tuple[float, float]:
    """Return the acceleration (m/s2) that loads give all free bodies at a time (s)."""
    x = 0.0
    y = 0.0
    for load in world.loads:
        if load.kind < LOAD_FORCE:
            ax, ay = loads.acceleration_at(world, load, time)
            x += ax
            y += ay
    return x, y


@jit.rare_kernel
def kick_by_loads(scene: arrays.Nonsmooth, number: int, first: int, last: int, share: float, last_share: float) -> None:
    """Add the kick of loads to bodies that gravity has kicked in substep `number` of a step.

    Bodies that were warm-started have that of the last substep once more, of which there was a share `last_share`.
    """
    h = scene.contacts.stepping[0].substep
    time = cuts.begin_of_interval(scene) + number * h
    loads.accelerations(scene.world, scene.contacts.states, scene.contacts.before, scene.pushes, first, last, time)
    new = share * h
    old = last_share * h
    for i in range(first, last):
        state = scene.contacts.states[i]
        one = scene.pushes[i]
        if state.inverse_mass > 0.0:
            state.vx += new * one.ax - old * one.last_ax
            state.vy += new * one.ay - old * one.last_ay
            state.spin += new * one.rate - old * one.last_rate


@jit.rare_kernel
def kick_again(contacts: arrays.Contacts, pushes: Records, first: int, last: int, share: float) -> None:
    """Let the substep of the bodies of groups that were hit begin after the last impact, with a share of a kick.

    It is one of gravity and, where there are any, of loads (`pushes`).
    """
    stepping = contacts.stepping[0]
    gx, gy, kick = share * stepping.fall_x, share * stepping.fall_y, share * stepping.substep
    for i in range(first, last):
        if contacts.impacts[i].is_hit:
            state = contacts.states[i]
            before = contacts.before[i]
            before.vx = state.vx
            before.vy = state.vy
            before.spin = state.spin
            state.vx += gx
            state.vy += gy
            if pushes.size > 1 and state.inverse_mass > 0.0:
                state.vx += kick * pushes[i].ax
                state.vy += kick * pushes[i].ay
                state.spin += kick * pushes[i].rate


@jit.rare_kernel
def tally_loads(scene: arrays.Nonsmooth, first: int, last: int, share: float) -> None:
    """Tally what loads have brought the bodies from `first` to before `last` in a substep with that share of a kick.

    The first of a run has half a kick, and its velocities are those of time zero: so it lacks half of that of gravity.
    """
    stepping = scene.contacts.stepping[0]
    half = 0.5 * share * stepping.substep
    lack_x, lack_y = (share - 1.0) * stepping.fall_x, (share - 1.0) * stepping.fall_y
    loads.tally_actuators(scene.world, scene.contacts.states, scene.contacts.before, first, last, half)
    for i in range(first, last):
        state = scene.contacts.states[i]
        if state.inverse_mass > 0.0:
            body = scene.world.bodies[i]
            before = scene.contacts.before[i]
            one = scene.pushes[i]
            along = one.ax * (before.vx + state.vx + lack_x) + one.ay * (before.vy + state.vy + lack_y)
            turning = one.rate * (before.spin + state.spin)
            one.work += half * (body.mass * along + body.inertia * turning)


@jit.rare_kernel
def displacement_at(world: World, time: float) -> float:
    """Return the displacement (m) of the supports at a time (s) that is not before the current step."""
    return supports.displacement(
        world.motion[supports.piece_at(world.motion, world.clock[0].motion_piece, world.motion.size, time)], time
    )


@jit.rare_kernel
def drive(scene: arrays.Nonsmooth, number: int) -> None:
    """Give supports and driven bodies their velocity in substep `number`: displacement over time."""
    world = scene.world
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    h = stepping.substep
    begin = cuts.begin_of_interval(scene) + number * h
    rate = (displacement_at(world, begin + h) - displacement_at(world, begin)) / h
    stepping.support_vx = controls.motion_x * rate
    stepping.support_vy = controls.motion_y * rate
    for one in world.moved:
        state = scene.contacts.states[one.body]
        before = scene.contacts.before[one.body]
        if supports.is_driven(one):
            way = supports.way_over(world, one, begin, h)
            state.vx = before.vx = way.x / h
            state.vy = before.vy = way.y / h
            state.spin = before.spin = way.angle / h
        else:
            state.vx = before.vx = stepping.support_vx
            state.vy = before.vy = stepping.support_vy


@jit.rare_kernel
def place_supports(scene: arrays.Nonsmooth) -> None:
    """End a step of supports and driven bodies, which is not counted yet: where they have to be, never summed up."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    now = cuts.end_of_interval(scene)
    clock.motion_piece = supports.piece_at(world.motion, clock.motion_piece, world.motion.size, now)
    moved = supports.displacement(world.motion[clock.motion_piece], now)
    stepping = scene.contacts.stepping[0]
    stepping.support_x = controls.motion_x * moved
    stepping.support_y = controls.motion_y * moved
    for one in world.moved:
        body = world.bodies[one.body]
        state = scene.contacts.states[one.body]
        if supports.is_driven(one):
            supports.follow_pieces(world, one, now)
            supports.put(body, supports.pose_at(world, one, now))
            body.spin = state.spin
        else:
            body.x = one.x + stepping.support_x
            body.y = one.y + stepping.support_y
        body.vx = state.vx
        body.vy = state.vy
        state.dx = state.dy = state.turned = 0.0
