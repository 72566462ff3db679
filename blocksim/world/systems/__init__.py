"""The systems of scenes and how pairs of them act on one another; see blocksim/world/README.md.

A system of the user's choice is one file, and one line in `blocksim.scenario.models.base.SYSTEMS`;
every pair that can meet is one line in `INTERACTIONS`.
"""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Any

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.models.base import SYSTEMS
from blocksim.world.systems.blocks import BLOCKS, SUPPORTS
from blocksim.world.systems.soils import SOILS, soils_and
from blocksim.world.systems.system import System, SystemInScene

IN_WORLD = (BLOCKS, SUPPORTS)
"""Systems of every scene, whose arrays are the world, and whose steps, bounds and energies are the scheme's own."""
Function = Callable[..., None]
Interaction = Callable[[], Function] | None
"""Gives the compiled function of a pair (`Act` in kernels/common/systems.py); None: nothing happens between the two."""


def by_scheme() -> Function:
    """Stand for contacts that every scheme has in its own steps."""
    raise NotImplementedError("contacts of blocks and supports are stages of each scheme")


INTERACTIONS: dict[tuple[str, str], Interaction] = {
    (BLOCKS.name, BLOCKS.name): by_scheme,
    (BLOCKS.name, SUPPORTS.name): by_scheme,
    (SUPPORTS.name, SUPPORTS.name): None,
    (SOILS.name, SOILS.name): soils_and("soils"),
    (SOILS.name, BLOCKS.name): soils_and("blocks"),
    (SOILS.name, SUPPORTS.name): soils_and("supports"),
}
"""By the names of both; a system comes before blocks and supports, whose function gets the world as its partner."""


def systems_of(scenario: Scenario) -> tuple[System, ...]:
    """Return what the systems beside blocks and supports declare, in the order in which they are registered."""
    places = [table.declared_in.split(":") for name, table in SYSTEMS.items() if scenario.systems.get(name)]
    return tuple(getattr(import_module(module), declared) for module, declared in places)


def others_of(scenario: Scenario) -> tuple[SystemInScene, ...]:
    """Return the systems of a scenario beside blocks and supports, in the order in which they are registered."""
    return tuple(SystemInScene(system, system.elements(scenario)) for system in systems_of(scenario))


def largest_step(scenario: Scenario) -> float:
    """Return the longest step (s) that the systems beside blocks and supports admit; infinite where there are none."""
    bounds = (present.system.largest_step for present in others_of(scenario))
    return min((bound(scenario) for bound in bounds if bound is not None), default=float("inf"))


def warnings_of(scenario: Scenario) -> Iterator[str]:
    """Yield what is known to be off in the results of the systems beside blocks and supports."""
    for system in systems_of(scenario):
        if system.warnings is not None:
            yield from system.warnings(scenario)


def acts_of(systems: Sequence[System]) -> Iterator[tuple[int, int | None, Any]]:
    """Yield who acts on whom by which function: numbers of systems, None for blocks and supports.

    Raises InvalidInputError for a pair that is not modelled.
    """
    for i, one in enumerate(systems):
        partners: list[tuple[int | None, System]] = [(None, other) for other in IN_WORLD]
        for number, other in (*partners, *enumerate(systems[i:], i)):
            pair, turned = (one.name, other.name), (other.name, one.name)
            is_turned = pair not in INTERACTIONS
            if is_turned and turned not in INTERACTIONS:
                message = "cannot be in one scene: what happens between them is not modelled"
                raise InvalidInputError(f"{one.name} and {other.name} {message}")
            interaction = INTERACTIONS[turned if is_turned else pair]
            if interaction is not None:
                yield (number, i, interaction()) if is_turned and number is not None else (i, number, interaction())
