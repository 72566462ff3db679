"""Sobol indices: shares of the variance of a result that keys account for, alone and with all interactions.

Saltelli's design on a scrambled Sobol sequence, k + 2 runs a base sample of k keys; estimators of A. Saltelli et al.,
Comput. Phys. Commun. 181 (2010) 259-270, as SALib has them. Of an indicator (1 where the outcome is of a class, 0 where
not, with probability p) the variance is p (1 - p), and S1 the share of it that goes when the key is known: how much a
key alone decides whether the outcome is of the class.
"""

import warnings
from collections.abc import Mapping

import numpy as np

from blocksim.extras import loaded
from blocksim.study.sensitivity.methods.method import PURPOSE, Floats, Method, unit_cube

RESAMPLES = 500


def _points(keys: int, blocks: int, seed: int) -> Floats:
    sample = loaded("SALib.sample.sobol", PURPOSE).sample
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # no power of two: less even, and right anyway
        points = sample(unit_cube(keys), blocks, calc_second_order=False, seed=seed)
    return np.asarray(points, dtype=np.float64)


def _numbers(points: Floats, results: Floats, seed: int) -> Mapping[str, Floats]:
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
        "S1": "share of the variance that goes when the key is known",
        "± S1": "half-width of the 95 % interval of S1, bootstrapped",
        "ST": "share of the variance that stays when all other keys are known",
        "± ST": "half-width of the 95 % interval of ST, bootstrapped",
    },
    rows_of_block=lambda keys: keys + 2,
    points=_points,
    numbers=_numbers,
)
