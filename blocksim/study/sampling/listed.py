"""Mode "list": all first values, all second values and so on."""

from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Design, Together, levels_of


def listed(sweep: Sweep) -> Design:
    """Return one case for every place in the lists, which are equally long."""
    return Together({key: levels_of(values) for key, values in sweep.vary.items()})
