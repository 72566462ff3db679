"""Simulate collapses of rigid blocks and compare them with measurements.

from blocksim import load, run, sweep, compare
result = run(load("scenarios/three_blocks.toml"))
print(result.final, compare(result).to_frame())
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blocksim.scenario import load_scenario as load
    from blocksim.study.judge import compare
    from blocksim.study.many import sweep
    from blocksim.study.single import run

__version__ = "0.1.0"
__all__ = ["compare", "load", "run", "sweep"]

# found when first asked for, so that `blocksim --help` need not wait for numba and pandas
_HOMES = {
    "load": ("blocksim.scenario", "load_scenario"),
    "run": ("blocksim.study.single", "run"),
    "compare": ("blocksim.study.judge", "compare"),
    "sweep": ("blocksim.study.many", "sweep"),
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        message = f"module 'blocksim' has no attribute '{name}'"
        raise AttributeError(message)
    module, attribute = _HOMES[name]
    return getattr(import_module(module), attribute)
