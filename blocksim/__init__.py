"""Simulate collapses of rigid blocks and compare them with measurements.

>>> from blocksim import compare, load, run
>>> result = run(load("scenarios/three_blocks.toml", {"contact.stiffness_scale": 0.01}))
>>> result.final.round(1)[["block", "x_mm", "rotation_deg"]].to_string(index=False).splitlines()[-1].split()
['3', '131.2', '-90.0']
>>> compare(result).inside
True

Scenarios: `load` (a file or dictionaries), `replace` (change keys, validated). Runs: `run`, `open_run`; a result has
`final`, `frames`, `to_frame()`, `to_xarray()`. Studies: `sweep`, `open_sweep`, `calibrate`, `sensitivity`, `converge`.
Judging: `compare`. Looking: `plot`, `animate`, `report`. Functions have the options of the command of the same name.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blocksim.scenario import load_scenario as load
    from blocksim.scenario import replace_values as replace
    from blocksim.study.converge import converge
    from blocksim.study.judge import compare
    from blocksim.study.many import sweep
    from blocksim.study.scripting import calibrate, sensitivity
    from blocksim.study.showing import animate, plot, report
    from blocksim.study.single import open_run, run
    from blocksim.study.table import read_sweep as open_sweep

__version__ = "0.1.0"
__all__ = [
    "animate",
    "calibrate",
    "compare",
    "converge",
    "load",
    "open_run",
    "open_sweep",
    "plot",
    "replace",
    "report",
    "run",
    "sensitivity",
    "sweep",
]

# found when first asked for, so that `blocksim --help` need not wait for numba and pandas
_HOMES = {
    "animate": ("blocksim.study.showing", "animate"),
    "calibrate": ("blocksim.study.scripting", "calibrate"),
    "compare": ("blocksim.study.judge", "compare"),
    "converge": ("blocksim.study.converge", "converge"),
    "load": ("blocksim.scenario", "load_scenario"),
    "open_run": ("blocksim.study.single", "open_run"),
    "open_sweep": ("blocksim.study.table", "read_sweep"),
    "plot": ("blocksim.study.showing", "plot"),
    "replace": ("blocksim.scenario", "replace_values"),
    "report": ("blocksim.study.showing", "report"),
    "run": ("blocksim.study.single", "run"),
    "sensitivity": ("blocksim.study.scripting", "sensitivity"),
    "sweep": ("blocksim.study.many", "sweep"),
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        message = f"module 'blocksim' has no attribute '{name}'"
        raise AttributeError(message)
    module, attribute = _HOMES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    """Return what `help(blocksim)` and completion show."""
    return sorted({*globals(), *__all__})
