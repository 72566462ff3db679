"""Scenes of one shape in one: every array has the members along its first axis. One scene is a stack of one.

Many scenes are built together, field by field over all members, as most of what building costs does not depend on how
many they are.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.arrays import Records
from blocksim.scenario import PlacedBody, Scenario
from blocksim.world.bodies import body_records
from blocksim.world.bounds import Bounds, bounds_of
from blocksim.world.memory import Size, refuse_if_too_large
from blocksim.world.outline import Outline, Outlines, outline_of
from blocksim.world.parts import Parts, alike, parts_of, some

MOST_BYTES = 1 << 26  # of a stack of more than one scene


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


class Stride(NamedTuple):
    """What was chosen for one scene."""

    step: float  # s
    skin: float  # m


@dataclass(frozen=True)
class Construction:
    """What a scheme does of its own where scenes are built."""

    choose: Callable[[Outline, Bounds], Stride]  # raises BlocksimError
    model: Callable[[Outline], str]  # of contacts, as the scheme's arrays have it
    size: Callable[[Parts], Size]  # of one of these scenes
    assemble: Callable[[Parts, Sequence[Stride]], Any]


def built(scenarios: Sequence[Scenario], construction: Construction) -> Iterator[Stack | Refusal]:
    """Build scenarios of one scheme at time zero; those of one shape come in as few stacks as memory allows.

    A scenario whose step, skin or size is refused does not keep the others from being built.
    """
    outlines = [outline_of(scenario) for scenario in scenarios]
    for numbers in alike([outline.shape for outline in outlines]):
        yield from _group(numbers, [outlines[i] for i in numbers], construction)


def _group(numbers: Sequence[int], outlines: Outlines, construction: Construction) -> Iterator[Stack | Refusal]:
    """Build scenes of one outline."""
    bodies, chosen = _choose(outlines, construction)
    good = [k for k, one in enumerate(chosen) if isinstance(one, Stride)]
    yield from (Refusal(numbers[k], one) for k, one in enumerate(chosen) if isinstance(one, BlocksimError))
    strides = [one for one in chosen if isinstance(one, Stride)]
    model = construction.model(outlines[0])
    for same, parts in parts_of([outlines[k] for k in good], some(bodies, good), model):
        yield from _stacks([numbers[good[k]] for k in same], parts, [strides[k] for k in same], construction)


def _choose(outlines: Outlines, construction: Construction) -> tuple[Records, list[Stride | BlocksimError]]:
    """Return the bodies, and what is chosen for every scene or why nothing can be."""
    chosen: list[Stride | BlocksimError] = []
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused
        bodies = body_records(outlines)
        for outline, bounds in zip(outlines, bounds_of(bodies, len(outlines[0].placed)), strict=True):
            try:
                chosen.append(construction.choose(outline, bounds))
            except BlocksimError as error:
                chosen.append(error)
    return bodies, chosen


def _stacks(
    numbers: list[int], parts: Parts, strides: list[Stride], construction: Construction
) -> Iterator[Stack | Refusal]:
    """Build scenes of one shape, as many at a time as have room."""
    size = construction.size(parts)
    count = max(1, MOST_BYTES // size.world_bytes)
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


def _each(scene: Any, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Any:
    if isinstance(scene, np.ndarray):
        return change(scene)
    return None if scene is None else type(scene)(*(_each(part, change) for part in scene))
