"""Build the flat arrays of a scene from a scenario."""

import math
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.arrays import (
    BODY,
    CLOCK,
    CONTROLS,
    LEDGER,
    NO_FACE,
    OPERATOR,
    PAIR,
    POINT,
    SLOT,
    SLOTS,
    Records,
    World,
    zeros,
)
from blocksim.kernels.laws import LAW_CODES
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.world.interactions import ContactClass, contact_classes, interaction_table
from blocksim.world.stable_step import ContactBody, ContactStiffness, stable_step

CHECK_INTERVAL = 1e-4  # s of simulated time between looks at rest, overlap and finiteness
SKIN_SHARE = 0.05  # of the smallest side
PAIRS_PER_BODY = 8
MOST_STEPS = 2**53  # beyond that a step number is no exact float


class StepError(InvalidInputError):
    """The time step of a scenario cannot be taken."""


class StepTooLargeError(StepError):
    """A step given by hand exceeds the admissible one and is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float) -> None:
        """Say both."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is above the largest safe step {limit:.4g} s; "
            'use step = "auto", or force_step = true to take it all the same'
        )


def build_world(scenario: Scenario) -> World:
    """Return the world at time zero: arrays as described in blocksim.kernels.arrays, pair lists still empty.

    Raises StepTooLargeError when the scenario asks for an inadmissible step without forcing it.
    """
    placed = place_bodies(scenario)
    classes = contact_classes(scenario, placed)
    table = interaction_table(scenario, classes)
    bodies = _bodies(placed, classes)
    capacity = max(16, PAIRS_PER_BODY * len(placed))
    return World(
        bodies=bodies,
        **empty_lists(capacity),
        interactions=table,
        points=zeros(SLOTS + 1, POINT),
        matrices=np.zeros((4, SLOTS, SLOTS)),
        controls=_controls(scenario, bodies, choose_step(scenario, bodies, table)),
        clock=_clock(),
        ledger=_ledger(bodies),
    )


def empty_lists(capacity: int) -> dict[str, Any]:
    """Return the pair lists of a world, without pairs, with room for `capacity` of them."""
    lists: dict[str, Any] = {
        "pairs": zeros(capacity, PAIR),
        "slots": zeros((capacity, SLOTS), SLOT),
        "candidates": np.zeros((capacity, SLOTS), dtype=np.int64),
        "operators": zeros((capacity, 2), OPERATOR),
        "spare_pairs": zeros(capacity, PAIR),
        "spare_slots": zeros((capacity, SLOTS), SLOT),
        "spare_candidates": np.zeros((capacity, SLOTS), dtype=np.int64),
    }
    lists["slots"]["face"] = lists["spare_slots"]["face"] = NO_FACE
    return lists


def with_more_room(world: World) -> World:
    """Return the same world with twice the room for candidate pairs."""
    used = world.pairs.size
    lists = empty_lists(2 * used)
    lists["pairs"][:used] = world.pairs
    lists["slots"][:used] = world.slots
    lists["candidates"][:used] = world.candidates
    lists["operators"][:used] = world.operators
    return world._replace(**lists)


def admissible_step(bodies: Records, table: Records, safety: float) -> float:
    """Return the largest safe step (s) of these bodies with these contact parameters."""
    kinds = dict.fromkeys(
        (ContactBody(2.0 * r.half_x, 2.0 * r.half_y, r.inverse_mass, r.inverse_inertia), int(r.contact_class))
        for r in bodies[:-1]
    )

    def stiffness(i: int, j: int) -> ContactStiffness:
        row = table[i, j]
        ratio = max(row.normal_damping, row.shear_damping)
        return ContactStiffness(float(row.normal_stiffness), float(row.shear_stiffness), float(ratio))

    grounded = [(body, None, stiffness(c, 0)) for body, c in kinds]
    paired = [(a, b, stiffness(ca, cb)) for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)]
    return stable_step([*grounded, *paired], safety)


class UncountableStepsError(StepError):
    """Step and end do not go together: more steps than can be counted, or none of any length."""

    def __init__(self, end: float, step: float) -> None:
        """Say both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def choose_step(scenario: Scenario, bodies: Records, table: Records) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        limit = min(admissible_step(bodies, table, scenario.time.safety), scenario.time.end)
    asked = scenario.time.step
    step = limit if asked == "auto" else asked
    if not 0.0 < step < math.inf or scenario.time.end / step > MOST_STEPS:
        raise UncountableStepsError(scenario.time.end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLargeError(step, limit)
    return step


def _bodies(placed: tuple[PlacedBody, ...], classes: tuple[ContactClass, ...]) -> Records:
    bodies = zeros(len(placed) + 1, BODY)
    bodies.cos = 1.0  # the ground's, last
    for record, body in zip(bodies, placed, strict=False):
        mass = body.density * body.size_x * body.size_y * body.depth
        inertia = mass * (body.size_x**2 + body.size_y**2) / 12.0
        record.x, record.y, record.angle = body.x, body.y, body.angle
        record.cos, record.sin = math.cos(body.angle), math.sin(body.angle)
        record.vx, record.vy, record.spin = body.vx, body.vy, body.spin
        record.half_x, record.half_y = 0.5 * body.size_x, 0.5 * body.size_y
        record.radius = 0.5 * math.hypot(body.size_x, body.size_y)
        record.mass, record.inertia = mass, inertia
        record.inverse_mass = 0.0 if body.fixed else 1.0 / mass
        record.inverse_inertia = 0.0 if body.fixed else 1.0 / inertia
        record.contact_class = classes.index(ContactClass(body.material, body.depth), 1)
    return bodies


def _clock() -> Records:
    clock = zeros(1, CLOCK)
    clock.pairs_due = 1  # there is no list yet
    return clock


def _ledger(bodies: Records) -> Records:
    ledger = zeros(1, LEDGER)
    speed_squared = bodies.vx**2 + bodies.vy**2
    ledger.largest_kinetic = 0.5 * float(np.sum(bodies.mass * speed_squared + bodies.inertia * bodies.spin**2))
    return ledger


def _controls(scenario: Scenario, bodies: Records, step: float) -> Records:
    smallest = 2.0 * float(min(bodies.half_x[:-1].min(), bodies.half_y[:-1].min()))
    given_limit = scenario.contact.max_overlap
    controls = zeros(1, CONTROLS)
    record = controls[0]
    record.step = step
    record.gravity_x = -scenario.gravity * math.sin(scenario.ground.tilt)
    record.gravity_y = -scenario.gravity * math.cos(scenario.ground.tilt)
    record.skin = SKIN_SHARE * smallest
    record.max_overlap = 0.0 if given_limit is None else given_limit
    record.rest_speed = scenario.time.rest_speed
    record.law = LAW_CODES[scenario.contact.law]
    record.check_every = min(max(1, round(CHECK_INTERVAL / step)), MOST_STEPS)
    if scenario.time.stop_at_rest:
        checks = scenario.time.rest_hold / (record.check_every * step)
        record.rest_checks = max(1, math.ceil(min(checks, MOST_STEPS)))
    return controls
