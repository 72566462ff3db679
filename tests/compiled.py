"""python -m tests.compiled: compile all kernels as tests call them, so that workers find them in the cache.

Workers that start together would each compile the same kernels. Here one process compiles a set of them, and two run at
a time; where all are in the cache already it says so at once. Kernels that only tests call compile as they are called.
"""

import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from blocksim.kernels.common import jit
from blocksim.kernels.common.compiler import compiling
from blocksim.scenario import Model

JOBS = 2
DONE = "sets-of-tests"  # the mark of a cache that has all sets
SPH, SOIL = "sph", "soil"
# those that take longest first, and no two at a time that have much in common
SETS = (
    "outlines-in-rounds",
    "surface",
    "nonsmooth-in-rounds",
    SOIL,
    "outlines",
    "outlines-with-springs",
    "nonsmooth",
    "with-particles",
    SPH,
)


def compile_set(name: str) -> None:
    """Compile one set of kernels, and what runs ensembles and teams of threads."""
    with compiling():
        if name == SPH:
            _use_particles()
        elif name == SOIL:
            _run_soil()
        else:
            _run_smallest(name)


def _run_smallest(name: str) -> None:
    from blocksim.scenario import scenario_from_mapping  # noqa: PLC0415
    from blocksim.simulation import run_ensemble  # noqa: PLC0415
    from blocksim.simulation.schemes import (  # noqa: PLC0415  # noqa: PLC0415
        SCHEMES,
        SMALLEST_SCENE,
        Team,
        build,
        compile_kernels,
    )
    from blocksim.simulation.schemes.explicit import PARTICLES, SURFACE_OF_OUTLINES  # noqa: PLC0415

    compile_kernels(name)
    if name in {PARTICLES, SURFACE_OF_OUTLINES}:  # few tests have ensembles and teams of those, and compile them
        return
    change: dict[str, Any] = next(dict(one.kernel_sets[name]) for one in SCHEMES.values() if name in one.kernel_sets)
    scene = scenario_from_mapping({**SMALLEST_SCENE, **change, "time": {**change.get("time", {}), "end": 1e-4}})
    with Team(2) as team:
        team.advance(build(Model(scene)), 1)
    run_ensemble([scene, scene])


def _run_soil() -> None:
    from blocksim.simulation.schemes import ALONE, Team, build, measure_row  # noqa: PLC0415  # noqa: PLC0415
    from tests.soils import column, scene  # noqa: PLC0415

    soil = scene(column(0.05, 0.05, 0.005), end=1e-4)
    measure_row(ALONE.advance(build(Model(soil)), 1)[0])
    with Team(2) as team:
        team.advance(build(Model(soil)), 1)


def _use_particles() -> None:
    from blocksim.kernels.sph.fields import Particles, gradient, interpolate  # noqa: PLC0415

    two = Particles([[0.0, 0.0], [0.1, 0.0]], mass=1.0, density=1000.0, smoothing_length=0.1)
    interpolate(two, [1.0, 2.0], [[0.05, 0.0]])
    gradient(two, [1.0, 2.0])


def main() -> None:
    """Compile all sets."""
    began = time.perf_counter()
    if jit.is_marked(DONE):
        print("kernels are in the cache")  # noqa: T201 - as below
        return
    with ProcessPoolExecutor(JOBS, mp_context=multiprocessing.get_context("spawn"), max_tasks_per_child=1) as pool:
        list(pool.map(compile_set, SETS))
    jit.mark(DONE)
    print(f"kernels are in the cache after {time.perf_counter() - began:.0f} s")  # noqa: T201 - for people who wait


if __name__ == "__main__":
    main()
