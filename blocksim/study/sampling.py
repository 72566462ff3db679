"""Cases whose values are drawn, and the modes of a sweep by the word that the file has for them.

A place in the unit interval becomes a value by the inverse of the key's distribution function: one line of QUANTILES a
distribution. Numbers are kept to 12 digits, so that mathematical libraries that differ in the last bit give the same.

lhs     Latin hypercube, one value of every key in each of `samples` equally likely intervals (McKay, Beckman and
        Conover, Technometrics 21 (1979) 239-245). Every key has its own stream, so keys may be added, removed or
        reordered and the values of the others stay. Another number of samples gives other values.
sobol   points of a scrambled Sobol sequence, one dimension a key in the order of the file (Joe and Kuo, SIAM J. Sci.
        Comput. 30 (2008) 2635-2654; scrambled as by Matousek, J. Complexity 14 (1998) 527-556, by scipy). A key added
        at the end, and more samples, leave what was there; a key added before others moves these to the next
        dimension. The points are balanced where their number is a power of two.
normal  independent random draws, as for the scatter of measured values about their means, each key from its own stream;
        more samples begin with the same ones.
"""

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.scenario import Sweep
from blocksim.scenario.keys import format_key, parse_key
from blocksim.scenario.models.variation import Normal, Uniform, Variation, rounded, written
from blocksim.study.design import Design, Together, grid, listed, table

Places = NDArray[np.float64]
"""Numbers u with 0 < u < 1, shape (samples,)."""
LEAST = 2.0**-54
"""Places stay this far away from 0, and one rounding from 1: the normal distribution is infinite there."""
WORD_BYTES = 4
DIMENSIONS = 128
"""Dimensions that are scrambled, however few are used: so those in use do not depend on how many they are."""
BITS = 30
CHUNK = 4096
"""Points made at a time; a power of two."""


def drawn(values: Variation, places: Places) -> Sequence[object]:
    """Return the value at each place: numbers in SI, angles as texts in rad, levels as they were written."""
    if isinstance(values, tuple):  # equally likely levels
        return [values[index] for index in np.minimum(places * len(values), len(values) - 1).astype(int).tolist()]
    low, high = values.low, values.high
    numbers = (min(max(rounded(number), low), high) for number in QUANTILES[type(values)](values, places).tolist())
    return [written(number, angle=values.angle) for number in numbers]


def uniform_quantile(values: Uniform, places: Places) -> Places:
    """Invert the uniform distribution of the values, or of their logarithms."""
    if values.scale == "log":
        return np.asarray(values.low * np.exp(places * np.log(values.high / values.low)))
    return values.low + places * (values.high - values.low)


def normal_quantile(values: Normal, places: Places) -> Places:
    """Invert the normal distribution, cut at its bounds (scipy.stats.truncnorm)."""
    stats = loaded("scipy.stats", "sampled sweeps")
    low, high = ((bound - values.mean) / values.sd for bound in (values.low, values.high))
    if np.isinf(low) and np.isinf(high):
        return np.asarray(stats.norm.ppf(places, values.mean, values.sd))
    return np.asarray(stats.truncnorm.ppf(places, low, high, values.mean, values.sd))


QUANTILES: dict[type, Callable[[Any, Places], Places]] = {
    Uniform: uniform_quantile,
    Normal: normal_quantile,
}


def generator(seed: int, text: str) -> np.random.Generator:
    """Return the stream of a seed and a text; streams of different texts are independent of one another."""
    digest = hashlib.sha256(text.encode()).digest()
    words = [int.from_bytes(digest[i : i + WORD_BYTES], "little") for i in range(0, len(digest), WORD_BYTES)]
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *words])))


def open_interval(places: Places) -> Places:
    """Move places at 0 and 1 inside by less than anybody can see."""
    return np.clip(places, LEAST, 1.0 - 2.0 * LEAST)


def _streams(sweep: Sweep) -> list[np.random.Generator]:
    """Return the stream of every key, however its quotes are set."""
    return [generator(sweep.seed, format_key(parse_key(key))) for key in sweep.vary]


def lhs(sweep: Sweep) -> Places:
    """Return a place in each of equally likely intervals, in random order, for every key."""
    hypercube = loaded("scipy.stats.qmc", "sampled sweeps").LatinHypercube
    return np.stack([hypercube(1, seed=stream).random(sweep.samples)[:, 0] for stream in _streams(sweep)])


def normal(sweep: Sweep) -> Places:
    """Return independent places."""
    return np.stack([stream.random(sweep.samples) for stream in _streams(sweep)])


def sobol(sweep: Sweep) -> Places:
    """Return the first points of the sequence, in the middles of the finest cells of the net."""
    sequence = loaded("scipy.stats.qmc", "sampled sweeps").Sobol(
        DIMENSIONS, scramble=True, bits=BITS, seed=generator(sweep.seed, "sobol")
    )
    size = min(CHUNK, 1 << (sweep.samples - 1).bit_length())
    chunks = [sequence.random(size)[:, : len(sweep.vary)].copy() for _ in range(0, sweep.samples, size)]
    return np.asarray(np.concatenate(chunks)[: sweep.samples].T + 0.5 ** (BITS + 1))


GIVEN: dict[str, Callable[[Sweep], Design]] = {"grid": grid, "list": listed, "table": table}
DRAWN: dict[str, Callable[[Sweep], Places]] = {"lhs": lhs, "sobol": sobol, "normal": normal}
"""Modes of sweeps; those that draw give places of the unit cube, shape (keys, samples)."""


def design_of(sweep: Sweep) -> Design:
    """Return the settings of all cases, the same for the same sweep on every machine.

    Raises what reading a table raises, UnavailableError where a sampled mode has no scipy.
    """
    if sweep.mode in GIVEN:
        return GIVEN[sweep.mode](sweep)
    places = open_interval(DRAWN[sweep.mode](sweep))
    return Together(
        {key: drawn(values, column) for (key, values), column in zip(sweep.vary.items(), places, strict=True)}
    )


def remarks(sweep: Sweep) -> list[str]:
    """Return what whoever chose this sweep may want to know."""
    if sweep.mode == "sobol" and sweep.samples & (sweep.samples - 1):
        below = 1 << (sweep.samples.bit_length() - 1)
        return [f"{sweep.samples} Sobol points are not balanced; {below} or {2 * below} are"]
    return []
