"""From places in the unit interval to the values of a key, by the inverse of its distribution function.

One line of QUANTILES a distribution. Numbers are kept to 12 digits, so that mathematical libraries that differ in the
last bit give the same values.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.extras import loaded
from blocksim.scenario.models.variation import Normal, Uniform, Variation, rounded, written

Places = NDArray[np.float64]
"""Numbers u with 0 < u < 1, shape (samples,)."""


def drawn(values: Variation, places: Places) -> Sequence[object]:
    """Return the value at each place: numbers in SI, angles as texts in rad, levels as they were written."""
    if isinstance(values, tuple):
        return _levels(values, places)
    low, high = values.low, values.high
    numbers = (min(max(rounded(number), low), high) for number in QUANTILES[type(values)](values, places).tolist())
    return [written(number, angle=values.angle) for number in numbers]


def _levels(levels: tuple[object, ...], places: Places) -> Sequence[object]:
    """Return equally likely levels."""
    return [levels[index] for index in np.minimum(places * len(levels), len(levels) - 1).astype(int).tolist()]


def uniform(values: Uniform, places: Places) -> Places:
    """Invert the uniform distribution of the values, or of their logarithms."""
    if values.scale == "log":
        return np.asarray(values.low * np.exp(places * np.log(values.high / values.low)))
    return values.low + places * (values.high - values.low)


def normal(values: Normal, places: Places) -> Places:
    """Invert the normal distribution, cut at its bounds (scipy.stats.truncnorm)."""
    stats = loaded("scipy.stats", "sampled sweeps")
    low, high = ((bound - values.mean) / values.sd for bound in (values.low, values.high))
    if np.isinf(low) and np.isinf(high):
        return np.asarray(stats.norm.ppf(places, values.mean, values.sd))
    return np.asarray(stats.truncnorm.ppf(places, low, high, values.mean, values.sd))


QUANTILES: dict[type, Callable[[Any, Places], Places]] = {
    Uniform: uniform,
    Normal: normal,
}
