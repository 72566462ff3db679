"""Mode "sobol": points of a scrambled Sobol sequence, one dimension a key in the order of the file.

Joe and Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654; scrambled as by Matousek, J. Complexity 14 (1998) 527-556, by
scipy. A key added at the end, and more samples, leave what was there; a key added before others moves these to the
next dimension. The points are balanced where their number is a power of two.
"""

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Design
from blocksim.study.sampling.draws import from_places, generator

DIMENSIONS = 128
"""Dimensions that are scrambled, however few are used: so those in use do not depend on how many they are."""
BITS = 30
CHUNK = 4096
"""Points made at a time; a power of two."""


def sobol(sweep: Sweep) -> Design:
    """Return the first points of the sequence; raises UnavailableError without scipy."""
    points = _points(sweep.seed, sweep.samples, len(sweep.vary))
    return from_places(sweep, {key: points[:, column] for column, key in enumerate(sweep.vary)})


def _points(seed: int, samples: int, dimensions: int) -> NDArray[np.float64]:
    """Return points in the middles of the finest cells of the net, shape (samples, dimensions)."""
    sequence = loaded("scipy.stats.qmc", "sampled sweeps").Sobol(
        DIMENSIONS, scramble=True, bits=BITS, seed=generator(seed, "sobol")
    )
    size = min(CHUNK, 1 << (samples - 1).bit_length())
    chunks = [sequence.random(size)[:, :dimensions].copy() for _ in range(0, samples, size)]
    return np.concatenate(chunks)[:samples] + 0.5 ** (BITS + 1)
