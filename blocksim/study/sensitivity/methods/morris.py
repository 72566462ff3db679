"""Morris' elementary effects, for many keys and few runs.

A trajectory goes through the unit cube on a grid of four levels and changes one key at a time by 2/3; what the result
changes by, divided by the step, is an elementary effect: a change per whole range of the key. Of more random
trajectories those are kept that lie far apart, by the distance of F. Campolongo, J. Cariboni, A. Saltelli, Environ.
Model. Softw. 22 (2007) 1509-1518, chosen one after the other: SALib's own search takes 15 s for 32 of 320.
M. D. Morris, Technometrics 33 (1991) 161-174.
"""

from collections.abc import Mapping

import numpy as np

from blocksim.extras import loaded
from blocksim.study.sensitivity.methods.method import PURPOSE, Floats, Method, unit_cube

LEVELS = 4
POOL = 10  # random trajectories for one that is kept
MOST_POINTS = 3000  # of the pool: all their distances are kept in memory
RESAMPLES = 500


def _points(keys: int, blocks: int, seed: int) -> Floats:
    sample = loaded("SALib.sample.morris", PURPOSE).sample
    pool = max(blocks, min(POOL * blocks, MOST_POINTS // (keys + 1)))
    points = np.asarray(sample(unit_cube(keys), pool, num_levels=LEVELS, seed=seed), dtype=np.float64)
    trajectories = points.reshape(pool, keys + 1, keys)
    return trajectories[_far_apart(trajectories, blocks)].reshape(-1, keys)


def _far_apart(trajectories: Floats, count: int) -> list[int]:
    """Return the numbers of trajectories, each the farthest from those before; shape (pool, points, keys).

    The distance of two is the sum over all pairs of their points; squares are added up.
    """
    flat = trajectories.reshape(-1, trajectories.shape[2])
    squares = np.sum(flat**2, axis=1)
    apart = np.sqrt(np.maximum(squares[:, None] + squares - 2.0 * flat @ flat.T, 0.0))
    pool, points = trajectories.shape[:2]
    distances = apart.reshape(pool, points, pool, points).sum(axis=(1, 3))
    np.fill_diagonal(distances, 0.0)
    chosen = [int(np.argmax(distances.max(axis=1)))]
    while len(chosen) < count:
        sums = np.sum(distances[chosen] ** 2, axis=0)
        sums[chosen] = -1.0
        chosen.append(int(np.argmax(np.round(sums, 9))))  # equal sums are equal on every machine
    return chosen


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
