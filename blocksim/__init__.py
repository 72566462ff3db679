"""Simulate collapses of rigid blocks and compare them with measurements.

>>> from blocksim import compare, load, run
>>> result = run(load("scenarios/three_blocks.toml", {"contact.stiffness_scale": 0.01}))
>>> result.final.round(1)[["block", "x_mm", "rotation_deg"]].to_string(index=False).splitlines()[-1].split()
['3', '130.7', '-90.0']
>>> compare(result).inside
True

Scenarios: `load` (a file or dictionaries), `replace` (change keys, validated). Runs: `run`, `open_run`; a result has
`final`, `frames`, `to_frame()`, `to_xarray()`. A `Model` is what a scenario describes, a `Simulation` is one under way,
stepped by hand. Studies: `sweep`, `open_sweep`, `limit`, `limit_curve`, `static_limit`, `capacity`, `fragility`,
`calibrate`, `sensitivity`, `converge`. Judging: `compare`. Looking: `plot`, `animate`, `report`. Functions have the
options of the command of the same name.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from blocksim.notebook import DISPLAYS

if TYPE_CHECKING:
    from blocksim.scenario import Model, load_scenario as load, replace_values as replace
    from blocksim.simulation.loop import Simulation
    from blocksim.study.calibrate import calibrate
    from blocksim.study.capacity import capacity
    from blocksim.study.compare import compare
    from blocksim.study.converge import converge
    from blocksim.study.fragility import fragility
    from blocksim.study.limit import limit, limit_curve
    from blocksim.study.manifest import read_sweep as open_sweep
    from blocksim.study.pictures import animate, plot
    from blocksim.study.report import report
    from blocksim.study.run import open_run, run
    from blocksim.study.sensitivity import sensitivity
    from blocksim.study.static_limit import static_limit
    from blocksim.study.sweep import sweep

__version__ = "0.3.0"
__all__ = [
    "Model",
    "Simulation",
    "animate",
    "calibrate",
    "capacity",
    "compare",
    "converge",
    "fragility",
    "limit",
    "limit_curve",
    "load",
    "open_run",
    "open_sweep",
    "plot",
    "replace",
    "report",
    "run",
    "sensitivity",
    "static_limit",
    "sweep",
]

# found when first asked for, so that `blocksim --help` need not wait for numba and pandas; as blocksim.study.NAME has
# them, or another module, under another name
_HOMES = {
    "Model": ("scenario", "Model"),
    "Simulation": ("simulation.loop", "Simulation"),
    "animate": ("study.pictures", "animate"),
    "limit_curve": ("study.limit", "limit_curve"),
    "load": ("scenario", "load_scenario"),
    "open_run": ("study.run", "open_run"),
    "open_sweep": ("study.manifest", "read_sweep"),
    "plot": ("study.pictures", "plot"),
    "replace": ("scenario", "replace_values"),
}

DISPLAYS.append(lambda: import_module("blocksim.study.displays"))


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'blocksim' has no attribute '{name}'")
    module, attribute = _HOMES.get(name, (f"study.{name}", name))
    return getattr(import_module(f"blocksim.{module}"), attribute)


def __dir__() -> list[str]:
    """Return what `help(blocksim)` and completion show: the functions for users, and the version."""
    return sorted([*__all__, "__version__"])
