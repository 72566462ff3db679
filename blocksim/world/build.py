"""Build the flat arrays of a scene from a scenario."""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.arrays import (
    ACTION,
    CLOCK,
    CONTACT,
    CONTACTS,
    CONTROLS,
    GROUP,
    LEDGER,
    OPERATOR,
    PAIR,
    PARTICLE_CONTACT,
    POINT,
    SHARE,
    TEAM_WORDS,
    Records,
    World,
    zeros,
)
from blocksim.kernels.laws import LAW_CODES
from blocksim.kernels.models import MODEL_CODES
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.world.bodies import body_records
from blocksim.world.interactions import contact_classes, interaction_table
from blocksim.world.memory import SceneSize, refuse_if_too_large
from blocksim.world.motion import motion_records, moved_records, support_direction
from blocksim.world.particles import place_particles, slots_of_a_pair
from blocksim.world.skin import choose_skin
from blocksim.world.step import MOST_STEPS, choose_step

CHECK_INTERVAL = 1e-4  # s of simulated time between looks at rest, overlap and finiteness
CHEAP_CHECKS = 50  # steps between looks, from which on they cost next to nothing; where steps are long, at most for
LONGEST_CHECK = 1e-3  # s
LEAST_PAIRS = 16
PAIRS_PER_BODY = 3
GROWTH = 1.25  # of the room for pairs, each time that it does not suffice
MOST_LARGE = 64  # bodies that are looked at one by one, outside the grid of the broad phase
LARGE_RATIO = 4.0  # over the smallest body; nothing is large below that


class Parts(NamedTuple):
    """What every scheme begins with."""

    placed: tuple[PlacedBody, ...]
    bodies: Records  # (n + 1,) BODY
    interactions: Records  # (k, k) INTERACTION


def scene_parts(scenario: Scenario) -> Parts:
    """Return bodies and interactions of a scenario; the ground's face still has the length of the block above it."""
    placed = place_bodies(scenario)
    classes = contact_classes(scenario, placed)
    return Parts(placed, body_records(scenario, placed, classes), interaction_table(scenario, classes))


def build_world(scenario: Scenario) -> World:
    """Return the world at time zero: arrays as described in blocksim.kernels.arrays, pair lists still empty.

    Raises SceneTooLargeError when there is not enough memory for it, StepTooLargeError when the scenario asks for an
    inadmissible step without forcing it, and SkinTooSmallError when the skin that it asks for could miss contacts.
    """
    parts = scene_parts(scenario)
    bodies, model = parts.bodies, scenario.contact.model
    particles = place_particles(bodies, model, scenario.contact.particle_spacing)
    capacity, slots = first_capacity(bodies), slots_of_a_pair(bodies, model)
    refuse_if_too_large(SceneSize(bodies.size, capacity, slots, has_particles=particles is not None))
    contacts = zeros(contacts_of_a_pair(slots, model), contact_type(model))
    lists = {**empty_lists(capacity, slots, contacts), "points": _points(slots), "before": contacts}
    controls = empty_controls(scenario, parts, choose_step(scenario, bodies, parts.interactions))
    controls[0].skin = choose_skin(scenario, bodies, smallest_side(parts), controls[0].step)
    controls[0].cell_width = 2.0 * controls[0].cell_radius + controls[0].skin
    return assembled(scenario, parts, controls, particles=particles, **lists)


def assembled(scenario: Scenario, parts: Parts, controls: Records, **arrays: Any) -> World:
    """Return a world at time zero from its parts and the arrays that are the scheme's own affair."""
    bodies = parts.bodies
    bodies[-1].half_x = math.inf  # the half-plane has one face without ends
    world = World(
        bodies=bodies,
        **arrays,
        **_grid(bodies),
        interactions=parts.interactions,
        ledger=zeros(bodies.size // GROUP + 1, LEDGER),
        action=zeros(1, ACTION),
        matrices=np.zeros((8, 3, 3)),
        moved=moved_records(bodies),
        motion=motion_records(scenario),
        controls=controls,
        clock=zeros(1, CLOCK),
        shares=zeros(1, SHARE),
        between=zeros(1, ACTION),
        team=np.zeros(TEAM_WORDS, dtype=np.int64),
    )
    world.ledger[0].largest_kinetic = _kinetic_energy(bodies)
    return world


def without_lists(scenario: Scenario, parts: Parts, controls: Records) -> World:
    """Return a world at time zero for a scheme that keeps pairs and contacts elsewhere."""
    contacts = zeros(1, CONTACT)
    lists = empty_lists(1, 1, contacts)
    return assembled(scenario, parts, controls, particles=None, points=_points(1), before=contacts, **lists)


def _kinetic_energy(bodies: Records) -> float:
    speed_squared = bodies.vx**2 + bodies.vy**2
    return 0.5 * float(np.sum(bodies.mass * speed_squared + bodies.inertia * bodies.spin**2))


def contact_type(model: str) -> np.dtype[np.void]:
    """Return the type of the contact records of a model."""
    return CONTACT if model == "surface" else PARTICLE_CONTACT


def contacts_of_a_pair(slots: int, model: str) -> int:
    """Return how many contacts a pair can have at the same time."""
    return CONTACTS if model == "surface" else slots


def first_capacity(bodies: Records) -> int:
    """Return the room for pairs to start with: the contacts of convex bodies in a plane are at most three a body."""
    return max(LEAST_PAIRS, PAIRS_PER_BODY * bodies.size)


def empty_lists(capacity: int, slots: int, contacts: Records) -> dict[str, Any]:
    """Return the pair lists of a world, without pairs, with room for `capacity` of them.

    Every pair has `slots` of what can come into contact, and as many contacts at the same time, of the same type, as
    `contacts` has.
    """
    kind = np.uint8 if contacts.dtype == CONTACT else np.uint32
    return {
        "pairs": zeros(capacity, PAIR),
        "contacts": zeros((capacity, contacts.size), contacts.dtype),
        "candidates": np.zeros((capacity, slots), dtype=kind),
        "operators": zeros((capacity, 2), OPERATOR),
        "spare_pairs": zeros(capacity, PAIR),
        "spare_candidates": np.zeros((capacity, slots), dtype=kind),
    }


def with_more_room(world: World) -> World:
    """Return the same world with more room for candidate pairs. Raises SceneTooLargeError."""
    used = world.pairs.size
    capacity, slots = math.ceil(GROWTH * used), world.candidates.shape[1]
    refuse_if_too_large(SceneSize(world.bodies.size, capacity, slots, has_particles=world.particles is not None))
    lists = empty_lists(capacity, slots, world.before)
    for name in ("pairs", "contacts", "candidates", "operators"):
        lists[name][:used] = getattr(world, name)
    return with_threads(world._replace(**lists), world.shares.size)


def with_threads(world: World, threads: int) -> World:
    """Return the same world with room for what that many threads tell one another."""
    between = world.pairs.size if threads > 1 else 1  # memory that nobody has written to is not there yet
    return world._replace(shares=zeros(threads, SHARE), between=zeros(between, ACTION))


def _grid(bodies: Records) -> dict[str, Any]:
    """Return the work space of the broad phase."""
    blocks = bodies.size - 1
    heads = 1 << max(4, (2 * blocks - 1).bit_length())
    large = np.flatnonzero(bodies.radius[:-1] > cell_radius(bodies))
    return {
        "heads": np.zeros(heads, dtype=np.uint32),
        "links": np.zeros(blocks, dtype=np.uint32),
        "large": large.astype(np.uint32),
        "neighbours": np.zeros(blocks, dtype=np.uint32),
    }


def cell_radius(bodies: Records) -> float:
    """Return the half diagonal (m) of the largest body in the grid: of all but a few pieces of ground and planks."""
    radii = np.sort(bodies.radius[:-1])
    few = min(MOST_LARGE, radii.size // 8)
    smaller = radii[radii <= LARGE_RATIO * radii[0]]
    return float(max(radii[-1 - few], smaller[-1]))


def _points(slots: int) -> Records:
    points = zeros(slots + 1, POINT)
    points.share = 1.0  # as it stays in the surface model
    return points


def smallest_side(parts: Parts) -> float:
    """Return the smallest side (m) of all blocks."""
    bodies, blocks = parts.bodies, len(parts.placed)
    return 2.0 * float(min(bodies.half_x[:blocks].min(), bodies.half_y[:blocks].min()))


def empty_controls(scenario: Scenario, parts: Parts, step: float) -> Records:
    """Return the controls of a run with steps of this length (s), but for skin and width of a cell."""
    given_limit = scenario.contact.max_overlap
    controls = zeros(1, CONTROLS)
    record = controls[0]
    record.step = step
    record.gravity_x = -scenario.gravity * math.sin(scenario.ground.tilt)
    record.gravity_y = -scenario.gravity * math.cos(scenario.ground.tilt)
    record.motion_x, record.motion_y = support_direction(scenario)
    record.cell_radius = cell_radius(parts.bodies)
    record.max_overlap = 0.0 if given_limit is None else given_limit
    record.rest_speed = scenario.time.rest_speed
    record.model = MODEL_CODES[scenario.contact.model]
    record.law = LAW_CODES[scenario.contact.law]
    record.sph_kernel = KERNEL_CODES[scenario.contact.kernel]
    record.particle_size = scenario.contact.particle_spacing
    record.smoothing_length = scenario.contact.resolved_smoothing_length
    record.support = support_radius(record.sph_kernel, record.smoothing_length)
    few = min(CHEAP_CHECKS, round(LONGEST_CHECK / step))
    record.check_every = min(max(1, few, round(CHECK_INTERVAL / step)), MOST_STEPS)
    if scenario.time.stop_at_rest:
        checks = scenario.time.rest_hold / (record.check_every * step)
        record.rest_checks = max(1, math.ceil(min(checks, MOST_STEPS)))
    return controls
