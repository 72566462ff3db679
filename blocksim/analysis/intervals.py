"""What intervals are made of: quantiles of Student's t distribution, and exact limits of a probability from k of n.

The limits, after Clopper and Pearson (Biometrika 26, 1934), hold at least the stated confidence whatever the
probability is. Each is the probability at which k, or more (fewer), of n has just the remaining chance; a quantile of a
beta distribution solves that equation. The quantiles need no scipy: every run that is compared asks for them.
"""

from math import cos, pi, sin, sqrt, tan

from blocksim.extras import loaded

CONFIDENCE = 0.95
BISECTIONS = 100  # each halves the bracket; 100 exhaust double precision


def quantile(probability: float, degrees: int) -> float:
    """Return t with P(T <= t) = `probability`, for `degrees` >= 1 and 0 < `probability` < 1.

    The series is inverted by bisection in theta = arctan(t/sqrt(degrees)), which is bounded. Raises
    ValueError outside these limits.
    """
    if degrees < 1 or not 0.0 < probability < 1.0:
        message = "needs at least one degree of freedom and a probability between 0 and 1"
        raise ValueError(message)
    wanted = abs(2.0 * probability - 1.0)
    low, high = 0.0, pi / 2
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _series(middle, degrees) < wanted else (low, middle)
    size = sqrt(degrees) * tan(low)
    return size if probability >= 0.5 else -size  # noqa: PLR2004 - the median


def _series(theta: float, degrees: int) -> float:
    """Return P(|T| <= sqrt(degrees) tan(theta)): the finite series of Abramowitz & Stegun, 26.7.3 and 26.7.4.

    It sums odd powers of cos(theta) for odd degrees of freedom, even powers for even ones.
    """
    odd = degrees % 2 == 1
    if degrees == 1:
        return 2.0 * theta / pi
    term = cos(theta) if odd else 1.0
    total = term
    for index in range(3 if odd else 2, degrees - 1, 2):
        term *= cos(theta) ** 2 * (index - 1) / index
        total += term
    return 2.0 / pi * (theta + sin(theta) * total) if odd else sin(theta) * total


def interval(count: int, total: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the two-sided limits of the probability, given `count` of `total`; (0, 1) where `total` is 0."""
    tail = 0.5 * (1.0 - confidence)
    return _lower(count, total, tail), 1.0 - _lower(total - count, total, tail)


def lower_bound(count: int, total: int, confidence: float = CONFIDENCE) -> float:
    """Return the one-sided lower limit: (1 - confidence)^(1/n) where all n agree."""
    return _lower(count, total, 1.0 - confidence)


def _lower(count: int, total: int, tail: float) -> float:
    """Return p with P(at least `count` of `total`; p) = `tail`."""
    if count == 0:
        return 0.0
    return float(loaded("scipy.special", "judging a sweep").betaincinv(count, total - count + 1, tail))
