"""The time loop between two outputs, in one compiled call."""

import math

from blocksim.kernels.arrays import AT_REST, NOT_FINITE, OVERLAP_LIMIT, PAIRS_FULL, REACHED, Record, Records, World
from blocksim.kernels.broad_phase import rebuild_pairs
from blocksim.kernels.contact import pair_forces
from blocksim.kernels.energy import has_excessive_overlap
from blocksim.kernels.history import change_contacts
from blocksim.kernels.integrate import accelerate_and_kick, kick_and_drift, kinetic_energy, renew_rotations
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.models import contact_points
from blocksim.kernels.support import book_support, is_support_at_rest, move_support


@kernel
def has_motion(controls: Record) -> bool:
    """Tell whether the support moves at all."""
    return controls.motion_x != 0.0 or controls.motion_y != 0.0


@kernel
def contact_forces(world: World, step: float) -> None:
    """Evaluate all contacts at the present positions and kick all bodies for the second half of the step.

    `step` is the length (s) of the drift that led here, zero at the start.
    """
    for p in range(world.clock[0].pair_count):
        count = contact_points(world, p)
        if count > 0:
            pair_forces(world, p, count, step)
        elif world.pairs[p].active > 0:
            change_contacts(world, p, 0, step)
    if has_motion(world.controls[0]):
        book_support(world, step)
    accelerate_and_kick(world.bodies, world.controls[0], step)


@rare_kernel
def fastest_point(bodies: Records) -> float:
    """Return an upper bound (m/s) of the speed of any point of any body; infinite when a state is not finite."""
    fastest = 0.0
    for i in range(bodies.size - 1):
        body = bodies[i]
        speed = math.sqrt(body.vx**2 + body.vy**2) + body.radius * abs(body.spin)
        if not math.isfinite(speed + body.x + body.y + body.angle):
            return math.inf
        fastest = max(fastest, speed)
    return fastest


@rare_kernel
def is_supported(bodies: Records, controls: Record) -> bool:
    """Tell whether every free body touches something, where there is gravity: at the top of its flight none rests."""
    if controls.gravity_x == 0.0 and controls.gravity_y == 0.0:
        return True
    for i in range(bodies.size - 1):
        if bodies[i].inverse_mass > 0.0 and bodies[i].pairs_before == 0:
            return False
    return True


@rare_kernel
def check(world: World) -> int:
    """Look whether the run may go on: finite, overlap below its limit, not at rest for the hold time."""
    controls = world.controls[0]
    clock = world.clock[0]
    ledger = world.ledger[0]
    renew_rotations(world.bodies)
    ledger.largest_kinetic = max(ledger.largest_kinetic, kinetic_energy(world))
    fastest = fastest_point(world.bodies)
    if math.isinf(fastest):
        return NOT_FINITE
    if has_excessive_overlap(world):
        return OVERLAP_LIMIT
    rests = fastest < controls.rest_speed and is_supported(world.bodies, controls) and is_support_at_rest(world)
    clock.checks_at_rest = clock.checks_at_rest + 1 if rests else 0
    return AT_REST if 0 < controls.rest_checks <= clock.checks_at_rest else REACHED


@rare_kernel
def advance(world: World, last_step: int) -> int:
    """Step until `last_step` or until something ends the run; return one of the status codes of arrays.py.

    The first call also evaluates the contacts at the start, as if after a step of no length; `advance(world, 0)` does
    only that. Checks fall on fixed step numbers and all flags are part of the state, so the bits of a run do not
    depend on where outputs interrupt it. PAIRS_FULL returns before anything has moved: give the lists more room and
    call again.
    """
    controls = world.controls[0]
    clock = world.clock[0]
    next_check = (clock.steps // controls.check_every + 1) * controls.check_every
    while clock.steps < last_step or clock.is_started == 0:
        if clock.pairs_due and not rebuild_pairs(world):
            return PAIRS_FULL
        step = controls.step if clock.is_started else 0.0
        clock.pairs_due = kick_and_drift(world.bodies, controls, step, world.ledger[0])
        if has_motion(controls):
            clock.pairs_due = move_support(world, step) or clock.pairs_due == 1
        contact_forces(world, step)
        clock.steps += clock.is_started
        clock.is_started = 1
        if clock.steps == next_check:
            next_check += controls.check_every
            status = check(world)
            if status != REACHED:
                return status
    return REACHED
