"""Build scenes of the explicit scheme that have further systems beside blocks and supports."""

from typing import Any

from blocksim.kernels.common.systems import Act, Coupled, Plan, plan
from blocksim.scenario import Scenario
from blocksim.world.systems import acts_of
from blocksim.world.systems.system import Present


def couple(scenario: Scenario, world: Any, others: tuple[Present, ...]) -> Coupled:
    """Return a world with further systems at time zero. Raises InvalidInputError for a pair that is not modelled."""
    systems = tuple(present.system for present in others)
    acts = tuple(Act(*one) for one in acts_of(systems))
    arrays = tuple(system.build(scenario) for system in systems if system.build is not None)
    stages = tuple(system.stages() for system in systems if system.stages is not None)
    energies = tuple(tuple(f"{system.name}_{name}" for name in system.energies) for system in systems)
    plan(arrays, Plan(stages, acts, energies))
    return Coupled(world, arrays)
