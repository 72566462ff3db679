"""Compiling the kernels, apart from running them, so that users see which of them takes the time."""

import functools
import time
from collections.abc import Sequence

from blocksim.errors import OutputError
from blocksim.kernels.common import jit
from blocksim.kernels.common.compiler import compiling
from blocksim.scenario import PlacedBody, Scenario, scenario_from_mapping
from blocksim.scenario.placement import has_outlines
from blocksim.simulation.schemes import SCHEMES, build_scene, measured_row
from blocksim.simulation.schemes.explicit import PARTICLES, SURFACE
from blocksim.simulation.schemes.nonsmooth import RIGID
from blocksim.simulation.team import ALONE
from blocksim.world.nonsmooth import may_rebound_in_rounds

OUTLINED = "outlines"  # rigid contacts of blocks that are no rectangles
SPRUNG_OUTLINES = "outlines-with-springs"  # the same with springs
OF_OUTLINES = {RIGID: OUTLINED, SURFACE: SPRUNG_OUTLINES}
IN_ROUNDS = {RIGID: "nonsmooth-in-rounds", OUTLINED: "outlines-in-rounds"}  # where impacts follow from one another
NONSMOOTH = {"scheme": "nonsmooth"}
TWO = [{"block": "any", "x": x, "y": 0.5} for x in (0.0, 5.0)]  # impacts of a single block are always in rounds
POLYGON = {"any": {"sides": 4, "radius": 0.5, "depth": 1.0, "material": "any"}}

CHANGES: dict[str, dict[str, object]] = {  # in the smallest scene, so that it needs them
    SURFACE: {},
    PARTICLES: {"contact": {"model": "kernel", "particle_spacing": 0.1}},  # the code serves all models with particles
    RIGID: {"time": NONSMOOTH, "contact": {"restitution": 0.0}, "bodies": TWO},
    OUTLINED: {"time": NONSMOOTH, "contact": {"restitution": 0.0}, "blocks": POLYGON, "bodies": TWO},
    IN_ROUNDS[RIGID]: {"time": NONSMOOTH, "contact": {"restitution": 0.5}},
    IN_ROUNDS[OUTLINED]: {"time": NONSMOOTH, "contact": {"restitution": 0.5}, "blocks": POLYGON},
    SPRUNG_OUTLINES: {"blocks": POLYGON},
}

SMALLEST_SCENE = {
    "schema": 1,
    "name": "compile",
    "materials": {"any": {"density": 1000.0, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"any": {"width": 1.0, "height": 1.0, "length": 1.0, "material": "any"}},
    "bodies": [{"block": "any", "x": 0.0, "y": 0.5}],
}


def kernels_of(scenario: Scenario, placed: Sequence[PlacedBody] | None = None) -> str:
    """Return which set of kernels a scenario needs; `placed` are its bodies, where they are known."""
    kernels = kernel_set(scenario.time.scheme, scenario.contact.model)
    if has_outlines(scenario):
        kernels = OF_OUTLINES.get(kernels, kernels)
    return IN_ROUNDS[kernels] if kernels in IN_ROUNDS and may_rebound_in_rounds(scenario, placed) else kernels


def kernel_set(scheme: str, model: str) -> str:
    """Return which set of kernels a stepping scheme with a contact model needs."""
    return SCHEMES[scheme].kernels(model)


@functools.cache
def compile_kernels(kernels: str = SURFACE) -> float:
    """Compile a set of kernels, or load it from the cache on disk; return the seconds it took.

    Works once a process. Raises OutputError where the disk of the cache fails.
    """
    began = time.perf_counter()
    try:
        with compiling():
            _compile(kernels)
    except OSError as error:
        message = (
            f"{jit.cache_folder()}: the compiled solver cannot be stored there: {error.strerror or error}; "
            "free some space, or set BLOCKSIM_CACHE_DIR to a folder on another disk"
        )
        raise OutputError(message) from error
    return time.perf_counter() - began


def compile_systems(scenario: Scenario) -> None:
    """Compile what a scenario with systems beside blocks and supports needs as well, for these systems."""
    if scenario.systems:
        with compiling():
            measured_row(ALONE.advance(build_scene(scenario), 0)[0])


def _compile(kernels: str) -> None:
    change = CHANGES.get(kernels, {"time": {"scheme": kernels}})  # a scheme beside the usual ones has its own set
    scene, _ = ALONE.advance(build_scene(scenario_from_mapping({**SMALLEST_SCENE, **change})), 0)
    measured_row(scene)
    if kernels != SURFACE:
        jit.mark(kernels)


def is_compiled(kernels: str = SURFACE) -> bool:
    """Return True if a set of kernels lies in the cache (or nothing has to be compiled)."""
    return jit.is_compiled() if kernels == SURFACE else jit.is_marked(kernels)
