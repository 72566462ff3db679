"""What stands where in run.h5, and in which unit: groups named after H5MD.

Every data set says its unit in the attribute `unit`. `n_committed` is the number of frames that are whole: a reader
takes no more.
"""

from collections.abc import Iterable

from blocksim.simulation.recorder import MOTION

BLOCKS = "particles/blocks"
OBSERVABLES = "observables"
COMMITTED = "n_committed"
STEP = f"{BLOCKS}/step"
TIME = f"{BLOCKS}/time"
SCENARIO_TEXT = "parameters/scenario"

MOTION_UNITS = dict(zip(MOTION, ("m", "m", "rad", "m s-1", "m s-1", "rad s-1"), strict=True))
COUNTED_UNITS = {"contact_count": "1", "largest_overlap": "m"}
BODY_UNITS = {"size_x": "m", "size_y": "m", "depth": "m", "mass": "kg", "inertia": "kg m2"}
TEXT_UNIT = "TOML"


def measured_units(ledger: Iterable[str]) -> dict[str, str]:
    """Return the units of all that is measured at every frame, given the names of the energies."""
    return {**dict.fromkeys(ledger, "J"), **COUNTED_UNITS}
