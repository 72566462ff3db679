"""What stands where in run.h5, and in which unit: groups named after H5MD.

Every data set says its unit in the attribute `unit`. `n_committed` is the number of frames that are whole: a reader
takes no more.
"""

from collections.abc import Iterable

from blocksim.world.systems.blocks import BLOCKS as _BLOCKS
from blocksim.world.systems.system import System

PARTICLES = "particles"
BLOCKS = f"{PARTICLES}/{_BLOCKS.name}"
OBSERVABLES = "observables"
COMMITTED = "n_committed"
STEP = f"{BLOCKS}/step"
TIME = f"{BLOCKS}/time"
SCENARIO_TEXT = "parameters/scenario"
OUTLINES = "outlines"  # of every element, where they are no rectangles: (b, k, 2), the last corner repeated

COUNTED_UNITS = {"contact_count": "1", "largest_overlap": "m"}
TEXT_UNIT = "TOML"


def places_of(system: System) -> list[str]:
    """Return the data sets of what frames keep of a system, in the order of its `quantities`."""
    return [f"{PARTICLES}/{system.name}/{one.name}" for one in system.quantities]


def measured_units(ledger: Iterable[str]) -> dict[str, str]:
    """Return the units of all that is measured at every frame, given the names of the energies."""
    return {**dict.fromkeys(ledger, "J"), **COUNTED_UNITS}
