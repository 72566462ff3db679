"""Build the flat arrays of a scene from a scenario."""

import math
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.arrays import (
    ALL,
    BODY,
    CLOCK,
    CONTROLS,
    LEDGER,
    NO_FACE,
    OPERATOR,
    PAIR,
    POINT,
    SLOT,
    Records,
    World,
    zeros,
)
from blocksim.kernels.laws import LAW_CODES
from blocksim.kernels.models import MODEL_CODES
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.world.interactions import ContactClass, contact_classes, interaction_table
from blocksim.world.particles import place_particles, slots_of_a_pair
from blocksim.world.stable_step import ContactBody, ContactStiffness, Load, stable_step, steepest

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
    particles = place_particles(bodies, scenario.contact.model, scenario.contact.particle_spacing)
    slots = slots_of_a_pair(bodies, scenario.contact.model)
    capacity = max(16, PAIRS_PER_BODY * len(placed))
    return World(
        bodies=bodies,
        **empty_lists(capacity, slots),
        interactions=table,
        particles=particles,
        points=_points(slots),
        matrices=np.zeros((8, 3, 3)),
        controls=_controls(scenario, bodies, choose_step(scenario, bodies, table)),
        clock=_clock(),
        ledger=_ledger(bodies),
    )


def empty_lists(capacity: int, slots: int) -> dict[str, Any]:
    """Return the pair lists of a world, without pairs, with room for `capacity` of them with `slots` contacts each."""
    lists: dict[str, Any] = {
        "pairs": zeros(capacity, PAIR),
        "slots": zeros((capacity, slots), SLOT),
        "candidates": np.zeros((capacity, slots), dtype=np.int64),
        "operators": zeros((capacity, 2), OPERATOR),
        "spare_pairs": zeros(capacity, PAIR),
        "spare_slots": zeros((capacity, slots), SLOT),
        "spare_candidates": np.zeros((capacity, slots), dtype=np.int64),
    }
    lists["slots"]["face"] = lists["spare_slots"]["face"] = NO_FACE
    return lists


def with_more_room(world: World) -> World:
    """Return the same world with twice the room for candidate pairs."""
    used = world.pairs.size
    lists = empty_lists(2 * used, world.slots.shape[1])
    lists["pairs"][:used] = world.pairs
    lists["slots"][:used] = world.slots
    lists["candidates"][:used] = world.candidates
    lists["operators"][:used] = world.operators
    return world._replace(**lists)


def admissible_step(bodies: Records, table: Records, safety: float, law: str, load: Load) -> float:
    """Return the largest safe step (s) of these bodies with these contact parameters."""
    kinds = dict.fromkeys(
        (ContactBody(2.0 * r.half_x, 2.0 * r.half_y, r.inverse_mass, r.inverse_inertia), int(r.contact_class))
        for r in bodies[:-1]
    )

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i, j]
        ratio = max(row.normal_damping, row.shear_damping)
        normal = steepest(law, float(row.normal_stiffness), inverse_mass, load)
        return ContactStiffness(normal, normal * float(row.shear_ratio), float(ratio))

    grounded = [(body, None, stiffness(c, 0, body.inverse_mass)) for body, c in kinds]
    paired = [
        (a, b, stiffness(ca, cb, a.inverse_mass + b.inverse_mass))
        for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)
    ]
    return stable_step([*grounded, *paired], safety)


def expected_load(scenario: Scenario, bodies: Records) -> Load:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    blocks: Records = bodies[:-1].view(np.recarray)
    tops = blocks.y + blocks.radius
    height = max(0.0, float(tops.max()) - float(np.min(blocks.y - blocks.radius, initial=0.0)))
    start = float(np.max(np.hypot(blocks.vx, blocks.vy) + blocks.radius * np.abs(blocks.spin)))
    down = scenario.gravity * math.cos(scenario.ground.tilt)
    along = scenario.gravity * abs(math.sin(scenario.ground.tilt))
    speed = start + math.sqrt(2.0 * down * height) + along * scenario.time.end
    return Load(speed, scenario.gravity * float(np.sum(blocks.mass[blocks.inverse_mass > 0.0])))


class UncountableStepsError(StepError):
    """Step and end do not go together: more steps than can be counted, or none of any length."""

    def __init__(self, end: float, step: float) -> None:
        """Say both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def choose_step(scenario: Scenario, bodies: Records, table: Records) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        load = expected_load(scenario, bodies)
        limit = admissible_step(bodies, table, scenario.time.safety, scenario.contact.law, load)
    limit = min(limit, scenario.time.end)
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
    bodies.faces = bodies.corners = ALL
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


def _points(slots: int) -> Records:
    points = zeros(slots + 1, POINT)
    points.share = 1.0  # as it stays in the surface model
    return points


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
    record.model = MODEL_CODES[scenario.contact.model]
    record.law = LAW_CODES[scenario.contact.law]
    record.sph_kernel = KERNEL_CODES[scenario.contact.kernel]
    record.particle_size = scenario.contact.particle_spacing
    record.smoothing_length = scenario.contact.resolved_smoothing_length
    record.support = support_radius(record.sph_kernel, record.smoothing_length)
    record.check_every = min(max(1, round(CHECK_INTERVAL / step)), MOST_STEPS)
    if scenario.time.stop_at_rest:
        checks = scenario.time.rest_hold / (record.check_every * step)
        record.rest_checks = max(1, math.ceil(min(checks, MOST_STEPS)))
    return controls
