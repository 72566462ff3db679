"""Energy ledger of the non-smooth scheme, and the checks that end a run.

Impulses are tallied when they are final: what those along the normals take is lost in impacts, those along the tangents
in friction. A drift moves bodies by velocities that have the position pass in them, which are gone afterwards: what the
weights work on that way is the correction, negative where the pass lifts bodies. The sum is exact to round-off: with x
at t and v at t - h/2, K(v + h g/2) + V(x) changes in a substep by  J ((v1 + v2)/2 - h g/2) + h g (J - J_p), where the
impulses J lead from v1 to v2 and those of the position pass, J_p, from v1 to the velocity of the drift.

Loads that kick by h a add their impulse m h a times the mean of the velocities before and after the substep, exactly:
from (J + m h (g + a)) times that mean, the change of K(v). So their work needs no place, nor the position pass.
"""

import math

from blocksim.kernels.common import arrays, jit, loads, mechanics, supports
from blocksim.kernels.common.tolerances import MIDDLE
from blocksim.kernels.nonsmooth.arrays import AWAY, TOUCHING, Nonsmooth
from blocksim.kernels.nonsmooth.cuts import is_start

NONSMOOTH_LEDGER = ("kinetic", "potential", "impacts", "friction", "correction", "to_support", "to_loads", "events")


@jit.rare_kernel
def correction(scene: Nonsmooth) -> float:
    """Return the work (J) of the weights on the displacements of the position passes.

    With it goes what the velocities that are shown, `bodies`, have less than those half a kick after the last substep.
    """
    controls = scene.world.controls[0]
    h = scene.contacts.stepping[0].substep
    hx = h * controls.gravity_x
    hy = h * controls.gravity_y
    half = 0.0 if is_start(scene) else 0.5
    total = 0.0
    for i in range(scene.world.bodies.size - 1):
        body = scene.world.bodies[i]
        state = scene.contacts.states[i]
        if body.inverse_mass > 0.0:
            vx = state.vx + half * hx
            vy = state.vy + half * hy
            total += body.mass * (scene.contacts.before[i].lifted - state.vx * hx - state.vy * hy)
            if not is_shown_by_loads(scene, i):
                total += 0.5 * body.mass * (vx * vx - body.vx * body.vx + vy * vy - body.vy * body.vy)
    return total


@jit.rare_kernel
def is_shown_by_loads(scene: Nonsmooth, i: int) -> bool:
    """Return True if the velocity shown of a body has half a kick of loads beyond that after the last substep."""
    if scene.pushes.size == 1 or is_start(scene):
        return False
    body = scene.world.bodies[i]
    state = scene.contacts.states[i]
    return body.vx != state.vx or body.vy != state.vy or body.spin != state.spin


@jit.rare_kernel
def given_to_loads(scene: Nonsmooth) -> float:
    """Return the work (J) done on loads, against that which they do.

    With it goes what velocities that are shown have of the half kick to come.
    """
    h = scene.contacts.stepping[0].substep
    controls = scene.world.controls[0]
    total = 0.0
    for i in range(scene.world.bodies.size - 1 if scene.pushes.size > 1 else 0):
        total -= scene.pushes[i].work
        if is_shown_by_loads(scene, i):
            body = scene.world.bodies[i]
            state = scene.contacts.states[i]
            vx = state.vx + 0.5 * h * controls.gravity_x
            vy = state.vy + 0.5 * h * controls.gravity_y
            total -= 0.5 * body.mass * (body.vx * body.vx - vx * vx + body.vy * body.vy - vy * vy)
            total -= 0.5 * body.inertia * (body.spin * body.spin - state.spin * state.spin)
    return total


@jit.rare_kernel
def contact_points(scene: Nonsmooth) -> tuple[int, float]:
    """Return how many points press, and the largest overlap (m), of the last substep and of the start of the step."""
    count = 0
    largest = 0.0
    for r in range(scene.contacts.stepping[0].constraint_count):
        constraint = scene.contacts.constraints[r]
        if constraint.reach != AWAY:
            count += (1 if constraint.normal_one > 0.0 else 0) + (1 if constraint.normal_two > 0.0 else 0)
            largest = max(largest, -constraint.gap_one, -constraint.gap_two)
    return count, largest


@jit.rare_kernel
def has_excessive_overlap(scene: Nonsmooth) -> bool:
    """Return True if an overlap exceeds the limit given, or a share of the smallest side of its pair."""
    given = scene.world.controls[0].max_overlap
    bodies = scene.world.bodies
    for r in range(scene.contacts.stepping[0].constraint_count):
        constraint = scene.contacts.constraints[r]
        overlap = max(-constraint.gap_one, -constraint.gap_two)
        if constraint.reach == TOUCHING and overlap > 0.0:
            side = min(bodies[constraint.a].least_width, bodies[constraint.b].least_width)
            if overlap > (given if given > 0.0 else MIDDLE * side):
                return True
    return False


@jit.kernel
def check(scene: Nonsmooth) -> int:
    """Check that the run may continue: finite, not at rest for the hold time."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    mechanics.renew_angles(world.bodies)
    ledger = world.ledger[0]
    ledger.travel_work += controls.check_every * controls.step * mechanics.weights_power(world)
    ledger.largest_kinetic = max(ledger.largest_kinetic, mechanics.kinetic_energy(world))
    fastest = mechanics.fastest_point(world.bodies)
    if math.isinf(fastest):
        return arrays.NOT_FINITE
    if has_excessive_overlap(scene):
        return arrays.OVERLAP_LIMIT
    rests = fastest < controls.rest_speed and is_supported(scene) and supports.is_support_at_rest(world)
    rests = rests and loads.are_loads_steady(world)
    clock.checks_at_rest = clock.checks_at_rest + 1 if rests else 0
    return arrays.AT_REST if 0 < controls.rest_checks <= clock.checks_at_rest else arrays.REACHED


@jit.kernel
def is_supported(scene: Nonsmooth) -> bool:
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


@jit.entry_kernel
def measure_nonsmooth(scene: Nonsmooth, row: arrays.Floats) -> None:
    """Write one row of the ledger: energies (J) as in `NONSMOOTH_LEDGER`, contacts, largest overlap (m)."""
    row[0] = mechanics.kinetic_energy(scene.world)
    row[1] = mechanics.potential_energy(scene.world)
    row[2] = row[3] = row[5] = 0.0
    for tally in scene.contacts.tallies:
        row[2] += tally.impacts
        row[3] += tally.friction
        row[5] += tally.to_support
    row[4] = correction(scene)
    row[6] = given_to_loads(scene)
    row[7] = scene.world.ledger[0].events
    row[8], row[9] = contact_points(scene)
