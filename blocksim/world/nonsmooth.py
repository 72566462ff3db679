"""Build what the non-smooth scheme needs from a scenario, beside the world that both schemes share."""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.arrays import CACHE_LINE, Records, World, zeros
from blocksim.kernels.lanes import WIDTH
from blocksim.kernels.nonsmooth.arrays import (
    BEFORE,
    BOOK,
    COLOURS,
    GROUP,
    KEPT,
    LINE,
    PART,
    ROW,
    SPOT,
    STEPPING,
    Contacts,
    Nonsmooth,
)
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Nonsmooth as Stepping
from blocksim.world.build import GROWTH, empty_controls, first_capacity, scene_parts, smallest_side, without_lists
from blocksim.world.memory import RigidSize, refuse_if_too_large
from blocksim.world.rigid_step import choose_rigid_step
from blocksim.world.skin import SKIN_SHARE

FREQUENCY = 0.125  # of the soft contact, per substep: w h = 2 pi / 8. Above 0.15 walls spread like a fluid
DAMPING = 10.0  # damping ratio of the soft contact
MOST_REACH = 1.5  # of a body, in skins
SAFE_RESTITUTION = 0.5  # up to which no impact was seen to create energy
FINE, COARSE = 1e-3, 0.1  # m/s: tolerance of the velocity pass, for few blocks and for a crowd
CROWD = 100  # blocks
LINE_WORDS = CACHE_LINE // 8  # so that no two threads write to one cache line


class SoftContact(NamedTuple):
    """Feedback of the position pass; see blocksim.kernels.nonsmooth."""

    bias: float  # 1/s: b
    softness: float  # -: gamma / A
    frequency: float  # 1/s: w, so that the stiffness at rest is w^2 / A


def soft_contact(substep: float) -> SoftContact:
    """Return the feedback for a substep (s)."""
    turn = 2.0 * math.pi * FREQUENCY  # w h
    return SoftContact(turn / substep / (turn + 2.0 * DAMPING), 1.0 / (turn * (turn + 2.0 * DAMPING)), turn / substep)


def stepping_of(scenario: Scenario) -> Stepping:
    """Return how the non-smooth scheme steps a scenario. Raises ValueError for a scenario of another scheme."""
    if not isinstance(scenario.time, Stepping):
        message = f"scenario {scenario.name} is not one of the non-smooth scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    return scenario.time


def velocity_tolerance(time: Stepping, blocks: int) -> float:
    """Return the tolerance (m/s) of the velocity pass: as given, or by the number of blocks."""
    if time.velocity_tolerance is not None:
        return time.velocity_tolerance
    return FINE if blocks < CROWD else COARSE


def build_nonsmooth(scenario: Scenario) -> Nonsmooth:
    """Return a world at time zero with all that stepping it without springs needs.

    Raises SceneTooLargeError when there is not enough memory for it, and StepTooLargeError when the scenario asks for
    an inadmissible step without forcing it.
    """
    time = stepping_of(scenario)
    parts = scene_parts(scenario)
    capacity = first_capacity(parts.bodies)
    refuse_if_too_large(RigidSize(parts.bodies.size, capacity))
    smallest = smallest_side(parts)
    controls = empty_controls(scenario, parts, choose_rigid_step(scenario, parts.bodies, parts.interactions, smallest))
    stepping = zeros(1, STEPPING)
    record = stepping[0]
    record.substep = controls[0].step / time.substeps
    record.closed_bias, record.softness, _ = soft_contact(record.substep)
    record.open_bias = 1.0 / record.substep
    record.threshold = time.restitution_threshold
    record.tolerance = velocity_tolerance(time, len(parts.placed))
    record.substeps, record.velocity_sweeps = time.substeps, time.velocity_sweeps
    record.is_guarded = float(parts.interactions.restitution.max()) > SAFE_RESTITUTION
    controls[0].skin = smallest * SKIN_SHARE if scenario.contact.skin is None else scenario.contact.skin
    record.least_reach, record.most_reach = 0.5 * controls[0].skin, MOST_REACH * controls[0].skin
    controls[0].cell_width = 2.0 * (controls[0].cell_radius + record.most_reach)
    return with_lists(without_lists(scenario, parts, controls), stepping, capacity)


def with_lists(world: World, stepping: Records, capacity: int, threads: int = 1) -> Nonsmooth:
    """Return a world with empty rows, as many as there is room for pairs."""
    bodies = world.bodies.size
    contacts = Contacts(
        lines=zeros(bodies, LINE),
        before=zeros(bodies, BEFORE),
        rows=zeros(capacity, ROW),
        groups=zeros(groups_for(capacity), GROUP),
        ends=np.zeros(COLOURS + 1, dtype=np.int64),
        touches=world.interactions.reshape(-1).view(np.recarray),
        books=zeros(groups_for(capacity) // PART + 1, BOOK),
        residuals=_residuals(threads),
        stepping=stepping,
    )
    return Nonsmooth(
        world=world,
        contacts=contacts,
        kept=zeros(capacity, KEPT),
        spots=zeros(bodies, SPOT),
        firsts=np.zeros(bodies, dtype=np.int64),
        begins=np.zeros(COLOURS + 1, dtype=np.int64),
        used=np.zeros(bodies, dtype=np.int64),
    )


def groups_for(capacity: int) -> int:
    """Return how many groups there is room for: full ones, and one in every colour that is not."""
    return min(capacity, capacity // WIDTH + COLOURS)


def _residuals(threads: int) -> Any:
    return np.zeros((2, LINE_WORDS * threads))


def threads_of(scene: Nonsmooth) -> int:
    """Return for how many threads there is room for what they tell one another."""
    return int(scene.contacts.residuals.shape[1]) // LINE_WORDS


def with_more_rows(scene: Nonsmooth) -> Nonsmooth:
    """Return the same scene with more room for pairs. Raises SceneTooLargeError."""
    old = scene.contacts
    capacity = math.ceil(GROWTH * old.rows.size)
    refuse_if_too_large(RigidSize(scene.world.bodies.size, capacity))
    larger = with_lists(scene.world, old.stepping, capacity)
    for name in ("rows", "books"):
        getattr(larger.contacts, name)[: getattr(old, name).size] = getattr(old, name)
    contacts = larger.contacts._replace(lines=old.lines, before=old.before, ends=old.ends, residuals=old.residuals)
    return larger._replace(contacts=contacts, spots=scene.spots, begins=scene.begins)


def with_more_threads(scene: Nonsmooth, threads: int) -> Nonsmooth:
    """Return the same scene with room for what that many threads tell one another."""
    return scene._replace(contacts=scene.contacts._replace(residuals=_residuals(threads)))
