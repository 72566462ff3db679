"""The time loop and what it leaves behind: frames, final table, summary, and the folder that keeps them."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blocksim.simulation.ensemble import MemberFailure, run_ensemble, run_in_batches
    from blocksim.simulation.loop import Progress, Watcher
    from blocksim.simulation.results import Result, Summary, read_result, renew_copies
    from blocksim.simulation.run import simulate, simulate_into
    from blocksim.simulation.trajectory import Frames

__all__ = [
    "Frames",
    "MemberFailure",
    "Progress",
    "Result",
    "Summary",
    "Watcher",
    "read_result",
    "renew_copies",
    "run_ensemble",
    "run_in_batches",
    "simulate",
    "simulate_into",
]

# found when first asked for, so that stored results can be read without waiting for numba and the kernels
_HOMES = {
    "ensemble": ("MemberFailure", "run_ensemble", "run_in_batches"),
    "trajectory": ("Frames",),
    "loop": ("Progress", "Watcher"),
    "results": ("Result", "Summary", "read_result", "renew_copies"),
    "run": ("simulate", "simulate_into"),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"blocksim.simulation.{module}"), name)
    raise AttributeError(f"module 'blocksim.simulation' has no attribute '{name}'")
