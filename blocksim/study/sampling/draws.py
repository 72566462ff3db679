"""What all sampled modes share: a stream of random numbers a key, and columns of values."""

import hashlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Sweep
from blocksim.scenario.keys import format_key, parse_key
from blocksim.study.sampling.design import Design, Together
from blocksim.study.sampling.distributions import Places, drawn

LEAST = 2.0**-54
"""Places stay this far away from 0, and one rounding from 1: the normal distribution is infinite there."""
WORD_BYTES = 4


def generator(seed: int, text: str) -> np.random.Generator:
    """Return the stream of a seed and a text; streams of different texts are independent of one another."""
    digest = hashlib.sha256(text.encode()).digest()
    words = [int.from_bytes(digest[i : i + WORD_BYTES], "little") for i in range(0, len(digest), WORD_BYTES)]
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *words])))


def key_generator(seed: int, key: str) -> np.random.Generator:
    """Return the stream of a key, however its quotes are set."""
    return generator(seed, format_key(parse_key(key)))


def each_by_itself(sweep: Sweep, draw: Callable[[np.random.Generator, int], NDArray[np.float64]]) -> Design:
    """Return cases whose columns are drawn independently, each from the stream of its own key."""
    places = {key: draw(key_generator(sweep.seed, key), sweep.samples) for key in sweep.vary}
    return from_places(sweep, places)


def from_places(sweep: Sweep, places: dict[str, Places]) -> Design:
    """Return the cases at places of the unit cube."""
    return Together({key: drawn(values, open_interval(places[key])) for key, values in sweep.vary.items()})


def open_interval(places: Places) -> Places:
    """Move places at 0 and 1 inside by less than anybody can see."""
    return np.clip(places, LEAST, 1.0 - 2.0 * LEAST)
