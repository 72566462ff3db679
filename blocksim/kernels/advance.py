"""The time loop between two outputs, in one compiled call."""

import math

from blocksim.kernels.arrays import (
    AT_REST,
    GROUP,
    NOT_FINITE,
    OVERLAP_LIMIT,
    PAIRS_FULL,
    REACHED,
    Record,
    Records,
    World,
)
from blocksim.kernels.contact import pair_forces
from blocksim.kernels.energy import has_excessive_overlap, weights_power
from blocksim.kernels.integrate import (
    accelerate_and_kick,
    go_on,
    kick_and_drift,
    kinetic_energy,
    place_all_corners,
    renew_rotations,
)
from blocksim.kernels.jit import entry_kernel, kernel, rare_kernel
from blocksim.kernels.steady import steady_forces
from blocksim.kernels.support import book_support, is_support_at_rest, move_support
from blocksim.kernels.travel import look


@kernel
def has_motion(controls: Record) -> bool:
    """Tell whether the support moves at all."""
    return controls.motion_x != 0.0 or controls.motion_y != 0.0


@kernel
def group_forces(world: World, first: int, last: int, step: float, book: Record) -> None:
    """Evaluate the contacts of the pairs from `first` to before `last`; what they lose goes into one book."""
    dashpot = 0.0
    friction = 0.0
    for p in range(first, last):
        is_steady, lost, rubbed = steady_forces(world, p, step, world.particles)
        dashpot += lost
        friction += rubbed
        if not is_steady:
            pair_forces(world, p, step, book)
    book.dashpot += dashpot
    book.friction += friction


@kernel
def contact_forces(world: World, step: float) -> None:
    """Evaluate all contacts at the present positions.

    `step` is the length (s) of the drift that led here, zero at the start.
    """
    count = world.clock[0].pair_count
    for first in range(0, count, GROUP):
        group_forces(world, first, min(first + GROUP, count), step, world.ledger[first // GROUP])
    if has_motion(world.controls[0]):
        book_support(world, step)


@kernel
def begin_step(world: World, step: float) -> None:
    """Bring everything to the end of the drift."""
    kick_and_drift(world.bodies, step)
    if has_motion(world.controls[0]):
        move_support(world, step)


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
    ledger.travel_work += controls.check_every * controls.step * weights_power(world)
    ledger.largest_kinetic = max(ledger.largest_kinetic, kinetic_energy(world))
    fastest = fastest_point(world.bodies)
    if math.isinf(fastest):
        return NOT_FINITE
    if has_excessive_overlap(world):
        return OVERLAP_LIMIT
    rests = fastest < controls.rest_speed and is_supported(world.bodies, controls) and is_support_at_rest(world)
    clock.checks_at_rest = clock.checks_at_rest + 1 if rests else 0
    return AT_REST if 0 < controls.rest_checks <= clock.checks_at_rest else REACHED


@entry_kernel
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
    if clock.is_started == 0:
        place_all_corners(world.bodies)
    has_begun = False
    while clock.steps < last_step or clock.is_started == 0:
        step = controls.step if clock.is_started else 0.0
        if not has_begun:
            if clock.steps >= clock.next_look and not look(world):
                return PAIRS_FULL
            begin_step(world, step)
        contact_forces(world, step)
        clock.steps += clock.is_started
        has_begun = clock.is_started and clock.steps < min(last_step, next_check, clock.next_look)
        clock.is_started = 1
        if has_begun and not has_motion(controls):
            go_on(world.bodies, controls, step)
            continue
        has_begun = False
        accelerate_and_kick(world.bodies, controls, step)
        if clock.steps == next_check:
            next_check += controls.check_every
            status = check(world)
            if status != REACHED:
                return status
    return REACHED
