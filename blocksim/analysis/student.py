"""Quantiles of Student's t distribution for whole degrees of freedom."""

from math import atan, cos, pi, sin, sqrt, tan

BISECTIONS = 100  # each halves the bracket; 100 exhaust double precision


def central_probability(t: float, degrees: int) -> float:
    """Return P(|T| <= t) for t >= 0: the finite series of Abramowitz & Stegun, 26.7.3 and 26.7.4."""
    return _series(atan(t / sqrt(degrees)), degrees)


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
    """Sum the series: odd powers of cos(theta) for odd degrees of freedom, even powers for even ones."""
    odd = degrees % 2 == 1
    if degrees == 1:
        return 2.0 * theta / pi
    term = cos(theta) if odd else 1.0
    total = term
    for index in range(3 if odd else 2, degrees - 1, 2):
        term *= cos(theta) ** 2 * (index - 1) / index
        total += term
    return 2.0 / pi * (theta + sin(theta) * total) if odd else sin(theta) * total
