"""Mode "normal": independent random draws, as for the scatter of measured values about their means.

Every key has its own stream, so keys may be added, removed or reordered and the values of the others stay; more
samples begin with the same ones.
"""

from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Design
from blocksim.study.sampling.draws import each_by_itself


def normal(sweep: Sweep) -> Design:
    """Return independent cases."""
    return each_by_itself(sweep, lambda stream, samples: stream.random(samples))
