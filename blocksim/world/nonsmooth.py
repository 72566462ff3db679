"""Build the arrays of the non-smooth scheme from a scenario, in addition to the world that both schemes share."""

import math
from collections.abc import Sequence

import numpy as np

from blocksim.kernels.common.arrays import CACHE_LINE, Records, World, zeros
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth import arrays, packs
from blocksim.scenario import Model, Scenario
from blocksim.scenario.models.timeline import Nonsmooth as Stepping
from blocksim.world import build, memory, rigid_step, sag, step
from blocksim.world.bodies import Layout

ROOM = 2  # of the room for pairs of springs: fast bodies have more within reach
FINEST, FINE, COARSE = 1e-6, 1e-3, 0.1  # m/s: tolerances of the velocity pass; see velocity_tolerance
CROWD = 100  # blocks
TOUCH = 1e-12  # of the smallest side: points with no larger gap touch
LINE_WORDS = CACHE_LINE // 8  # so that no two threads write to one cache line


def stepping_of(scenario: Scenario) -> Stepping:
    """Return how the non-smooth scheme steps a scenario. Raises ValueError for a scenario of another scheme."""
    if isinstance(scenario.time, Stepping):
        return scenario.time
    raise ValueError(f"scenario {scenario.name} does not use the non-smooth scheme")


def velocity_tolerance(scenario: Scenario, blocks: int) -> float:
    """Return the tolerance (m/s) of the velocity pass: as given, or by the number of blocks and what moves them.

    Gravity and friction do some 0.6 mm/s in a substep of few blocks. With a tolerance beyond that the pass ends after
    one sweep, and shear is found over many substeps: blocks slip some per cent too far, as they tilt until shear and
    normal forces agree. What is wrong of a slip goes as the tolerance over what gravity does in a substep. So a single
    block has every substep solved, and so have fewer than CROWD where supports or any of them move as prescribed.

    Raises ValueError for a scenario of another scheme.
    """
    time = stepping_of(scenario)
    if time.velocity_tolerance is not None:
        return time.velocity_tolerance
    is_shaken = scenario.motion is not None or any(body.motion is not None for body in scenario.bodies)
    if blocks == 1 or (blocks < CROWD and is_shaken):
        return FINEST
    return FINE if blocks < CROWD else COARSE


def has_sequential_impacts(scenario: Scenario) -> bool:
    """Return True if impacts of one substep follow from one another, in rounds, and steps are cut at them.

    Otherwise all impacts of a substep happen at once, and what is struck in it strikes what it meets without a rebound
    of its own. The two are different laws where blocks touch, at every step: a row passes a blow on or moves as one.
    """
    return scenario.contact.impacts == "sequential"


def build_nonsmooth(model: Model) -> arrays.Nonsmooth:
    """Return a world at time zero with all that stepping it without springs needs. Raises as `build_one`."""
    scene: arrays.Nonsmooth = build.build_one(model, NONSMOOTH)
    return scene


def _assemble(parts: build.Parts, strides: Sequence[step.Stride]) -> arrays.Nonsmooth:
    controls = build.run_controls(parts, strides)
    stepping = zeros(controls.shape, arrays.STEPPING)
    rows = [_stepping(layout, stride) for layout, stride in zip(parts.layouts, strides, strict=True)]
    for name in rows[0]:
        stepping[name][:, 0] = [row[name] for row in rows]
    controls["cell_width"] = 2.0 * (controls["cell_radius"] + stepping["most_reach"])
    return with_lists(build.assemble_world(parts, controls), stepping, _room(parts))


def _room(parts: build.Parts) -> int:
    return ROOM * build.first_capacity(parts.bodies.shape[1])


NONSMOOTH = build.Construction(
    choose=rigid_step.choose_rigid_stride,
    size=lambda parts: memory.rigid_size(parts.bodies.shape[1], _room(parts)),
    assemble=_assemble,
)


def _stepping(layout: Layout, stride: step.Stride) -> dict[str, float]:
    time = stepping_of(layout.scenario)
    substep = stride.step / time.substeps
    soft = sag.soft_contact(substep)
    return {
        "substep": substep,
        "length": stride.step,
        "rest_gap": time.restitution_threshold * substep,
        "touch_gap": TOUCH * min((min(body.size_x, body.size_y) for body in layout.placed), default=0.0),
        "frequency": soft.frequency,
        "damping": sag.DAMPING,
        "closed_bias": soft.bias,
        "softness": soft.softness,
        "open_bias": 1.0 / substep,
        "threshold": time.restitution_threshold,
        "tolerance": velocity_tolerance(layout.scenario, len(layout.placed)),
        "substeps": time.substeps,
        "velocity_sweeps": time.velocity_sweeps,
        "is_guarded": has_sequential_impacts(layout.scenario),
        "least_reach": 0.5 * stride.skin,
        "most_reach": 1.5 * stride.skin,  # of a body, in skins
        "is_driven": layout.drives.driven.size > 0,
    }


def with_lists(world: World, stepping: Records, capacity: int) -> arrays.Nonsmooth:
    """Return worlds (one, or a stack) with empty constraints, as many as there is room for pairs."""
    *members, bodies = world.bodies.shape
    # full packs, and those in every colour that are not
    count = min(capacity, capacity // WIDTH + packs.LONELY * arrays.COLOURS)
    follows = bool(stepping["is_guarded"].any())
    contacts = arrays.Contacts(
        states=zeros((*members, bodies), arrays.STATE),
        before=zeros((*members, bodies), arrays.BEFORE),
        constraints=zeros((*members, capacity), arrays.CONSTRAINT),
        packs=zeros((*members, count), arrays.PACK),
        ends=build.numbers((*members, arrays.COLOURS + 1), np.int64),
        materials=world.interactions.reshape(*members, -1).view(np.recarray),
        tallies=zeros((*members, count // arrays.TALLY_PACKS + 1), arrays.TALLY),
        impacts=zeros((*members, bodies), arrays.IMPACT) if follows else None,
        impact_lanes=zeros((*members, count), arrays.IMPACT_LANES) if follows else None,
        residuals=build.numbers((*members, 2, LINE_WORDS), np.float64),
        stepping=stepping,
    )
    return arrays.Nonsmooth(
        world=world,
        contacts=contacts,
        kept=zeros((*members, capacity), arrays.KEPT),
        reaches=build.numbers((*members, bodies), np.float64),
        firsts=build.numbers((*members, bodies), np.int64),
        begins=build.numbers((*members, arrays.COLOURS + 1), np.int64),
        used=build.numbers((*members, bodies), np.int64),
        pushes=zeros((*members, bodies if world.loads.size else 1), arrays.PUSH),
    )


def with_more_constraints(scene: arrays.Nonsmooth) -> arrays.Nonsmooth:
    """Return the same scene with more room for pairs. Raises SceneTooLargeError."""
    old = scene.contacts
    capacity = math.ceil(build.GROWTH * old.constraints.size)
    memory.refuse_if_too_large(memory.rigid_size(scene.world.bodies.size, capacity))
    larger = with_lists(scene.world, old.stepping, capacity)
    for name in ("constraints", "tallies"):
        getattr(larger.contacts, name)[: getattr(old, name).size] = getattr(old, name)
    contacts = larger.contacts._replace(states=old.states, before=old.before, ends=old.ends, residuals=old.residuals)
    return scene._replace(world=larger.world, contacts=contacts, kept=larger.kept)
