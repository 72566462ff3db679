"""Mode "grid": every combination of the values."""

from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Combinations, Design, levels_of


def grid(sweep: Sweep) -> Design:
    """Return all combinations; the last key changes fastest."""
    return Combinations({key: levels_of(values) for key, values in sweep.vary.items()})
