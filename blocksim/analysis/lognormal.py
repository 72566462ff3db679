"""The lognormal curve P(failure | intensity x) = F(ln(x/median)/dispersion) of counts, F being the normal distribution.

With t = ln x the curve is F(a + b t), a probit regression: median exp(-a/b), dispersion 1/b. Its logarithmic
likelihood, the sum of k ln F(a + b t) + (n - k) ln F(-a - b t) over the intensities with k failures of n independent
members, is concave in (a, b) (Baker, Earthquake Spectra 31 (2015) 579-599, has the same fit), and has a finite maximum
just where failures and survivals overlap (Silvapulle, J. R. Stat. Soc. B 43 (1981) 310-313).

Intervals are those of the profile likelihood: the range of a parameter over all (a, b) whose logarithmic likelihood is
less than half a quantile of chi-squared (one degree of freedom) below the largest. That set is convex, so its boundary
is found on rays from the maximum; median, dispersion and curve all have their ranges from it.

Counts of the same records at all intensities are not independent of one another: a record that is harmless at one
intensity is so at the next. The place of the maximum stays consistent, but twice the drop of the likelihood is then
lambda times chi-squared, lambda being an eigenvalue of H^-1 J, with Fisher's information H and the covariance J of the
scores summed by record (Godambe's information of a composite likelihood; Varin, Reid and Firth, Statistica Sinica 21
(2011) 5-42). The drop is made larger by the greatest lambda, so that no interval is too narrow.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.compare import CONFIDENCE, interval
from blocksim.extras import load_module

Floats = NDArray[np.float64]
PURPOSE = "fitting a fragility curve"
STEPS = 100  # of Newton's method, at most
CLOSE = 1e-10  # of a step, where it ends
RAYS = 360  # an interval is short by at most (pi/360)^2/2 = 4e-5 of itself
FEWEST = 2  # intensities for two parameters
HALF = 0.5
LARGEST = 700.0  # of the logarithm of a median: beyond are no numbers


@dataclass(frozen=True)
class Counts:
    """Intensities x > 0, increasing, failures k and members n >= 1 of each."""

    x: Floats
    failed: Floats
    members: Floats

    @classmethod
    def of(cls, x: Sequence[float], failed: Sequence[int], members: Sequence[int]) -> "Counts":
        """Sort by intensity, and leave out those without members."""
        rows = sorted(row for row in zip(x, failed, members, strict=True) if row[2] > 0)
        table = np.array(rows, dtype=np.float64).reshape(-1, 3)
        return cls(table[:, 0], table[:, 1], table[:, 2])


@dataclass(frozen=True)
class NoCurve:
    """Why no curve with a finite, positive dispersion is the most likely one, and between which values the median is.

    0 and infinity where it is not bounded.
    """

    reason: str
    low: float = 0.0
    high: float = math.inf


@dataclass(frozen=True)
class Curve:
    """The most likely curve, and intervals of `confidence`; an end that the counts leave open is 0 or infinite."""

    median: float
    dispersion: float
    median_interval: tuple[float, float]
    dispersion_interval: tuple[float, float]
    deviance: float
    freedom: int  # degrees, of the deviance
    fits: float  # probability of a larger deviance if the curve holds; NaN without degrees of freedom
    confidence: float
    boundary: tuple[Floats, Floats] = field(repr=False)  # (a, b) of the region, in ln x

    def probability(self, x: Floats) -> Floats:
        """Return the probability of failure at intensities."""
        cdf: Floats = _special().ndtr(np.log(x / self.median) / self.dispersion)
        return cdf

    def band(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the limits of the probability at each intensity by itself."""
        a, b = self.boundary
        eta = a[:, None] + b[:, None] * np.log(x)
        ndtr = _special().ndtr
        return ndtr(eta.min(axis=0)), ndtr(eta.max(axis=0))


def fit(counts: Counts, confidence: float = CONFIDENCE, inflation: float | None = None) -> Curve | NoCurve:
    """Return the most likely curve, or why there is none. Raises UnavailableError without scipy.

    `inflation` is that of `inflation_of` for counts of the same records at all intensities; the deviance of these has
    no known distribution, so that `fits` is NaN.
    """
    refused = _refusal(counts, confidence)
    if refused is not None:
        return refused
    t = np.log(counts.x)
    middle = float(t.mean())
    centred = _Probit(counts, t - middle)
    best = centred.maximum()
    if best[1] <= 0.0 or abs(middle - best[0] / best[1]) > LARGEST:
        return NoCurve("failures do not become more frequent with the intensity")
    drop = HALF * float(_special().chdtri(1.0, 1.0 - confidence)) * (inflation or 1.0)
    a, b = centred.boundary(best, drop)
    deviance, freedom = centred.deviance(best), len(t) - 2
    return Curve(
        median=math.exp(middle - best[0] / best[1]),
        dispersion=1.0 / best[1],
        median_interval=_medians(a, b, middle),
        dispersion_interval=(1.0 / float(b.max()), 1.0 / float(b.min()) if b.min() > 0.0 else math.inf),
        deviance=deviance,
        freedom=freedom,
        fits=float(_special().chdtrc(freedom, deviance)) if freedom > 0 and inflation is None else math.nan,
        confidence=confidence,
        boundary=(a - b * middle, b),
    )


def inflation_of(counts: Counts, failed: Floats, members: Floats) -> float:
    """Return by how much records that counts have in common widen the variance of the curve: 1 or more.

    `failed` and `members` are counts by record, shape (records, intensities); summed over records they are `counts`.
    1 where there is no curve, or a single record, of which nothing can be said. Raises UnavailableError without scipy.
    """
    if len(failed) < FEWEST or _refusal(counts, CONFIDENCE) is not None:
        return 1.0
    centred = _Probit(counts, np.log(counts.x) - float(np.log(counts.x).mean()))
    a, b = centred.maximum()
    eta = centred.eta(a, b)
    scores = failed * _hazard(eta) - (members - failed) * _hazard(-eta)
    sums = np.column_stack([scores.sum(axis=1), scores @ centred.t])
    covariance = sums.T @ sums * len(failed) / (len(failed) - 1)
    return max(1.0, float(np.linalg.eigvals(np.linalg.solve(centred.information(a, b), covariance)).real.max()))


def _special() -> Any:
    return load_module("scipy.special", PURPOSE)


def _refusal(counts: Counts, confidence: float) -> NoCurve | None:
    """Return why there is no finite maximum, None where there is one.

    Where all samples do the same, the median lies beyond an intensity, as the exact limits of the counts there have it.
    """
    if len(counts.x) < FEWEST:
        return NoCurve("a curve needs samples at two intensities or more")
    failing, standing = counts.x[counts.failed > 0], counts.x[counts.failed < counts.members]
    if not failing.size or not standing.size:
        ends = [interval(int(k), int(n), confidence) for k, n in zip(counts.failed, counts.members, strict=True)]
        places = list(zip(counts.x.tolist(), ends, strict=True))
        if standing.size:
            low = max((x for x, (_, high) in places if high < HALF), default=0.0)
            return NoCurve("no sample fails at any intensity", low=low)
        high = min((x for x, (low, _) in places if low > HALF), default=math.inf)
        return NoCurve("all samples fail at all intensities", high=high)
    if standing.max() <= failing.min():
        low, high = float(standing.max()), float(failing.min())
        where = (
            f"all stand up to {low:.6g} and all fail from {high:.6g}" if low < high else f"both occur at {low:.6g} only"
        )
        return NoCurve(f"failures and survivals do not overlap, {where}: no finite dispersion", low, high)
    if failing.max() <= standing.min():
        return NoCurve("failures do not become more frequent with the intensity")
    return None


def _medians(a: Floats, b: Floats, middle: float) -> tuple[float, float]:
    """Return the range of the median over the part b > 0 of a region with this boundary, a closed polygon."""
    inside = b > 0.0
    with np.errstate(over="ignore"):  # beyond all numbers: not bounded
        ends = np.exp(middle - a[inside] / b[inside])
    low, high = float(ends.min()), float(ends.max())
    ring = [*zip(a, b, strict=True), (a[0], b[0])]
    crossings = [p + (r - p) * q / (q - s) for (p, q), (r, s) in pairwise(ring) if (q > 0.0) != (s > 0.0)]
    if any(crossing > 0.0 for crossing in crossings):
        low = 0.0
    if any(crossing < 0.0 for crossing in crossings):
        high = math.inf
    return low, high


@dataclass(frozen=True)
class _Probit:
    """The likelihood of counts at places t."""

    counts: Counts
    t: Floats

    def eta(self, a: Floats | float, b: Floats | float) -> Floats:
        """Return a + b t, of the shape of a and b and one dimension more."""
        return np.asarray(np.asarray(a)[..., np.newaxis] + np.multiply.outer(b, self.t))

    def at(self, a: Floats | float, b: Floats | float) -> Floats:
        """Return the logarithmic likelihood."""
        eta, log_ndtr, k, n = self.eta(a, b), _special().log_ndtr, self.counts.failed, self.counts.members
        return np.asarray((k * log_ndtr(eta) + (n - k) * log_ndtr(-eta)).sum(axis=-1))

    def slopes(self, a: Floats | float, b: Floats | float) -> Floats:
        """Return its derivatives with respect to eta at every place."""
        eta, k, n = self.eta(a, b), self.counts.failed, self.counts.members
        return np.asarray(k * _hazard(eta) - (n - k) * _hazard(-eta))

    def information(self, a: float, b: float) -> Floats:
        """Return Fisher's information matrix."""
        eta = self.eta(a, b)
        weight = self.counts.members * _hazard(eta) * _hazard(-eta)
        return np.array([[weight.sum(), weight @ self.t], [weight @ self.t, weight @ self.t**2]])

    def maximum(self) -> tuple[float, float]:
        """Return (a, b) where the likelihood is largest, by Fisher's scoring with steps halved until they climb."""
        share = self.counts.failed.sum() / self.counts.members.sum()
        place = np.array([float(_special().ndtri(share)), 0.0])
        known = self.at(*place)
        for _ in range(STEPS):
            slopes = self.slopes(*place)
            step = np.linalg.solve(self.information(*place), [slopes.sum(), slopes @ self.t])
            while (higher := self.at(*(place + step))) < known and np.abs(step).max() > CLOSE:
                step *= HALF
            place, known = place + step, higher
            if np.abs(step).max() <= CLOSE:
                break
        return float(place[0]), float(place[1])

    def boundary(self, best: tuple[float, float], drop: float) -> tuple[Floats, Floats]:
        """Return points (a, b) around the maximum at which the logarithmic likelihood is lower by `drop`.

        Newton's method on every ray from outside: of a concave function it comes down to the root and never crosses it.
        """
        angles = 2.0 * math.pi * np.arange(RAYS) / RAYS
        whitened = np.linalg.inv(np.linalg.cholesky(self.information(*best))).T
        along_a, along_b = whitened @ np.array([np.cos(angles), np.sin(angles)])
        target = self.at(*best) - drop
        reach = np.full(RAYS, math.sqrt(2.0 * drop))
        while (inside := self.at(best[0] + reach * along_a, best[1] + reach * along_b) > target).any():
            reach = np.where(inside, 2.0 * reach, reach)
        for _ in range(STEPS):
            a, b = best[0] + reach * along_a, best[1] + reach * along_b
            slopes = self.slopes(a, b)
            step = (self.at(a, b) - target) / (slopes.sum(axis=1) * along_a + slopes @ self.t * along_b)
            reach = reach - step
            if np.abs(step).max() <= CLOSE:
                break
        return best[0] + reach * along_a, best[1] + reach * along_b

    def deviance(self, best: tuple[float, float]) -> float:
        """Return twice what the likelihood lacks to that of the observed shares."""
        k, n, xlogy = self.counts.failed, self.counts.members, _special().xlogy
        saturated = float((xlogy(k, k / n) + xlogy(n - k, (n - k) / n)).sum())
        return max(0.0, 2.0 * (saturated - float(self.at(*best))))


def _hazard(eta: Floats) -> Floats:
    """Return the density of the normal distribution over its cumulative probability."""
    return np.asarray(np.exp(-HALF * (eta**2 + math.log(2.0 * math.pi)) - _special().log_ndtr(eta)))
