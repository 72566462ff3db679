"""Methods of sensitivity analysis: a Method and an entry of METHODS each. All work in the unit cube, a dimension a key.

Morris: Morris' elementary effects, for many keys and few runs.

A trajectory goes through the unit cube on a grid of four levels and changes one key at a time by 2/3; what the result
changes by, divided by the step, is an elementary effect: a change per whole range of the key. Of more random
trajectories those are kept that lie far apart, by the distance of F. Campolongo, J. Cariboni, A. Saltelli, Environ.
Model. Softw. 22 (2007) 1509-1518, chosen one after the other: SALib's own search takes 15 s for 32 of 320.
M. D. Morris, Technometrics 33 (1991) 161-174.

Sobol indices: shares of the variance of a result that keys account for, alone and with all interactions.

Saltelli's design on a scrambled Sobol sequence, k + 2 runs a base sample of k keys; estimators of A. Saltelli et al.,
Comput. Phys. Commun. 181 (2010) 259-270, as SALib has them. Of an indicator (1 where the outcome is of a class, 0 where
not, with probability p) the variance is p (1 - p), and S1 the share of it that goes when the key is known: how much a
key alone decides whether the outcome is of the class.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded

Floats = NDArray[np.float64]
PURPOSE = "sensitivity"
LEVELS = 4
POOL = 10  # random trajectories for one that is kept
MOST_POINTS = 3000  # of the pool: all their distances are kept in memory
RESAMPLES = 500


@dataclass(frozen=True)
class Method:
    """A design of runs in blocks, and the numbers that come from the results of whole blocks.

    `columns` are the names of the numbers of every key, with what they mean. `rows_of_block` gives the runs of a block
    for k keys; blocks do not depend on one another, so some may be left out. `points` (keys, blocks, seed) gives the
    design, shape (blocks * rows, keys), in [0, 1]. `numbers` (points, results, seed) gives the columns, shape (keys,).
    """

    name: str
    title: str
    samples: int
    sample_word: str
    columns: Mapping[str, str]
    rows_of_block: Callable[[int], int]
    points: Callable[[int, int, int], Floats]
    numbers: Callable[[Floats, Floats, int], Mapping[str, Floats]]


def unit_cube(keys: int) -> dict[str, object]:
    """Return what SALib calls a problem."""
    return {"num_vars": keys, "names": [f"u{i}" for i in range(keys)], "bounds": [[0.0, 1.0]] * keys}


def _morris_points(keys: int, blocks: int, seed: int) -> Floats:
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


def _morris_numbers(points: Floats, results: Floats, seed: int) -> Mapping[str, Floats]:
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
    points=_morris_points,
    numbers=_morris_numbers,
)


def _sobol_points(keys: int, blocks: int, seed: int) -> Floats:
    sample = loaded("SALib.sample.sobol", PURPOSE).sample
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # no power of two: less even, and right anyway
        points = sample(unit_cube(keys), blocks, calc_second_order=False, seed=seed)
    return np.asarray(points, dtype=np.float64)


def _sobol_numbers(points: Floats, results: Floats, seed: int) -> Mapping[str, Floats]:
    analyse = loaded("SALib.analyze.sobol", PURPOSE).analyze
    seeded = seed + 1  # SALib takes 0 for no seed
    found = analyse(unit_cube(points.shape[1]), results, calc_second_order=False, num_resamples=RESAMPLES, seed=seeded)
    names = {"S1": "S1", "± S1": "S1_conf", "ST": "ST", "± ST": "ST_conf"}
    return {column: np.asarray(found[name], dtype=np.float64) for column, name in names.items()}


SOBOL = Method(
    name="sobol",
    title="Sobol, shares of the variance",
    samples=128,
    sample_word="base samples",
    columns={
        "S1": "share of the variance that is removed when the key is known",
        "± S1": "half-width of the 95 % interval of S1, bootstrapped",
        "ST": "share of the variance that remains when all other keys are known",
        "± ST": "half-width of the 95 % interval of ST, bootstrapped",
    },
    rows_of_block=lambda keys: keys + 2,
    points=_sobol_points,
    numbers=_sobol_numbers,
)


METHODS: dict[str, Method] = {method.name: method for method in (MORRIS, SOBOL)}
