"""Limit at which an outcome changes, found by bisection, for comparison with closed forms."""

from collections.abc import Callable


def limit(outcome: Callable[[float], bool], low: float, high: float, halvings: int) -> float:
    """Return the middle of the last interval; NaN where `outcome` is not False at `low` and True at `high`."""
    if outcome(low) or not outcome(high):
        return float("nan")
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outcome(middle) else (middle, high)
    return 0.5 * (low + high)
