"""Morris' elementary effects, for many keys and few runs.

A trajectory goes through the unit cube on a grid of four levels and changes one key at a time by 2/3; what the result
changes by, divided by the step, is an elementary effect: a change per whole range of the key. Of ten times as many
random trajectories those are kept that lie farthest apart. M. D. Morris, Technometrics 33 (1991) 161-174;
F. Campolongo, J. Cariboni, A. Saltelli, Environ. Model. Softw. 22 (2007) 1509-1518; M. V. Ruano et al., ibid. 37 (2012)
103-109.
"""

from collections.abc import Mapping

import numpy as np

from blocksim.study.extras import loaded
from blocksim.study.sensitivity.methods.method import PURPOSE, Floats, Method, unit_cube

LEVELS = 4
POOL = 10  # random trajectories for one that is kept
LEAST = 2  # trajectories that can be compared
RESAMPLES = 500


def _points(keys: int, blocks: int, seed: int) -> Floats:
    sample = loaded("SALib.sample.morris", PURPOSE).sample
    pool, chosen = max(POOL * blocks, LEAST + 1), max(blocks, LEAST)
    points = sample(unit_cube(keys), pool, num_levels=LEVELS, optimal_trajectories=chosen, seed=seed)
    return np.asarray(points, dtype=np.float64)


def _numbers(points: Floats, results: Floats, seed: int) -> Mapping[str, Floats]:
    analyse = loaded("SALib.analyze.morris", PURPOSE).analyze
    found = analyse(unit_cube(points.shape[1]), points, results, num_levels=LEVELS, num_resamples=RESAMPLES, seed=seed)
    names = {"mu*": "mu_star", "±": "mu_star_conf", "mu": "mu", "sigma": "sigma"}
    return {column: np.asarray(found[name], dtype=np.float64) for column, name in names.items()}


MORRIS = Method(
    name="morris",
    title="Morris, elementary effects",
    samples=16,
    sample_word="trajectories",
    columns={
        "mu*": "mean size of the change per whole range of the key",
        "±": "half-width of the 95 % interval of mu*, bootstrapped",
        "mu": "mean change per whole range, with its sign",
        "sigma": "standard deviation of the changes: curvature, or interaction with other keys",
    },
    rows_of_block=lambda keys: keys + 1,
    points=_points,
    numbers=_numbers,
)
