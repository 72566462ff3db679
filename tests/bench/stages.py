"""python -m tests.bench.stages: processor time of a wall of 1000 blocks by stages of a step, nanoseconds a block.

    python -m tests.bench.stages nonsmooth|explicit [RUNS]

Every function that is a stage of a step is replaced by one that reads the time stamp counter before and after it. What
is compiled from that is kept in a folder of its own, which is removed. Numbers are the least of all runs, a block and
substep (a block and step with springs); the counter is taken to tick evenly, so they hold for an idle core.
"""

import os
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

WALL = Path(__file__).parents[2] / "scenarios" / "wall.toml"
SIZE = {"structures.0.rows": 25, "structures.0.columns": 40}
SCENES: dict[str, dict[str, object]] = {
    "nonsmooth": {"time.scheme": "nonsmooth", "time.step": 1e-3, "time.substeps": 4, "time.end": 0.5},
    "explicit": {"contact.stiffness_scale": 1e-3, "time.end": 0.1},
}
STAGES = {
    "nonsmooth": {
        "neighbours": "neighbours.update_pairs",
        "manifolds": "narrow_phase.find_manifolds",
        "gather": "step.gather",
        "pack": "packs.pack_all",
        "kick": "motion.kick motion.kick_warm",
        "position sweep, warm start": "passes.sweep",
        "drift": "motion.drift",
        "velocity sweeps": "passes.velocity_pass",
        "tally": "passes.tally_constraints",
        "unpack, place": "packs.unpack_all motion.place_all",
        "end, check": "step.end_interval",
    },
    "explicit": {
        "neighbours": "step.update_neighbours",
        "forces": "step.forces_of_group",
        "of these: pairs whose contacts change": "step.changed_forces",
        "kick, drift": "step.move_group",
        "pieces and damping of bodies": "inertia.share_out",
        "check": "step.check",
    },
}
WORD = ir.IntType(64)


def counter(builder: Any) -> Any:
    """Return the time stamp counter, in generated code."""
    return builder.call(builder.module.declare_intrinsic("llvm.readcyclecounter", (), ir.FunctionType(WORD, [])), [])


def _begin(_: Any) -> Any:
    return types.int64(), lambda _, builder, *__: counter(builder)


def adder(address: int) -> Any:
    """Return a function for kernels that adds the ticks since a start to the integer at an address."""

    def end(_: Any, start: Any) -> Any:  # noqa: ARG001 - numba matches arguments by name
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            place = builder.inttoptr(ir.Constant(WORD, address), WORD.as_pointer())
            builder.store(builder.add(builder.load(place), builder.sub(counter(builder), arguments[0])), place)
            return context.get_dummy_value()

        return types.none(types.int64), generate

    return intrinsic(end)


def clock() -> Any:
    """Return a compiled function that reads the counter."""
    start: Any = intrinsic(_begin)
    return njit(lambda: start())  # noqa: PLW0108 - an intrinsic is no function of Python


def timed(function: Any, address: int) -> Any:
    """Return a function for kernels that does the same, and adds the ticks it took to the integer at an address."""
    from blocksim.kernels.common.jit import OPTIONS  # noqa: PLC0415 - where compiled code is kept is decided first

    start: Any = intrinsic(_begin)
    stop = adder(address)

    def stage(*given: Any) -> Any:
        then = start()
        found = function(*given)
        stop(then)
        return found

    return njit(**OPTIONS, forceinline=True)(stage)


def replace_stages(scheme: str, spent: Any) -> None:
    """Have the step of a scheme, and nobody else, call timed stages; `spent` (int64) gets the ticks of each."""
    step = import_module(f"blocksim.kernels.{scheme}.step")
    homes = {"step": step}
    for place, names in enumerate(STAGES[scheme].values()):
        for name in names.split():
            module, _, function = name.partition(".")
            if module not in homes:
                homes[module] = ModuleType(module)
                vars(homes[module]).update(vars(getattr(step, module)))
                setattr(step, module, homes[module])
            home = homes[module]
            setattr(home, function, timed(getattr(home, function), spent.ctypes.data + 8 * place))


def measure(scheme: str, runs: int) -> None:
    """Write the time of every stage, of the least run."""
    import blocksim  # noqa: PLC0415 - likewise

    spent, now = np.zeros(len(STAGES[scheme]), np.int64), clock()
    replace_stages(scheme, spent)
    scenario = blocksim.load(WALL, SIZE | SCENES[scheme])
    blocksim.run(scenario, threads=1)
    rows = []
    for _ in range(runs):
        spent[:] = 0
        ticks, seconds, busy = now(), time.perf_counter(), time.process_time()
        summary = blocksim.run(scenario, threads=1).summary
        busy = time.process_time() - busy
        rate = (now() - ticks) / (time.perf_counter() - seconds)
        blocks = 1e-9 * summary.steps * 1000 * (4 if scheme == "nonsmooth" else 1)
        rows.append([*(spent / rate / blocks), busy / blocks])
    for name, least in zip([*STAGES[scheme], "run, with output"], np.min(rows, axis=0), strict=True):
        sys.stdout.write(f"| {name} | {least:.1f} |\n")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BLOCKSIM_CACHE_DIR"] = folder
        measure(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5)
