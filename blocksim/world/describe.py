"""Summary of a scenario before it runs: masses, pair parameters, step, cost and size of the results."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from blocksim.kernels.common.arrays import World
from blocksim.scenario import GROUND, PlacedBody, Scenario, place_bodies
from blocksim.scenario.geometry import edges_of
from blocksim.scenario.motion import motion_peaks, motion_pieces
from blocksim.scenario.placement import has_outlines
from blocksim.world.bodies import Outline, division, free_masses, outline_of
from blocksim.world.build import build_world, couple, stack_of_one
from blocksim.world.interactions import ContactClass, contact_classes, pair_of
from blocksim.world.memory import (
    PROCESS_BYTES,
    Size,
    is_shorter_than_step,
    output_count,
    recorded_contacts,
    rigid_size,
    run_bytes,
    scene_size,
)
from blocksim.world.nonsmooth import build_nonsmooth, velocity_tolerance
from blocksim.world.rigid_step import longest_step, reason_of_step
from blocksim.world.sag import inverse_mass, overlap_warning, point_stiffness, scene_sag
from blocksim.world.step import Bounds, bounds_of, safety_of, step_of_contacts
from blocksim.world.systems import largest_step, others_of, warnings_of

# measured on one core: a step costs about this for every body with its contacts
SECONDS_PER_BODY_AND_STEP = 75e-9
SECONDS_IN_A_CROWD = 250e-9  # where bodies have neighbours on all sides
PARTICLES_OF_A_CONTACT = 6  # on boundaries, for each that is recorded; measured 5 to 11
CROWD = 50  # bodies
OUTLINES_COST = 1.5  # times as much, where blocks with outlines are on springs: 1.0 to 1.7 measured
# with particles: a block, and each particle around it; in a crowd as many times that, as all its faces touch others
SECONDS_WITH_PARTICLES = {"kernel": (1.5e-6, 10e-9, 5.0), "particles": (0.7e-6, 6e-9, 2.0)}
SECONDS_IN_A_SUBSTEP = 400e-9  # a block, where contacts are rigid
RIGID_RULES = ("friction", "restitution")  # what decides where contacts are rigid
STIFFNESS_UNITS = {"linear": "N/m", "hertz-mindlin": "N/m^1.5"}


@dataclass(frozen=True)
class PairDescription:
    """Contact parameters of one kind of pair, SI, and the keys of the scenario that set them."""

    pair: str
    materials: tuple[str, str]  # without the depth that `pair` may name
    static_friction: float
    kinetic_friction: float
    transition_speed: float  # m/s
    restitution: float
    normal_damping_ratio: float | None  # None: contacts are rigid, they have no dashpots and no springs in shear
    shear_damping_ratio: float | None
    normal_stiffness: float  # of one contact point, in `stiffness_unit`; of rigid ones see world/sag.py
    stiffness_unit: str  # N/m, with the law of Hertz N/m^1.5
    shear_stiffness_ratio: float | None  # shear stiffness over (tangent) normal stiffness
    rules: Mapping[str, str]  # quantity and the key that set it, as in ResolvedPair


@dataclass(frozen=True)
class MotionDescription:
    """Acceleration, speed and displacement of the supports, SI."""

    acceleration: float  # m/s2, greatest
    displacement: float  # m, greatest
    speed: float  # m/s, greatest
    final_speed: float  # m/s


@dataclass(frozen=True)
class SagDescription:
    """Overlap of rigid contacts at rest, SI; it grows with the square of the step."""

    why: str  # of the step
    substeps: int
    tolerance: float  # m/s, of the velocity pass
    longest_step: float  # s, that may be given by hand
    sag: float  # m, of the block that sinks most, in the initial arrangement
    block: str  # its name
    overlap: float  # m, of the contact that gives way most
    warning: str  # where that is too far


@dataclass(frozen=True)
class StepLimits:
    """The longest steps of blocks and of the systems beside them, SI; the shorter one is the step of the scene."""

    blocks: float  # s
    systems: float  # s
    scale: float  # contact.stiffness_scale with which both are the same


@dataclass(frozen=True)
class Description:
    """The resolved scene, SI."""

    bodies: tuple[PlacedBody, ...]
    pairs: tuple[PairDescription, ...]
    motion: MotionDescription | None
    step: float  # s
    steps: int  # at most
    frames: int  # at most
    seconds: float  # estimated time of solving, at most
    bytes: int  # estimated size of run.h5, at most
    memory: int  # bytes of the process that runs it into a folder
    frames_at_every_step: bool  # output.every is shorter than a step
    particles: int  # on all boundaries, corners included
    skin: float  # m, distance up to which bodies are listed as neighbours
    rigid: SagDescription | None  # where contacts are rigid
    systems: Mapping[str, int]  # elements of each system beside blocks and supports
    limits: StepLimits | None  # where there are any
    warnings: tuple[str, ...]  # of results of these systems that are known to be off


def describe(scenario: Scenario) -> Description:
    """Build the scene and describe it. Raises what building it raises."""
    placed = place_bodies(scenario)
    world, size = _built(scenario, len(placed))
    step = float(world.controls[0].step)
    steps = max(1, round(scenario.time.end / step))
    frames = output_count(steps, scenario.time.end, scenario.output.every) + 1
    outline = outline_of(scenario)
    (bounds,) = bounds_of(free_masses(stack_of_one(world.bodies), [outline]), len(placed), [outline.shapes])
    particles = _particles(scenario, placed)
    touching = 0 if world.particles is None else particles // PARTICLES_OF_A_CONTACT
    contacts = recorded_contacts(len(placed), touching) if scenario.output.contacts else 0
    others = others_of(scenario)
    more = sum(one.count * one.system.cost.memory for one in others)
    of_systems = sum(one.count * one.system.cost.seconds * one.system.dearer(scenario) for one in others)
    return Description(
        bodies=placed,
        pairs=tuple(_pairs(scenario, world, placed)),
        motion=_motion(scenario),
        step=step,
        steps=steps,
        frames=frames,
        seconds=steps * (_seconds_per_step(scenario, len(placed), particles) + of_systems),
        bytes=run_bytes(len(placed), frames, contacts, others),
        memory=PROCESS_BYTES + size.bytes + more,  # without frames: into a folder, they are written as they come
        frames_at_every_step=is_shorter_than_step(scenario.output.every, step),
        particles=particles,
        skin=float(world.controls[0].skin),
        rigid=_rigid(outline, bounds, step) if scenario.time.has_rigid_contacts else None,
        systems={one.system.name: one.count for one in others},
        limits=_limits(outline, bounds) if others else None,
        warnings=tuple(warnings_of(scenario)),
    )


def _built(scenario: Scenario, count: int) -> tuple[World, Size]:
    """Build the scene of so many bodies; return the arrays that all schemes have, and its size."""
    if scenario.time.has_rigid_contacts:
        scene = build_nonsmooth(scenario)
        return scene.world, rigid_size(count, scene.contacts.constraints.size)
    world = build_world(scenario)
    if scenario.systems:
        couple(scenario, world, others_of(scenario))  # refuses pairs that are not modelled
    slots = world.candidates.shape[1]
    return world, scene_size(count, world.pairs.size, slots, has_particles=world.particles is not None)


def _seconds_per_step(scenario: Scenario, blocks: int, particles: int) -> float:
    """Return what a step costs (s) with so many blocks and particles around them."""
    is_crowd = blocks > CROWD
    if scenario.time.has_rigid_contacts:
        return blocks * SECONDS_IN_A_SUBSTEP * scenario.time.parts
    if scenario.contact.model in SECONDS_WITH_PARTICLES:
        block, particle, more = SECONDS_WITH_PARTICLES[scenario.contact.model]
        return (more if is_crowd else 1.0) * (blocks * block + particles * particle)
    rectangles = blocks * (SECONDS_IN_A_CROWD if is_crowd else SECONDS_PER_BODY_AND_STEP)
    return OUTLINES_COST * rectangles if has_outlines(scenario) else rectangles


def _limits(outline: Outline, bounds: Bounds) -> StepLimits | None:
    scenario = outline.scenario
    systems = largest_step(scenario)
    if not scenario.time.has_springs or systems == math.inf:
        return None
    blocks = step_of_contacts(scenario, bounds, outline.interactions, safety_of(scenario))
    return StepLimits(blocks, systems, scenario.contact.stiffness_scale * (blocks / systems) ** 2)


def _rigid(outline: Outline, bounds: Bounds, step: float) -> SagDescription:
    scenario, substeps = outline.scenario, outline.scenario.time.parts
    sag = scene_sag(step / substeps, outline.placed, scenario.gravity)
    return SagDescription(
        why=reason_of_step(outline, bounds).why,
        substeps=substeps,
        tolerance=velocity_tolerance(scenario, len(outline.placed)),
        longest_step=longest_step(outline, bounds),
        sag=sag.sag,
        block=sag.block,
        overlap=sag.overlap,
        warning=overlap_warning(sag.overlap, sag.crushed, bounds.smallest),
    )


def _motion(scenario: Scenario) -> MotionDescription | None:
    if scenario.motion is None:
        return None
    peaks = motion_peaks(motion_pieces(scenario), scenario.time.end)
    values = (peaks.acceleration.value, peaks.displacement.value, peaks.velocity.value)
    return MotionDescription(*values, abs(peaks.final_velocity))


def _particles(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> int:
    spacing = scenario.contact.particle_spacing
    counts = Counter(body.corners for body in placed)
    return sum(
        count * sum(division(math.dist(a, b), spacing) for a, b, _ in edges_of(corners))
        for corners, count in counts.items()
    )


def _pairs(scenario: Scenario, world: World, placed: tuple[PlacedBody, ...]) -> Iterator[PairDescription]:
    """Yield every pair of classes that can touch: blocks with the ground, with walls and with blocks."""
    classes = contact_classes(scenario, placed)
    blocks = [one.material for one in classes if not one.is_ground]
    names = [GROUND, *(_class_name(one, blocks.count(one.material)) for one in classes[1:])]
    kinds = {(body.material, body.depth, body.density, body.fixed, body.corners): body for body in placed}
    softest = {(body.material, body.depth): body for body in sorted(kinds.values(), key=inverse_mass)}
    for i, block in enumerate(classes):
        for j, other in enumerate(classes):
            if not block.is_ground and (other.is_ground or j <= i):
                pair, row = pair_of(scenario, block, other), world.interactions[i, j]
                found = PairDescription(
                    pair=f"{names[i]} - {names[j]}",
                    materials=(str(block.material), names[j] if other.is_ground else str(other.material)),
                    static_friction=float(row.static_friction),
                    kinetic_friction=float(row.kinetic_friction),
                    transition_speed=float(row.transition_speed),
                    restitution=pair.restitution,
                    normal_damping_ratio=float(row.normal_damping),
                    shear_damping_ratio=float(row.shear_damping),
                    normal_stiffness=float(row.normal_stiffness),
                    stiffness_unit=STIFFNESS_UNITS[scenario.contact.law],
                    shear_stiffness_ratio=float(row.shear_ratio),
                    rules=pair.rules,
                )
                if scenario.time.has_rigid_contacts:
                    substep = float(world.controls[0].step) / scenario.time.parts
                    touching = [softest[str(one.material), one.depth] for one in (block, other) if not one.is_ground]
                    found = _rigid_pair(found, substep, touching)
                yield found


def _rigid_pair(found: PairDescription, substep: float, touching: Sequence[PlacedBody]) -> PairDescription:
    """Return the parameters that a pair has where contacts are rigid; `touching` are its softest blocks."""
    return replace(
        found,
        normal_stiffness=point_stiffness(substep, touching),
        normal_damping_ratio=None,
        shear_damping_ratio=None,
        shear_stiffness_ratio=None,
        rules={key: rule for key, rule in found.rules.items() if key in RIGID_RULES},
    )


def _class_name(one: ContactClass, count: int) -> str:
    """Return the name of a class: the material, and the depth where blocks of one material differ in it."""
    if one.is_wall:
        return f"wall of {one.material}"
    return f"{one.material} {1e3 * one.depth:g} mm" if count > 1 else str(one.material)
