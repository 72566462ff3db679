"""From a scenario to the arrays of its scene at time zero.

Blocks are placed, step and skin chosen, bodies divided for the broad phase, the size checked, the arrays assembled.
`build_stacks` does that for many scenarios at once, field by field over all members, as most of what building costs
does not depend on their number. So all arrays have the members along their first axis, and `build_one` takes the only
member of a stack. `couple` adds systems beside blocks and supports.
"""

import inspect
import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common import arrays, tolerances
from blocksim.kernels.common.systems import Act, Coupled, Plan, plan
from blocksim.kernels.explicit import models
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import Model, laws, motion, placement
from blocksim.world import excitation, interactions, memory
from blocksim.world.bodies import Layout, body_records, layout_of, motion_records, place_particles, slots_of_a_pair
from blocksim.world.step import MOST_STEPS, Bounds, Stride, bounds_of, choose_stride
from blocksim.world.systems import acts_of
from blocksim.world.systems.system import SystemInScene

MOST_BYTES = 1 << 26  # of a stack of more than one scene
MOST_LARGE = 64  # bodies that are checked one by one, outside the grid
LARGE_RATIO = 4.0  # over the smallest body; nothing is large below that
SURFACE = "surface"  # the model without particles
CHECKS = 500  # of rest, overlap and finiteness, in the time that rest must last
CHEAP_CHECKS = 50  # steps between checks, from which on they cost almost nothing; where steps are long,
FEWEST_CHECKS = 50  # in that time at least
HALFWAY = 0.5  # of the smallest side: what is driven into a rigid contact comes no farther between checks
LONGEST_HOLD = 5.0  # ends of the run, as which a longer time that rest must last counts, and none
LEAST_PAIRS = 16
PAIRS_PER_BODY = 3
GROWTH = 1.25  # of the room for pairs, each time that it does not suffice
Floats = NDArray[np.float64]


class Parts(NamedTuple):
    """What m scenes of one shape consist of, whatever the scheme."""

    layouts: Sequence[Layout]
    bodies: arrays.Records  # (m, n + 1) BODY
    cell_radius: Floats  # (m,) m
    particles: arrays.Records | None  # (m, q) PARTICLE
    slots: int  # of a pair

    @property
    def is_large(self) -> NDArray[np.bool_]:
        """Which bodies (m, n) stay out of the grid; equally many in each scene."""
        is_large: NDArray[np.bool_] = self.bodies["radius"][:, :-1] > self.cell_radius[:, np.newaxis]
        return is_large

    def chosen(self, numbers: Sequence[int]) -> "Parts":
        """Return the parts of some of the scenes."""
        if len(numbers) == len(self.layouts):
            return self
        particles = None if self.particles is None else take_members(self.particles, numbers)
        bodies, radii = take_members(self.bodies, numbers), self.cell_radius[list(numbers)]
        return Parts([self.layouts[k] for k in numbers], bodies, radii, particles, self.slots)


@dataclass(frozen=True)
class Construction:
    """Parts of building scenes that depend on the scheme."""

    choose: Callable[[Layout, Bounds], Stride]  # raises BlocksimError
    size: Callable[[Parts], memory.Size]  # of one of these scenes
    assemble: Callable[[Parts, Sequence[Stride]], Any]


class SceneStack(NamedTuple):
    """Scenes that were built together."""

    numbers: list[int]  # which of the models they are of
    scenes: Any  # of the scheme's type


class Refusal(NamedTuple):
    """A scenario that cannot be built."""

    number: int
    error: BlocksimError


Stacks = Iterator[SceneStack | Refusal]


def build_one(model: Model, construction: Construction) -> Any:
    """Build the scene of one scenario.

    Raises SceneTooLargeError when there is not enough memory for it, StepError when the scenario asks for an
    inadmissible step without forcing it, and SkinTooSmallError when the skin that it asks for could miss contacts.
    """
    return member(only_stack(build_stacks([model], construction)).scenes, 0)


def build_stacks(models: Sequence[Model], construction: Construction, numbers: Sequence[int] | None = None) -> Stacks:
    """Build scenarios of one scheme; those of one shape come in as few stacks as memory allows.

    A scenario whose step, skin or size is refused does not stop the others. Stacks name them by `numbers`, by their
    places where none are given.
    """
    names = range(len(models)) if numbers is None else numbers
    layouts = [layout_of(model) for model in models]
    for places in group_equal([layout.shape for layout in layouts]):
        good, strides, refusals = list[int](), list[Stride](), list[Refusal]()
        with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused
            same = [layouts[i] for i in places]
            bodies = body_records(same)
            for k, (layout, bounds) in enumerate(zip(same, bounds_of(same, bodies), strict=True)):
                try:
                    strides.append(construction.choose(layout, bounds))
                    good.append(k)
                except BlocksimError as error:
                    refusals.append(Refusal(names[places[k]], error))
        yield from refusals
        if good:
            chosen = [names[places[k]] for k in good]
            for some, parts in _divided([same[k] for k in good], take_members(bodies, good)):
                yield from _stacks([chosen[k] for k in some], parts, [strides[k] for k in some], construction)


def _stacks(numbers: list[int], parts: Parts, strides: list[Stride], construction: Construction) -> Stacks:
    """Build scenes of one shape, as many at a time as have room."""
    size = construction.size(parts)
    count = max(1, MOST_BYTES // size.bytes)
    for first in range(0, len(numbers), count):
        places = range(first, min(first + count, len(numbers)))
        names = [numbers[k] for k in places]
        try:
            memory.refuse_if_too_large(size)
        except BlocksimError as error:
            yield from (Refusal(number, error) for number in names)
        else:
            chosen = parts.chosen(places)
            yield SceneStack(names, construction.assemble(chosen, [strides[k] for k in places]))


def _divided(layouts: Sequence[Layout], bodies: arrays.Records) -> Iterator[tuple[list[int], Parts]]:
    """Yield the parts of scenes of one layout, all those of one shape together, and which they are.

    What decides the shape by now: how many bodies are large, how many move with the support, how many particles there
    are, and how many slots a pair has: of corners those of its two bodies, at most, up to a whole number of NEAR_PAIR.
    """
    contact, has_springs = layouts[0].scenario.contact, layouts[0].scenario.time.has_springs
    particles: list[arrays.Records] = []
    if contact.model == SURFACE or not has_springs:
        slots = [-(-2 * max(one.shapes.sizes) // arrays.SLOTS) * arrays.SLOTS for one in layouts]
    else:
        spacings = [layout.scenario.contact.particle_spacing for layout in layouts]
        particles = [place_particles(one, contact.model, space) for one, space in zip(bodies, spacings, strict=True)]
        slots = [slots_of_a_pair(one, contact.model) for one in bodies]
    parts = Parts(layouts, bodies, cell_radius(bodies), None, arrays.SLOTS)
    counts = zip(
        np.count_nonzero(parts.is_large, axis=1),
        np.count_nonzero(bodies["is_moved"], axis=1),
        slots,
        [one.size for one in particles] or slots,
        strict=True,
    )
    for same in group_equal(list(counts)):
        joined = join_records([particles[k] for k in same]) if particles else None
        yield same, parts.chosen(same)._replace(slots=slots[same[0]], particles=joined)


def cell_radius(bodies: arrays.Records) -> Floats:
    """Return the half diagonal (m) of the largest of the bodies (..., n + 1) in the grid.

    In it are all but a few pieces of ground and planks.
    """
    radii = np.sort(bodies["radius"][..., :-1], axis=-1)
    if radii.shape[-1] == 0:  # nothing but the half-plane: the grid holds nothing
        return np.ones(radii.shape[:-1])
    few = min(MOST_LARGE, radii.shape[-1] // 8)
    count = np.count_nonzero(radii <= LARGE_RATIO * radii[..., :1], axis=-1)
    smaller = np.take_along_axis(radii, np.asarray(count)[..., np.newaxis] - 1, axis=-1)[..., 0]
    radius: Floats = np.maximum(radii[..., -1 - few], smaller)
    return radius


def group_equal(keys: Sequence[Hashable]) -> list[list[int]]:
    """Return the places of equal keys, in the order in which each comes first."""
    places: dict[Hashable, list[int]] = {}
    for place, key in enumerate(keys):
        places.setdefault(key, []).append(place)
    return list(places.values())


def join_records(records: Sequence[arrays.Records]) -> arrays.Records:
    """Return records (k,) of m scenes as one array (m, k)."""
    whole = arrays.zeros((len(records), records[0].size), records[0].dtype)
    plain = whole.view(np.ndarray)
    for m, one in enumerate(records):
        plain[m] = one
    return whole


def take_members(records: arrays.Records, numbers: Sequence[int]) -> arrays.Records:
    """Return the records of some of the scenes (m, ...), from a cache line on; all of them as they are."""
    if len(numbers) == len(records):
        return records
    chosen = arrays.zeros((len(numbers), *records.shape[1:]), records.dtype)
    chosen[...] = records[list(numbers)]
    return chosen


def only_stack(stacks: Stacks) -> SceneStack:
    """Return the one stack that was built. Raises what refused it."""
    (one,) = stacks
    if isinstance(one, Refusal):
        raise one.error
    return one


def member(scenes: Any, m: int) -> Any:
    """Return one scene of a stack; it shares the memory."""
    return _each(scenes, lambda array: array[m])


def stack_of_one(scene: Any) -> Any:
    """Return a scene as a stack; it shares the memory."""
    return _each(scene, lambda array: array[np.newaxis])


def arrays_of(scene: Any) -> list[NDArray[Any]]:
    """Return all arrays of a scene, or of a stack of scenes."""
    if isinstance(scene, np.ndarray):
        return [scene]
    return [] if scene is None else [array for part in scene for array in arrays_of(part)]


def _each(scene: Any, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Any:
    if isinstance(scene, np.ndarray):
        return change(scene)
    return None if scene is None else with_parts(scene, [_each(part, change) for part in scene])


def with_parts(scene: Any, parts: list[Any]) -> Any:
    """Return a named tuple, or a plain one, of the same type with other parts."""
    return type(scene)(*parts) if hasattr(scene, "_fields") else tuple(parts)


def build_world(model: Model) -> arrays.World:
    """Return the world at time zero, pair lists still empty. Raises as `build_one`."""
    world: arrays.World = build_one(model, EXPLICIT)
    return world


def _size(parts: Parts) -> memory.Size:
    bodies = parts.bodies.shape[1]
    return memory.scene_size(bodies, first_capacity(bodies), parts.slots, has_particles=parts.particles is not None)


def _assemble(parts: Parts, strides: Sequence[Stride]) -> arrays.World:
    members, bodies = parts.bodies.shape
    if parts.particles is None:
        contacts = arrays.zeros((members, arrays.CONTACTS), arrays.CONTACT)
    else:
        contacts = arrays.zeros((members, parts.slots), arrays.PARTICLE_CONTACT)
    controls = run_controls(parts, strides)
    reach = np.maximum(controls["skin"], tolerances.TRAVELLED * controls["skin"] + controls["approach"])
    controls["cell_width"] = 2.0 * controls["cell_radius"] + reach
    return assemble_world(parts, controls, first_capacity(bodies), parts.slots, contacts)


EXPLICIT = Construction(choose_stride, _size, _assemble)


def assemble_world(
    parts: Parts, controls: arrays.Records, capacity: int = 1, slots: int = 1, contacts: arrays.Records | None = None
) -> arrays.World:
    """Return stacked worlds at time zero with room for `capacity` pairs, `slots` and contacts of each.

    A scheme that keeps pairs and contacts elsewhere needs none: there is room for one.
    """
    members, count = parts.bodies.shape
    bodies, layouts, is_large = parts.bodies, parts.layouts, parts.is_large
    bodies["half_x"][:, -1] = math.inf  # the half-plane has one face without ends
    before = arrays.zeros((members, 1), arrays.CONTACT) if contacts is None else contacts
    points = arrays.zeros((members, slots + 1), arrays.POINT)
    points["share"] = 1.0  # as it stays in the surface model
    blocks = count - 1
    large = np.nonzero(is_large)[1].reshape(members, -1)
    world = arrays.World(
        bodies=bodies,
        points=points,
        before=before,
        **empty_lists(capacity, slots, before),
        particles=parts.particles,
        corners=join_records([one.shapes.table for one in layouts]) if layouts[0].shapes.has_polygons else None,
        starts=numbers((members, max(blocks, 16) + 3), np.uint32),
        order=numbers((members, blocks), np.uint32),
        large=numbers(large.shape, np.uint32),
        interactions=interactions.interaction_tables([layout.interactions for layout in layouts]),
        ledger=arrays.zeros((members, count // arrays.GROUP + 1), arrays.LEDGER),
        action=arrays.zeros((members, 1), arrays.ACTION),
        matrices=numbers((members, 8, 3, 3), np.float64),
        moved=motion_records(bodies, layouts),
        motion=join_records([layout.drives.pieces for layout in layouts]),
        controls=controls,
        clock=arrays.zeros((members, 1), arrays.CLOCK),
        shares=arrays.zeros((members, 1), arrays.SHARE),
        between=arrays.zeros((members, 1), arrays.ACTION),
        team=numbers((members, arrays.TEAM_WORDS), np.int64),
        loads=join_records([layout.applied.loads for layout in layouts]),
        load_pieces=join_records([layout.applied.pieces for layout in layouts]),
    )
    world.large[...] = large
    for layout, records, control in zip(layouts, world.loads, controls[:, 0], strict=True):
        springs = excitation.springs_of(layout.model, float(control["step"]))
        for record, (stiffness, damping) in zip(records[records.size - len(springs) :], springs, strict=True):
            record.stiffness, record.damping = stiffness, damping
    world.clock["motion_piece"][:, 0] = layouts[0].drives.paths
    world.controls["driven"][:, 0] = layouts[0].drives.driven.size
    speed_squared = bodies["vx"] ** 2 + bodies["vy"] ** 2
    energies = bodies["mass"] * speed_squared + bodies["inertia"] * bodies["spin"] ** 2
    # one by one, as the order of a sum affects its last digit
    world.ledger["largest_kinetic"][:, 0] = [0.5 * float(np.sum(one)) for one in energies]
    return world


def numbers(shape: int | tuple[int, ...], kind: type[np.generic]) -> Any:
    """Return zeros that start on a cache line."""
    plain: Any = np.dtype(kind)
    return arrays.zeros(shape, plain).view(np.ndarray)


def first_capacity(bodies: int) -> int:
    """Return the room for pairs to start with: the contacts of convex bodies in a plane are at most three a body."""
    return max(LEAST_PAIRS, PAIRS_PER_BODY * bodies)


def empty_lists(capacity: int, slots: int, contacts: arrays.Records) -> dict[str, Any]:
    """Return the pair lists of a world, or of a stack of them, without pairs, with room for `capacity` of them.

    Every pair has `slots` of what can come into contact, and as many contacts at the same time, of the same type, as
    `contacts` (..., c) has.
    """
    *members, most = contacts.shape
    pairs = (*members, capacity)
    kind = np.uint8 if contacts.dtype == arrays.CONTACT else np.uint32
    return {
        "pairs": arrays.zeros(pairs, arrays.PAIR),
        "contacts": arrays.zeros((*pairs, most), contacts.dtype),
        "candidates": numbers((*pairs, slots), kind),
        "operators": arrays.zeros((*pairs, 2), arrays.OPERATOR),
    }


def with_more_room(world: arrays.World) -> arrays.World:
    """Return the same world with more room for candidate pairs. Raises SceneTooLargeError."""
    used = world.pairs.size
    capacity, slots = math.ceil(GROWTH * used), world.candidates.shape[1]
    has_particles = world.particles is not None
    memory.refuse_if_too_large(memory.scene_size(world.bodies.size, capacity, slots, has_particles=has_particles))
    lists = empty_lists(capacity, slots, world.before)
    for name in ("pairs", "contacts", "candidates", "operators"):
        lists[name][:used] = getattr(world, name)
    return with_threads(world._replace(**lists), world.shares.size)


def with_threads(world: arrays.World, threads: int) -> arrays.World:
    """Return the same world with room for the exchange between that many threads."""
    between = world.pairs.size if threads > 1 else 1  # memory that was never written is not allocated yet
    return world._replace(shares=arrays.zeros(threads, arrays.SHARE), between=arrays.zeros(between, arrays.ACTION))


def run_controls(parts: Parts, strides: Sequence[Stride]) -> arrays.Records:
    """Return the controls (m, 1) of runs, but for the width of a cell."""
    controls = arrays.zeros((len(strides), 1), arrays.CONTROLS)
    rows = []
    for layout, (step, skin, approach) in zip(parts.layouts, strides, strict=True):
        scenario, contact, time = layout.scenario, layout.scenario.contact, layout.scenario.time
        pull_x, pull_y = scenario.gravity.pull(scenario.ground.tilt)
        motion_x, motion_y = (0.0, 0.0) if scenario.motion is None else motion.motion_direction(scenario)
        kernel, smoothing_length = KERNEL_CODES[contact.kernel], contact.resolved_smoothing_length
        hold = min(time.rest_hold or math.inf, LONGEST_HOLD * time.end)
        few = round(min(CHEAP_CHECKS, hold / FEWEST_CHECKS / step))  # of a quotient that may be infinite
        every = max(1, few, round(min(MOST_STEPS, hold / CHECKS / step)))
        if not time.has_springs:  # those look at every overlap in every step
            driven = max(excitation.drive_bounds(layout.model)[0], excitation.greatest_head_speed(scenario)) * step
            passing = HALFWAY * placement.smallest_width(layout.placed)
            every = max(1, min(every, int(passing / driven))) if driven > 0.0 and layout.placed else every
        rest_checks = max(1, math.ceil(min(time.rest_hold / (every * step), MOST_STEPS))) if time.stop_at_rest else 0
        row = {
            "step": step,
            "skin": skin,
            "approach": approach,
            "gravity_x": pull_x,
            "gravity_y": pull_y,
            "motion_x": motion_x,
            "motion_y": motion_y,
            "max_overlap": 0.0 if contact.max_overlap is None else contact.max_overlap,
            "rest_speed": time.rest_speed,
            "model": models.MODEL_CODES[contact.model],
            "exponent": laws.LAWS[contact.law].exponent,
            "sph_kernel": kernel,
            "particle_size": contact.particle_spacing,
            "smoothing_length": smoothing_length,
            "support": inspect.unwrap(support_radius)(kernel, smoothing_length),  # no machine code for one product
            "check_every": every,
            "rest_checks": rest_checks,
            "push": layout.applied.push,
            "loads_end": layout.applied.end,
        }
        rows.append(row)
    for name in rows[0]:
        controls[name][:, 0] = [row[name] for row in rows]
    controls["cell_radius"][:, 0] = parts.cell_radius
    return controls


def couple(model: Model, world: Any, others: tuple[SystemInScene, ...]) -> Coupled:
    """Return a world with further systems at time zero. Raises InvalidInputError for a pair that is not modelled."""
    systems = tuple(present.system for present in others)
    acts = tuple(Act(*one) for one in acts_of(systems))
    built = tuple(system.build(model) for system in systems if system.build is not None)
    stages = tuple(system.stages() for system in systems if system.stages is not None)
    energies = tuple(tuple(f"{system.name}_{name}" for name in system.energies) for system in systems)
    plan(built, Plan(stages, acts, energies))
    return Coupled(world, built)
