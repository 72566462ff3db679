"""Build the flat arrays of a scene from a scenario."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import (
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
from blocksim.kernels.explicit.broad_phase import TRAVELLED
from blocksim.kernels.explicit.laws import LAW_CODES
from blocksim.kernels.explicit.models import MODEL_CODES
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_direction
from blocksim.world.applied import stacked
from blocksim.world.bodies import Outline, all_moved_records
from blocksim.world.bounds import Bounds
from blocksim.world.interactions import interaction_tables
from blocksim.world.memory import Size, refuse_if_too_large, scene_size
from blocksim.world.scenes import Construction, Parts, Stride, build_one, joined
from blocksim.world.step import MOST_STEPS, choose_approach, choose_skin, choose_step

CHECK_INTERVAL = 1e-4  # s of simulated time between checks of rest, overlap and finiteness
CHEAP_CHECKS = 50  # steps between checks, from which on they cost almost nothing; where steps are long, at most for
LONGEST_CHECK = 1e-3  # s
LEAST_PAIRS = 16
PAIRS_PER_BODY = 3
GROWTH = 1.25  # of the room for pairs, each time that it does not suffice


def build_world(scenario: Scenario) -> World:
    """Return the world at time zero: arrays as described in blocksim.kernels.common.arrays, pair lists still empty.

    Raises SceneTooLargeError when there is not enough memory for it, StepTooLargeError when the scenario asks for an
    inadmissible step without forcing it, and SkinTooSmallError when the skin that it asks for could miss contacts.
    """
    world: World = build_one(scenario, EXPLICIT).scene
    return world


def _choose(outline: Outline, bounds: Bounds) -> Stride:
    step = choose_step(outline.scenario, bounds, outline.interactions)
    skin = choose_skin(outline.scenario, bounds, outline.interactions, step)
    return Stride(step, skin, choose_approach(outline.scenario, bounds, outline.interactions, step))


def _size(parts: Parts) -> Size:
    bodies = parts.bodies.shape[1]
    return scene_size(bodies, first_capacity(bodies), parts.slots, has_particles=parts.particles is not None)


def _assemble(parts: Parts, strides: Sequence[Stride]) -> World:
    members, bodies = parts.bodies.shape
    if _model(parts.outlines[0]) == "surface":
        before = zeros((members, CONTACTS), CONTACT)
    else:
        before = zeros((members, parts.slots), PARTICLE_CONTACT)
    controls = empty_controls(parts, strides)
    reach = np.maximum(controls["skin"], TRAVELLED * controls["skin"] + controls["approach"])
    controls["cell_width"] = 2.0 * controls["cell_radius"] + reach
    lists = empty_lists(first_capacity(bodies), parts.slots, before)
    return assembled(parts, controls, points=_points(members, parts.slots), before=before, **lists)


def _model(outline: Outline) -> str:
    return outline.scenario.contact.model


EXPLICIT = Construction(_choose, _model, _size, _assemble)


def assembled(parts: Parts, controls: Records, **arrays: Any) -> World:
    """Return stacked worlds at time zero from their parts and the scheme's own arrays."""
    members, count = parts.bodies.shape
    bodies = parts.bodies
    bodies["half_x"][:, -1] = math.inf  # the half-plane has one face without ends
    loads, load_pieces = stacked([outline.applied for outline in parts.outlines])
    tables = [one.shapes.table for one in parts.outlines if one.shapes is not None]  # none where all are rectangles
    world = World(
        bodies=bodies,
        **arrays,
        particles=parts.particles,
        corners=joined(tables) if tables else None,
        **_grid(parts),
        interactions=interaction_tables([outline.interactions for outline in parts.outlines]),
        ledger=zeros((members, count // GROUP + 1), LEDGER),
        action=zeros((members, 1), ACTION),
        matrices=numbers((members, 8, 3, 3), np.float64),
        moved=all_moved_records(bodies, parts.outlines),
        motion=joined([outline.motion for outline in parts.outlines]),
        controls=controls,
        clock=zeros((members, 1), CLOCK),
        shares=zeros((members, 1), SHARE),
        between=zeros((members, 1), ACTION),
        team=numbers((members, TEAM_WORDS), np.int64),
        loads=loads,
        load_pieces=load_pieces,
    )
    world.clock["motion_piece"][:, 0] = parts.outlines[0].drives.paths.size
    world.controls["driven"][:, 0] = parts.outlines[0].drives.driven.size
    speed_squared = bodies["vx"] ** 2 + bodies["vy"] ** 2
    energies = bodies["mass"] * speed_squared + bodies["inertia"] * bodies["spin"] ** 2
    # one by one, as the order of a sum affects its last digit
    world.ledger["largest_kinetic"][:, 0] = [0.5 * float(np.sum(one)) for one in energies]
    return world


def without_lists(parts: Parts, controls: Records) -> World:
    """Return stacked worlds at time zero for a scheme that keeps pairs and contacts elsewhere."""
    members = len(parts.outlines)
    before = zeros((members, 1), CONTACT)
    lists = empty_lists(1, 1, before)
    return assembled(parts, controls, points=_points(members, 1), before=before, **lists)


def numbers(shape: tuple[int, ...], kind: type[np.generic]) -> Any:
    """Return zeros that start on a cache line."""
    plain: Any = np.dtype(kind)
    return zeros(shape, plain).view(np.ndarray)


def first_capacity(bodies: int) -> int:
    """Return the room for pairs to start with: the contacts of convex bodies in a plane are at most three a body."""
    return max(LEAST_PAIRS, PAIRS_PER_BODY * bodies)


def empty_lists(capacity: int, slots: int, contacts: Records) -> dict[str, Any]:
    """Return the pair lists of a world, or of a stack of them, without pairs, with room for `capacity` of them.

    Every pair has `slots` of what can come into contact, and as many contacts at the same time, of the same type, as
    `contacts` (..., c) has.
    """
    *members, most = contacts.shape
    pairs = (*members, capacity)
    kind = np.uint8 if contacts.dtype == CONTACT else np.uint32
    return {
        "pairs": zeros(pairs, PAIR),
        "contacts": zeros((*pairs, most), contacts.dtype),
        "candidates": numbers((*pairs, slots), kind),
        "operators": zeros((*pairs, 2), OPERATOR),
        "spare_pairs": zeros(pairs, PAIR),
        "spare_candidates": numbers((*pairs, slots), kind),
    }


def with_more_room(world: World) -> World:
    """Return the same world with more room for candidate pairs. Raises SceneTooLargeError."""
    used = world.pairs.size
    capacity, slots = math.ceil(GROWTH * used), world.candidates.shape[1]
    refuse_if_too_large(scene_size(world.bodies.size, capacity, slots, has_particles=world.particles is not None))
    lists = empty_lists(capacity, slots, world.before)
    for name in ("pairs", "contacts", "candidates", "operators"):
        lists[name][:used] = getattr(world, name)
    return with_threads(world._replace(**lists), world.shares.size)


def with_threads(world: World, threads: int) -> World:
    """Return the same world with room for the exchange between that many threads."""
    between = world.pairs.size if threads > 1 else 1  # memory that was never written is not allocated yet
    return world._replace(shares=zeros(threads, SHARE), between=zeros(between, ACTION))


def _grid(parts: Parts) -> dict[str, Any]:
    """Return the work space of the broad phase."""
    members, blocks = parts.is_large.shape
    large = np.nonzero(parts.is_large)[1].reshape(members, -1)
    kept = numbers(large.shape, np.uint32)
    kept[...] = large
    return {
        "heads": numbers((members, 1 << max(4, (2 * blocks - 1).bit_length())), np.uint32),
        "links": numbers((members, blocks), np.uint32),
        "large": kept,
        "neighbours": numbers((members, blocks), np.uint32),
    }


def _points(members: int, slots: int) -> Records:
    points = zeros((members, slots + 1), POINT)
    points["share"] = 1.0  # as it stays in the surface model
    return points


def empty_controls(parts: Parts, strides: Sequence[Stride]) -> Records:
    """Return the controls (m, 1) of runs, but for the width of a cell."""
    controls = zeros((len(strides), 1), CONTROLS)
    rows = [_controls(outline.scenario, one) for outline, one in zip(parts.outlines, strides, strict=True)]
    for name in rows[0]:
        controls[name][:, 0] = [row[name] for row in rows]
    controls["cell_radius"][:, 0] = parts.cell_radius
    controls["push"][:, 0] = [outline.applied.push for outline in parts.outlines]
    controls["loads_end"][:, 0] = [outline.applied.end for outline in parts.outlines]
    return controls


def _controls(scenario: Scenario, stride: Stride) -> dict[str, float]:
    contact, time, (step, skin, approach) = scenario.contact, scenario.time, stride
    motion_x, motion_y = (0.0, 0.0) if scenario.motion is None else motion_direction(scenario)
    kernel = KERNEL_CODES[contact.kernel]
    smoothing_length = contact.resolved_smoothing_length
    few = round(min(CHEAP_CHECKS, LONGEST_CHECK / step))  # of a quotient that may be infinite
    every = max(1, few, round(min(MOST_STEPS, CHECK_INTERVAL / step)))
    rest_checks = max(1, math.ceil(min(time.rest_hold / (every * step), MOST_STEPS))) if time.stop_at_rest else 0
    return {
        "step": step,
        "skin": skin,
        "approach": approach,
        "gravity_x": -scenario.gravity * math.sin(scenario.ground.tilt),
        "gravity_y": -scenario.gravity * math.cos(scenario.ground.tilt),
        "motion_x": motion_x,
        "motion_y": motion_y,
        "max_overlap": 0.0 if contact.max_overlap is None else contact.max_overlap,
        "rest_speed": time.rest_speed,
        "model": MODEL_CODES[contact.model],
        "law": LAW_CODES[contact.law],
        "sph_kernel": kernel,
        "particle_size": contact.particle_spacing,
        "smoothing_length": smoothing_length,
        "support": support_radius(kernel, smoothing_length),
        "check_every": every,
        "rest_checks": rest_checks,
    }
