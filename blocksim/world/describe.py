"""Summary of a scenario before it runs: masses, pair parameters, step, cost and size of the results."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from blocksim.kernels.common.arrays import World
from blocksim.scenario import GROUND, Model, PlacedBody, geometry, laws, motion
from blocksim.world import build, interactions, memory, nonsmooth, rigid_step, systems
from blocksim.world.bodies import Layout, division, layout_of
from blocksim.world.sag import inverse_mass, overlap_warning, point_stiffness, scene_sag, soft_base
from blocksim.world.step import bounds_of, speeds_of, step_of_contacts

# measured on one core: a step costs about this for every body with its contacts
SECONDS_PER_BODY_AND_STEP = 75e-9
SECONDS_IN_A_CROWD = 250e-9  # where bodies have neighbours on all sides
PARTICLES_OF_A_CONTACT = 6  # on boundaries, for each that is recorded; measured 5 to 11
CROWD = 50  # bodies
OUTLINES_COST = 1.5  # times as much, where blocks with outlines are on springs: 1.0 to 1.7 measured
# with particles: a block, and each particle around it; in a crowd as many times that, as all its faces touch others
SECONDS_WITH_PARTICLES = {"kernel": (1.5e-6, 10e-9, 5.0), "particles": (0.7e-6, 6e-9, 2.0)}
RIGID_RULES = ("friction", "restitution")  # what decides where contacts are rigid


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
    stiffness_unit: str  # N/m^n, n the exponent of the law
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
    impacts: str  # contact.impacts
    free: int  # number of free blocks
    tolerance: float  # m/s, of the velocity pass
    velocity_sweeps: int  # iterations, at most
    fall: float  # m/s, that gravity adds in a substep
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
    scale: float  # contact.stiffness_scale with which both are the same,
    advised: float  # or the least one with which blocks do not sink too far into their springs


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


def describe(model: Model) -> Description:
    """Build the scene and describe it. Raises what building it raises."""
    scenario, layout, others = model.scenario, layout_of(model), systems.others_of(model)
    count, has_rigid = len(layout.placed), scenario.time.has_rigid_contacts
    if has_rigid:
        scene = nonsmooth.build_nonsmooth(model)
        world, size = scene.world, memory.rigid_size(count, scene.contacts.constraints.size)
    else:
        world = build.build_world(model)
        if scenario.systems:
            build.couple(model, world, others)  # refuses pairs that are not modelled
        slots, has_particles = world.candidates.shape[1], world.particles is not None
        size = memory.scene_size(count, world.pairs.size, slots, has_particles=has_particles)
    step = float(world.controls[0].step)
    steps = max(1, round(scenario.time.end / step))
    frames = round(min(steps, scenario.time.end / scenario.output.every)) + 1
    (bounds,) = bounds_of([layout], build.stack_of_one(world.bodies))
    speeds = speeds_of(layout, bounds)
    spacing = scenario.contact.particle_spacing
    particles = sum(
        number * sum(division(math.dist(a, b), spacing) for a, b, _ in geometry.edges_of(corners))
        for corners, number in Counter(body.corners for body in layout.placed).items()
    )
    touching = 0 if world.particles is None else particles // PARTICLES_OF_A_CONTACT
    contacts = max(memory.CONTACTS_OF_A_BODY * count, touching) if scenario.output.contacts else 0
    more = sum(one.count * one.system.cost.memory for one in others)
    of_systems = sum(one.count * one.system.cost.seconds * one.system.dearer(model) for one in others)
    warnings = [*systems.warnings_of(model)]
    limits, of_others = None, systems.largest_step(model)
    if scenario.time.has_springs and of_others < math.inf:
        of_blocks = step_of_contacts(layout, bounds, speeds)
        soft = soft_base(scenario, layout.placed, world)
        scale = scenario.contact.stiffness_scale * (of_blocks / of_others) ** 2
        limits = StepLimits(of_blocks, of_others, scale, max(scale, 0.0 if soft is None else soft.scale))
        warnings = [*warnings, soft.warning] if soft is not None and soft.warning else warnings
    rigid = None
    if has_rigid:
        reason = rigid_step.reason_of_step(layout, bounds, speeds)
        sag = scene_sag(step / scenario.time.parts, layout.placed, scenario.gravity.size)
        rigid = SagDescription(
            why=reason.text.format(*reason.numbers),
            substeps=scenario.time.parts,
            impacts=scenario.contact.impacts,
            free=bounds.free,
            tolerance=nonsmooth.velocity_tolerance(scenario, count),
            velocity_sweeps=nonsmooth.stepping_of(scenario).velocity_sweeps,
            fall=scenario.gravity.size * step / scenario.time.parts,
            longest_step=rigid_step.longest_step(layout, bounds, speeds),
            sag=sag.sag,
            block=sag.block,
            overlap=sag.overlap,
            warning=overlap_warning(sag.overlap, sag.crushed, bounds.smallest),
        )
    support = None
    if scenario.motion is not None:
        peaks = motion.motion_peaks(model.motion, scenario.time.end)
        values = (peaks.acceleration.value, peaks.displacement.value, peaks.velocity.value)
        support = MotionDescription(*values, abs(peaks.final_velocity))
    return Description(
        bodies=layout.placed,
        pairs=tuple(_pairs(layout, world)),
        motion=support,
        step=step,
        steps=steps,
        frames=frames,
        seconds=steps * (_seconds_per_step(layout, particles) + of_systems),
        bytes=memory.run_bytes(count, frames, contacts, others),
        memory=memory.PROCESS_BYTES + size.bytes + more,  # without frames: into a folder, they are written as they come
        frames_at_every_step=scenario.output.every < (1.0 - memory.ROUNDING) * step,
        particles=particles,
        skin=float(world.controls[0].skin),
        rigid=rigid,
        systems={one.system.name: one.count for one in others},
        limits=limits,
        warnings=tuple(warnings),
    )


def _seconds_per_step(layout: Layout, particles: int) -> float:
    """Return what a step costs (s) with so many particles around all blocks."""
    scenario, blocks = layout.scenario, len(layout.placed)
    is_crowd = blocks > CROWD
    if scenario.time.has_rigid_contacts:
        return blocks * 400e-9 * scenario.time.parts  # a block, where contacts are rigid
    if scenario.contact.model in SECONDS_WITH_PARTICLES:
        block, particle, more = SECONDS_WITH_PARTICLES[scenario.contact.model]
        return (more if is_crowd else 1.0) * (blocks * block + particles * particle)
    rectangles = blocks * (SECONDS_IN_A_CROWD if is_crowd else SECONDS_PER_BODY_AND_STEP)
    return OUTLINES_COST * rectangles if layout.shapes.has_polygons else rectangles


def _pairs(layout: Layout, world: World) -> Iterator[PairDescription]:
    """Yield every pair of classes that can touch: blocks with the ground, with walls and with blocks.

    Rigid contacts have no springs in shear and no dashpots; their stiffness is that of their softest blocks.
    """
    scenario, classes, placed = layout.scenario, layout.classes, layout.placed
    law = laws.LAWS[scenario.contact.law]
    has_rigid = scenario.time.has_rigid_contacts
    blocks = [one.material for one in classes if not one.is_ground]
    names = [GROUND]
    for one in classes[1:]:  # the depth is named where blocks of one material differ in it
        depth = f" {1e3 * one.depth:g} mm" if blocks.count(one.material) > 1 else ""
        names.append(f"wall of {one.material}" if one.is_wall else f"{one.material}{depth}")
    kinds = {(body.material, body.depth, body.density, body.fixed, body.corners): body for body in placed}
    ordered = sorted(kinds.values(), key=lambda body: inverse_mass(body, 0.5 * body.size_x))
    softest = {(body.material, body.depth): body for body in ordered}
    for i, block in enumerate(classes):
        for j, other in enumerate(classes):
            if not block.is_ground and (other.is_ground or j <= i):
                pair, row = interactions.pair_of(scenario, block, other), world.interactions[i, j]
                normal_stiffness, rules = float(row.normal_stiffness), pair.rules
                if has_rigid:
                    substep = float(world.controls[0].step) / scenario.time.parts
                    touching = [softest[str(one.material), one.depth] for one in (block, other) if not one.is_ground]
                    normal_stiffness = point_stiffness(substep, touching)
                    rules = {key: rule for key, rule in rules.items() if key in RIGID_RULES}
                yield PairDescription(
                    pair=f"{names[i]} - {names[j]}",
                    materials=(str(block.material), names[j] if other.is_ground else str(other.material)),
                    static_friction=float(row.static_friction),
                    kinetic_friction=float(row.kinetic_friction),
                    transition_speed=float(row.transition_speed),
                    restitution=pair.restitution,
                    normal_damping_ratio=None if has_rigid else float(row.normal_damping),
                    shear_damping_ratio=None if has_rigid else float(row.shear_damping),
                    normal_stiffness=normal_stiffness,
                    stiffness_unit="N/m" if law.is_linear else f"N/m^{law.exponent:g}",
                    shear_stiffness_ratio=None if has_rigid else float(row.shear_ratio),
                    rules=rules,
                )
