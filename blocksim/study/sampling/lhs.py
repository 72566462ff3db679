"""Mode "lhs": Latin hypercube sampling, one value of every key in each of `samples` equally likely intervals.

McKay, Beckman and Conover, Technometrics 21 (1979) 239-245. Every key has its own stream, so keys may be added,
removed or reordered and the values of the others stay. Another number of samples gives other values.
"""

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Design
from blocksim.study.sampling.draws import each_by_itself


def lhs(sweep: Sweep) -> Design:
    """Return the cases of a Latin hypercube; raises UnavailableError without scipy."""
    return each_by_itself(sweep, _strata)


def _strata(stream: np.random.Generator, samples: int) -> NDArray[np.float64]:
    """Return a place in each interval, in random order."""
    column: NDArray[np.float64] = (
        loaded("scipy.stats.qmc", "sampled sweeps").LatinHypercube(1, seed=stream).random(samples)[:, 0]
    )
    return column
