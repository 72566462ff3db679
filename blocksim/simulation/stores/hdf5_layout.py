"""What stands where in run.h5, and in which unit: groups named after H5MD.

Every data set says its unit in the attribute `unit`. `n_committed` is the number of frames that are whole: a reader
takes no more.
"""

from blocksim.kernels.energy import LEDGER_ROW
from blocksim.simulation.recorder import MOTION

BLOCKS = "particles/blocks"
OBSERVABLES = "observables"
COMMITTED = "n_committed"
STEP = f"{BLOCKS}/step"
TIME = f"{BLOCKS}/time"
SCENARIO_TEXT = "parameters/scenario"

MOTION_UNITS = dict(zip(MOTION, ("m", "m", "rad", "m s-1", "m s-1", "rad s-1"), strict=True))
MEASURED_UNITS = {**dict.fromkeys(LEDGER_ROW, "J"), "contact_count": "1", "largest_overlap": "m"}
BODY_UNITS = {"size_x": "m", "size_y": "m", "depth": "m", "mass": "kg", "inertia": "kg m2"}
TEXT_UNIT = "TOML"
