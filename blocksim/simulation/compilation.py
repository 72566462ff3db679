"""Compiling the kernels, apart from running them, so that a user can be told which is which."""

import functools
import time

from blocksim.kernels import jit
from blocksim.kernels.advance import advance
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.ledger import energy_row
from blocksim.world.build import build_world

SURFACE = "surface"  # all other models have boundary particles, and machine code of their own that serves them all
PARTICLES_MARK = "with-particles"

SMALLEST_SCENE = {
    "schema": 1,
    "name": "compile",
    "materials": {"any": {"density": 1000.0, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"any": {"width": 1.0, "height": 1.0, "length": 1.0, "material": "any"}},
    "bodies": [{"block": "any", "x": 0.0, "y": 0.5}],
}


def compile_kernels(model: str = SURFACE) -> float:
    """Compile the kernels for a contact model, or load them from the cache on disk; return the seconds it took.

    Works once a process.
    """
    return _compiled(has_particles=model != SURFACE)


def is_compiled(model: str = SURFACE) -> bool:
    """Tell whether the kernels for a contact model lie in the cache (or nothing has to be compiled)."""
    return jit.is_compiled() and (model == SURFACE or jit.is_marked(PARTICLES_MARK))


@functools.cache
def _compiled(*, has_particles: bool) -> float:
    began = time.perf_counter()
    contact = {"model": "kernel", "particle_spacing": 0.1} if has_particles else {}
    world = build_world(scenario_from_mapping({**SMALLEST_SCENE, "contact": contact}))
    advance(world, 0)
    energy_row(world)
    if has_particles:
        jit.mark(PARTICLES_MARK)
    return time.perf_counter() - began
