"""Compiling the kernels, apart from running them, so that a user can be told which is which."""

import functools
import time

from blocksim.kernels.advance import advance
from blocksim.kernels.jit import is_compiled
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.ledger import energy_row
from blocksim.world.build import build_world

__all__ = ["compile_kernels", "is_compiled"]

SMALLEST_SCENE = {
    "schema": 1,
    "name": "compile",
    "materials": {"any": {"density": 1000.0, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"any": {"width": 1.0, "height": 1.0, "length": 1.0, "material": "any"}},
    "bodies": [{"block": "any", "x": 0.0, "y": 0.5}],
}


@functools.cache
def compile_kernels() -> float:
    """Compile all kernels, or load them from the cache on disk; return the seconds it took. Works once a process."""
    began = time.perf_counter()
    world = build_world(scenario_from_mapping(SMALLEST_SCENE))
    advance(world, 0)
    energy_row(world)
    return time.perf_counter() - began
