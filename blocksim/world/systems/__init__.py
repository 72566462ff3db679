"""The systems of scenes and how pairs of them act on one another; see blocksim/world/README.md.

A system of the user's choice is one file, and one line in `blocksim.scenario.models.base.SYSTEMS`;
every pair that can meet is one line in `INTERACTIONS`.
"""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Any

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, derived
from blocksim.scenario.models.base import SYSTEMS
from blocksim.scenario.placement import GEOMETRY
from blocksim.world.systems.blocks import BLOCKS, SUPPORTS
from blocksim.world.systems.soils import SOILS, soil_kernels
from blocksim.world.systems.system import System, SystemInScene

IN_WORLD = (BLOCKS, SUPPORTS)
"""Systems of every scene, whose arrays are the world, and whose steps, bounds and energies are the scheme's own."""
Function = Callable[..., None]
Interaction = Callable[[], Function] | None
"""Gives the compiled function of a pair (`Act` in kernels/common/systems.py); None: nothing happens between the two."""
INTERACTIONS: dict[tuple[str, str], Interaction] = {
    (SOILS.name, SOILS.name): lambda: soil_kernels().ACTS["soils"],
    (SOILS.name, BLOCKS.name): lambda: soil_kernels().ACTS["blocks"],
    (SOILS.name, SUPPORTS.name): lambda: soil_kernels().ACTS["supports"],
}
"""By the names of both; a system comes before blocks and supports, whose function gets the world as its partner.

Contacts of blocks and supports with one another are stages of each scheme.
"""


def systems_of(model: Model) -> tuple[System, ...]:
    """Return what the systems beside blocks and supports declare, in the order in which they are registered."""
    places = [table.declared_in.split(":") for name, table in SYSTEMS.items() if model.scenario.systems.get(name)]
    return tuple(getattr(import_module(module), declared) for module, declared in places)


@derived(*GEOMETRY, "gravity")
def others_of(model: Model) -> tuple[SystemInScene, ...]:
    """Return the systems of a scenario beside blocks and supports, in the order in which they are registered."""
    return tuple(SystemInScene(system, system.elements(model)) for system in systems_of(model))


def largest_step(model: Model) -> float:
    """Return the longest step (s) that the systems beside blocks and supports admit; infinite where there are none."""
    bounds = (system.largest_step for system in systems_of(model))
    return min((bound(model) for bound in bounds if bound is not None), default=float("inf"))


def warnings_of(model: Model) -> Iterator[str]:
    """Yield what is known to be off in the results of the systems beside blocks and supports."""
    for system in systems_of(model):
        if system.warnings is not None:
            yield from system.warnings(model)


def acts_of(systems: Sequence[System]) -> Iterator[tuple[int, int | None, Any]]:
    """Yield who acts on whom by which function: numbers of systems, None for blocks and supports.

    Raises InvalidInputError for a pair that is not modelled.
    """
    for i, one in enumerate(systems):
        partners: list[tuple[int | None, System]] = [(None, other) for other in IN_WORLD]
        for number, other in (*partners, *enumerate(systems[i:], i)):
            pairs = [pair for pair in ((one.name, other.name), (other.name, one.name)) if pair in INTERACTIONS]
            if not pairs:
                message = "cannot be in one scene: what happens between them is not modelled"
                raise InvalidInputError(f"{one.name} and {other.name} {message}")
            interaction = INTERACTIONS[pairs[0]]
            if interaction is not None:
                ends = (number, i) if pairs[0][0] != one.name and number is not None else (i, number)
                yield *ends, interaction()
