"""From a scenario to the arrays of its scene at time zero.

Blocks are placed, step and skin chosen, bodies divided for the broad phase, the size checked, the arrays assembled.
`build_stacks` does that for many scenarios at once, field by field over all members, as most of what building costs
does not depend on their number. So all arrays have the members along their first axis, and `build_one` takes the only
member of a stack.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common.arrays import HALF, SLOTS, Records, zeros
from blocksim.scenario import PlacedBody, Scenario
from blocksim.world.bodies import Outline, Outlines, body_records, outline_of, with_freed
from blocksim.world.bounds import Bounds, bounds_of
from blocksim.world.memory import Size, refuse_if_too_large
from blocksim.world.particles import place_particles, slots_of_a_pair

MOST_BYTES = 1 << 26  # of a stack of more than one scene
MOST_LARGE = 64  # bodies that are checked one by one, outside the grid of the broad phase
LARGE_RATIO = 4.0  # over the smallest body; nothing is large below that
SURFACE = "surface"  # the model without particles
Floats = NDArray[np.float64]


class Stride(NamedTuple):
    """Values chosen for one scene."""

    step: float  # s
    skin: float  # m
    approach: float = 0.0  # m, up to which bodies are always listed


class Parts(NamedTuple):
    """What m scenes of one shape consist of, whatever the scheme."""

    outlines: Outlines
    bodies: Records  # (m, n + 1) BODY
    cell_radius: Floats  # (m,) m
    particles: Records | None  # (m, q) PARTICLE
    slots: int  # of a pair

    @property
    def is_large(self) -> NDArray[np.bool_]:
        """Which bodies (m, n) stay out of the grid; equally many in each scene."""
        is_large: NDArray[np.bool_] = self.bodies["radius"][:, :-1] > self.cell_radius[:, np.newaxis]
        return is_large

    def chosen(self, numbers: Sequence[int]) -> "Parts":
        """Return the parts of some of the scenes."""
        if len(numbers) == len(self.outlines):
            return self
        return Parts(
            [self.outlines[k] for k in numbers],
            some(self.bodies, numbers),
            self.cell_radius[list(numbers)],
            None if self.particles is None else some(self.particles, numbers),
            self.slots,
        )


@dataclass(frozen=True)
class Construction:
    """Parts of building scenes that depend on the scheme."""

    choose: Callable[[Outline, Bounds], Stride]  # raises BlocksimError
    model: Callable[[Outline], str]  # of contacts, as the scheme's arrays have it
    size: Callable[[Parts], Size]  # of one of these scenes
    assemble: Callable[[Parts, Sequence[Stride]], Any]


class Built(NamedTuple):
    """One scene at time zero, and its blocks as they were placed."""

    placed: tuple[PlacedBody, ...]
    scene: Any  # of the scheme's type


class Stack(NamedTuple):
    """Scenes that were built together."""

    numbers: list[int]  # which of the scenarios they are of
    placed: list[tuple[PlacedBody, ...]]
    scenes: Any  # of the scheme's type

    def numbered(self, numbers: Sequence[int]) -> "Stack":
        """Return the same for scenarios with other numbers."""
        return self._replace(numbers=[numbers[i] for i in self.numbers])


class Refusal(NamedTuple):
    """A scenario that cannot be built."""

    number: int
    error: BlocksimError

    def numbered(self, numbers: Sequence[int]) -> "Refusal":
        """Return the same for scenarios with other numbers."""
        return self._replace(number=numbers[self.number])


def build_one(scenario: Scenario, construction: Construction) -> Built:
    """Build the scene of one scenario. Raises what refuses its step, its skin or its size."""
    stack = only(build_stacks([scenario], construction))
    return Built(stack.placed[0], member(stack.scenes, 0))


def build_stacks(scenarios: Sequence[Scenario], construction: Construction) -> Iterator[Stack | Refusal]:
    """Build scenarios of one scheme; those of one shape come in as few stacks as memory allows.

    A scenario whose step, skin or size is refused does not stop the others.
    """
    outlines = [outline_of(scenario) for scenario in scenarios]
    for numbers in alike([outline.shape for outline in outlines]):
        yield from _group(numbers, [outlines[i] for i in numbers], construction)


def _group(numbers: Sequence[int], outlines: Outlines, construction: Construction) -> Iterator[Stack | Refusal]:
    """Build scenes of one outline."""
    good, strides, refusals = list[int](), list[Stride](), list[Refusal]()
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused
        bodies = body_records(outlines)
        all_bounds = bounds_of(with_freed(bodies, outlines), len(outlines[0].placed), [one.shapes for one in outlines])
        for k, (outline, bounds) in enumerate(zip(outlines, all_bounds, strict=True)):
            try:
                strides.append(construction.choose(outline, bounds))
                good.append(k)
            except BlocksimError as error:
                refusals.append(Refusal(numbers[k], error))
    yield from refusals
    if good:
        model = construction.model(outlines[0])
        for same, parts in _divided([outlines[k] for k in good], some(bodies, good), model):
            yield from _stacks([numbers[good[k]] for k in same], parts, [strides[k] for k in same], construction)


def _stacks(
    numbers: list[int], parts: Parts, strides: list[Stride], construction: Construction
) -> Iterator[Stack | Refusal]:
    """Build scenes of one shape, as many at a time as have room."""
    size = construction.size(parts)
    count = max(1, MOST_BYTES // size.bytes)
    for first in range(0, len(numbers), count):
        places = range(first, min(first + count, len(numbers)))
        names = [numbers[k] for k in places]
        try:
            refuse_if_too_large(size)
        except BlocksimError as error:
            yield from (Refusal(number, error) for number in names)
        else:
            chosen = parts.chosen(places)
            placed = [outline.placed for outline in chosen.outlines]
            yield Stack(names, placed, construction.assemble(chosen, [strides[k] for k in places]))


def _divided(outlines: Outlines, bodies: Records, model: str) -> Iterator[tuple[list[int], Parts]]:
    """Yield the parts of scenes of one outline, all those of one shape together, and which they are.

    What decides the shape by now: how many bodies are large, how many move with the support, how many particles there
    are, and how many slots a pair has: of corners those of its two bodies, at most.
    """
    particles: list[Records | None] = [None] * len(outlines)
    if model == SURFACE:
        sizes = [None if one.shapes is None else one.shapes.sizes for one in outlines]
        slots = [SLOTS if one is None else 2 * max(HALF, *one) for one in sizes]
    else:
        spacings = [outline.scenario.contact.particle_spacing for outline in outlines]
        particles = [place_particles(one, model, spacing) for one, spacing in zip(bodies, spacings, strict=True)]
        slots = [slots_of_a_pair(one, model) for one in bodies]
    parts = Parts(outlines, bodies, cell_radius(bodies), None, SLOTS)
    counts = zip(
        np.count_nonzero(parts.is_large, axis=1),
        np.count_nonzero(bodies["is_moved"], axis=1),
        slots,
        (None if one is None else one.size for one in particles),
        strict=True,
    )
    for same in alike(list(counts)):
        one = parts.chosen(same)._replace(slots=slots[same[0]])
        some_particles = [found for k in same if (found := particles[k]) is not None]
        yield same, one._replace(particles=joined(some_particles)) if some_particles else one


def cell_radius(bodies: Records) -> Floats:
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


def alike(keys: Sequence[Hashable]) -> list[list[int]]:
    """Return the places of equal keys, in the order in which each comes first."""
    places: dict[Hashable, list[int]] = {}
    for place, key in enumerate(keys):
        places.setdefault(key, []).append(place)
    return list(places.values())


def joined(records: Sequence[Records]) -> Records:
    """Return records (k,) of m scenes as one array (m, k)."""
    whole = zeros((len(records), records[0].size), records[0].dtype)
    plain = whole.view(np.ndarray)
    for m, one in enumerate(records):
        plain[m] = one
    return whole


def some(records: Records, numbers: Sequence[int]) -> Records:
    """Return the records of some of the scenes (m, ...), from a cache line on; all of them as they are."""
    if len(numbers) == len(records):
        return records
    chosen = zeros((len(numbers), *records.shape[1:]), records.dtype)
    chosen[...] = records[list(numbers)]
    return chosen


def only(stacks: Iterable[Stack | Refusal]) -> Stack:
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
