"""Build the flat arrays of a scene from a scenario."""

import math
from typing import Any

import numpy as np

from blocksim.kernels.arrays import (
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
from blocksim.scenario import Scenario, place_bodies
from blocksim.world.bodies import body_records
from blocksim.world.interactions import contact_classes, interaction_table
from blocksim.world.motion import motion_records, support_direction
from blocksim.world.particles import place_particles, slots_of_a_pair
from blocksim.world.step import MOST_STEPS, choose_step

CHECK_INTERVAL = 1e-4  # s of simulated time between looks at rest, overlap and finiteness
SKIN_SHARE = 0.05  # of the smallest side
PAIRS_PER_BODY = 8


def build_world(scenario: Scenario) -> World:
    """Return the world at time zero: arrays as described in blocksim.kernels.arrays, pair lists still empty.

    Raises StepTooLargeError when the scenario asks for an inadmissible step without forcing it.
    """
    placed = place_bodies(scenario)
    classes = contact_classes(scenario, placed)
    table = interaction_table(scenario, classes)
    bodies = body_records(scenario, placed, classes)
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
        motion=motion_records(scenario),
        controls=_controls(scenario, bodies, len(placed), choose_step(scenario, bodies, table)),
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


def _controls(scenario: Scenario, bodies: Records, blocks: int, step: float) -> Records:
    smallest = 2.0 * float(min(bodies.half_x[:blocks].min(), bodies.half_y[:blocks].min()))
    given_limit = scenario.contact.max_overlap
    controls = zeros(1, CONTROLS)
    record = controls[0]
    record.step = step
    record.gravity_x = -scenario.gravity * math.sin(scenario.ground.tilt)
    record.gravity_y = -scenario.gravity * math.cos(scenario.ground.tilt)
    record.motion_x, record.motion_y = support_direction(scenario)
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
