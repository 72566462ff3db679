"""Exact limits of a probability from k of n, after Clopper and Pearson (Biometrika 26, 1934).

They hold at least the stated confidence whatever the probability is. Each is the probability at which k, or more
(fewer), of n has just the remaining chance; a quantile of a beta distribution solves that equation.
"""

from blocksim.extras import loaded

CONFIDENCE = 0.95


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
