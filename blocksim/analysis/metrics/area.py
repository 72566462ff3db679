"""The area between the distribution of the members and that of the repeats, in mm.

d = integral of |F_members(x) - F_repeats(x)| dx (Ferson, Oberkampf and Ginzburg, Comput. Methods Appl. Mech. Engrg.
197, 2008), which is the Wasserstein-1 distance. Both functions are steps, so the sum over the steps is exact.

Its interval comes from a bootstrap that resamples members and repeats. Resampled distributions lie farther apart than
the true ones, so quantiles of the resampled areas d* would never reach 0; and few repeats scatter too little when they
are resampled. Therefore the interval is d +- (q - d), cut at 0. q is the quantile of d* not at 0.975 but at
Phi(t_(n-1, 0.975) sqrt(n/(n-1))), n the size of the smaller sample (the widening of Hesterberg, The American
Statistician 69, 2015). For normal samples of 200 members and 6 repeats, 0 to 3 standard deviations apart, it covered
the true area in 91 to 98 % of 400 trials, and in 84 % where both distributions are the same; with 4 repeats in 90 to
95 % and 76 %. With 3 it was 71 to 92 %, with 2 less, so samples of fewer than 4 values have no interval.
"""

from math import nan, sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.intervals import CONFIDENCE, quantile
from blocksim.analysis.metrics.metric import (
    BLOCK,
    Column,
    Evidence,
    Findings,
    Floats,
    Form,
    Interval,
    Metric,
    Pair,
    Row,
)

Counts = NDArray[np.int64]
RESAMPLES = 2000
SEED = 0
FEWEST = 4  # values of a sample that is worth resampling


class Steps:
    """Two samples on their common grid of values, for the area between their distributions as counts change."""

    def __init__(self, one: Floats, other: Floats) -> None:
        """Take samples of any length, at least one value each."""
        grid, places = np.unique(np.concatenate([one, other]), return_inverse=True)
        self.widths = np.diff(grid)
        self.one, self.other = places[: one.size], places[one.size :]

    def area(self, one: Counts, other: Counts) -> float:
        """Return the area between two samples, given as the places of their values on the grid."""
        gap = self._distribution(one) - self._distribution(other)
        return float(np.sum(np.abs(gap) * self.widths))  # not by BLAS, whose threads hinder one another here

    def _distribution(self, places: Counts) -> Floats:
        """Return the share of values up to each place of the grid but the last."""
        counts = np.bincount(places, minlength=self.widths.size + 1)
        return np.cumsum(counts)[:-1] / places.size


def area_between(one: Floats, other: Floats) -> float:
    """Return the area between the distributions of two samples, in their unit."""
    steps = Steps(one, other)
    return steps.area(steps.one, steps.other)


def area_interval(members: Floats, repeats: Floats, resamples: int = RESAMPLES, seed: int = SEED) -> Interval:
    """Return the 95 % interval of the area, see above; NaN where a sample is too small for one."""
    smaller = min(members.size, repeats.size)
    if smaller < FEWEST:
        return nan, nan
    random = np.random.default_rng(seed)
    steps = Steps(members, repeats)
    areas = [steps.area(_resampled(steps.one, random), _resampled(steps.other, random)) for _ in range(resamples)]
    area = steps.area(steps.one, steps.other)
    widened = NormalDist().cdf(quantile(0.5 * (1.0 + CONFIDENCE), smaller - 1) * sqrt(smaller / (smaller - 1)))
    half = max(float(np.quantile(areas, widened)) - area, 0.0)
    return max(area - half, 0.0), area + half


def _resampled(places: Counts, random: np.random.Generator) -> Counts:
    return places[random.integers(0, places.size, places.size)]


def _find(evidence: Evidence) -> Findings:
    lengths = evidence.lengths
    rows = tuple(_row(pair) for pair in lengths)
    messages = [f"{pair.name}: no interval, {why}" for pair in lengths if (why := _complaint(pair))]
    if len(messages) < len(lengths):
        messages.append(f"bootstrap of {RESAMPLES} resamples, seed {SEED}")
    return Findings(rows, tuple(messages))


def _complaint(pair: Pair) -> str:
    """Return why there is no interval, or nothing."""
    if not pair.scatters:
        return "as the repeats do not scatter"
    few = min(pair.known.size, len(pair.repeats)) < FEWEST
    return f"which needs {FEWEST} samples and {FEWEST} repeats" if few else ""


def _row(pair: Pair) -> Row:
    members, repeats = pair.known, np.array(list(pair.repeats.values()))
    head: Row = {**pair.head, "members": int(members.size), "repeats": int(repeats.size)}
    if not members.size:
        return {**head, "area": None, "interval": None}
    interval = None if _complaint(pair) else area_interval(members, repeats)
    return {**head, "area": area_between(members, repeats), "interval": interval}


AREA = Metric(
    "area",
    "area between the distributions of samples and repeats (mm)",
    (
        *BLOCK,
        Column("members", "samples", Form.COUNT, "samples with a value"),
        Column("repeats", "repeats", Form.COUNT, "repeats with a value"),
        Column("area", "area", Form.NUMBER, "integral of |F_samples - F_repeats| dx: 0 where they are equal"),
        Column("interval", "95 %", Form.NUMBER, "bootstrap interval of the area, both samples resampled"),
    ),
    _find,
)
