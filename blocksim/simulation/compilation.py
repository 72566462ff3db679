"""Compiling the kernels, apart from running them, so that users see which of them takes the time."""

import functools
import time
from collections.abc import Sequence

from blocksim.errors import OutputError
from blocksim.kernels.common import compiler, jit
from blocksim.scenario import PlacedBody, Scenario, placement, scenario_from_mapping
from blocksim.simulation.schemes import SCHEMES, build_scene, measure_row
from blocksim.simulation.team import ALONE

DEFAULT = "surface"  # the set without a mark of its own in the cache
SMALLEST_SCENE = {
    "schema": 1,
    "name": "compile",
    "materials": {"any": {"density": 1000.0, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"any": {"width": 1.0, "height": 1.0, "length": 1.0, "material": "any"}},
    "bodies": [{"block": "any", "x": 0.0, "y": 0.5}],
}


def kernels_of(scenario: Scenario, placed: Sequence[PlacedBody] | None = None) -> str:
    """Return which set of kernels a scenario needs; `placed` are its bodies, where they are known."""
    scheme = SCHEMES[scenario.time.scheme]
    kernels = scheme.kernels(scenario.contact.model)
    if placement.has_outlines(scenario):
        kernels = scheme.of_outlines.get(kernels, kernels)
    return scheme.kernel_variant(kernels, scenario, placed)


@functools.cache
def compile_kernels(kernels: str = DEFAULT) -> float:
    """Compile a set of kernels, or load it from the cache on disk; return the seconds it took.

    Works once a process. Raises OutputError where the disk of the cache fails.
    """
    began = time.perf_counter()
    try:
        with compiler.compiling():
            changes = next(
                scheme.kernel_sets.get(kernels, {"time": {"scheme": scheme.name}})
                for scheme in SCHEMES.values()
                if kernels in (*scheme.kernel_sets, scheme.kernels(""))
            )
            scene, _ = ALONE.advance(build_scene(scenario_from_mapping({**SMALLEST_SCENE, **changes})), 0)
            measure_row(scene)
            if kernels != DEFAULT:
                jit.mark(kernels)
    except OSError as error:
        raise OutputError(
            f"{jit.cache_folder()}: the compiled solver cannot be stored there: {error.strerror or error}; "
            "free some space, or set BLOCKSIM_CACHE_DIR to a folder on another disk"
        ) from error
    return time.perf_counter() - began


def is_compiled(kernels: str = DEFAULT) -> bool:
    """Return True if a set of kernels lies in the cache (or nothing has to be compiled)."""
    return jit.is_compiled() if kernels == DEFAULT else jit.is_marked(kernels)
