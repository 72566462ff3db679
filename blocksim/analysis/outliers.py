"""Measured values that are far from all others: slips of the pen, and values in another unit.

A value is far where it is 5 standard deviations or more of the other repeats away from their mean; of normal repeats
one in fifty with four others, and one in a hundred with five. Fewer others are as often that far away by more, by the
quantiles of Student's t: see FAR. A factor between a value and the others, where these agree, is that of two units.
Of two repeats nothing but such a factor is known, and not which of them is wrong.
"""

from collections.abc import Iterator, Sequence
from math import inf
from statistics import fmean, median, median_low, stdev

READINGS = {"mm": 0.5, "deg": 1.0}
"""Least standard deviation: the uncertainty of one reading of a position, and a fifth of what a rotation may be off."""
FAR = {2: 37.5, 3: 7.9}  # by the number of others
FAR_FROM_MANY = 5.0
FACTORS = {10.0: "a factor of 10", 100.0: "a factor of 100", 1000.0: "a factor of 1000"}
OF_ANGLES = {57.3: "a factor of 57.3, as between deg and rad"}
NEAR = 0.2  # of a factor
AGREE = 0.25  # of the median, within which half of the values are where a factor means anything


def far_values(
    values: Sequence[float], least: float, unit: str, *, is_chosen: bool = False
) -> Iterator[tuple[int, str]]:
    """Yield the place of every value that is far from the others, and why; `least` is a standard deviation at least.

    Values that were chosen, such as how far a test goes, may differ, but not by a factor between units.
    """
    usual = median_low(values)
    agreeing = sum(abs(one - usual) <= AGREE * abs(usual) for one in values)
    for place, value in enumerate(values if len(values) > 1 else ()):
        others = [*values[:place], *values[place + 1 :]]
        mean, s = fmean(others), max(stdev(others), least) if len(others) > 1 else inf
        away = abs(value - mean) / s if s > 0.0 else 0.0
        is_far = not is_chosen and away >= FAR.get(len(others), FAR_FROM_MANY)
        factor = factor_between(value, median(others), unit) if 2 * agreeing >= len(values) else ""
        if is_far or (factor and abs(value - usual) > FAR_FROM_MANY * least):
            unlike = "the others" if len(others) > 1 else f"the other repeat, {others[0]:g} {unit}"
            why = f"{away:.3g} standard deviations of the others away" if is_far else f"unlike {unlike}"
            yield place, f"{value:g} {unit} is {why}" + (f" ({factor}): is the unit right?" if factor else "")


def factor_between(value: float, usual: float, unit: str) -> str:
    """Return the factor between two values in words, where it is that between units; else nothing."""
    if not value * usual > 0.0:
        return ""
    ratio = max(value / usual, usual / value)
    factors = FACTORS | (OF_ANGLES if unit == "deg" else {})
    return next((text for factor, text in factors.items() if abs(ratio / factor - 1.0) < NEAR), "")


def spikes(values: Sequence[float], unit: str) -> Iterator[tuple[int, str]]:
    """Yield the points of a curve that are a factor off both neighbours, which agree with each other."""
    for place in range(1, len(values) - 1):
        before, value, after = values[place - 1 : place + 2]
        if abs(after - before) <= AGREE * abs(before) and (
            factor := factor_between(value, 0.5 * (before + after), unit)
        ):
            yield place, f"{value:g} {unit} is unlike the points before and after ({factor}): is the unit right?"
