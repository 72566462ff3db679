"""Numbers that know how they change as body a of a pair is moved, b held: exact gradients by the chain rule.

So a potential is written down once, and its forces follow from it: see slivers.py.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.jit import rare_kernel


class Jet(NamedTuple):
    """A value with its derivatives by the place of body a, per m, and by its angle, per rad."""

    value: float
    x: float
    y: float
    turn: float


CONSTANT_ONE = Jet(1.0, 0.0, 0.0, 0.0)


@rare_kernel
def plus(one: Jet, two: Jet, times: float) -> Jet:
    """Return one + times two."""
    return Jet(one.value + times * two.value, one.x + times * two.x, one.y + times * two.y, one.turn + times * two.turn)


@rare_kernel
def product(one: Jet, two: Jet) -> Jet:
    """Return the product of two numbers."""
    p, q = one.value, two.value
    return Jet(p * q, p * two.x + q * one.x, p * two.y + q * one.y, p * two.turn + q * one.turn)


@rare_kernel
def quotient(one: Jet, two: Jet) -> Jet:
    """Return one over two."""
    q = one.value / two.value
    over = 1.0 / two.value
    return Jet(q, over * (one.x - q * two.x), over * (one.y - q * two.y), over * (one.turn - q * two.turn))


@rare_kernel
def mapped(one: Jet, value: float, slope: float) -> Jet:
    """Return f(one), given f and its slope there."""
    return Jet(value, slope * one.x, slope * one.y, slope * one.turn)


@rare_kernel
def powered(one: Jet, exponent: float) -> Jet:
    """Return a number that is not negative to a power of more than one."""
    slope = one.value ** (exponent - 1.0)
    return mapped(one, one.value * slope, exponent * slope)


@rare_kernel
def stepped(one: Jet, low: float, high: float) -> Jet:
    """Return the cubic step q^2 (3 - 2 q) from zero at `low` to one at `high`."""
    q = min(max((one.value - low) / (high - low), 0.0), 1.0)
    return mapped(one, q * q * (3.0 - 2.0 * q), 6.0 * q * (1.0 - q) / (high - low))


@rare_kernel
def absolute(one: Jet) -> Jet:
    """Return the absolute value."""
    return mapped(one, abs(one.value), math.copysign(1.0, one.value))


@rare_kernel
def cosine_of(sine: Jet) -> Jet:
    """Return the cosine of an angle of less than a right one, given its sine."""
    cosine = math.sqrt(1.0 - sine.value * sine.value)
    return mapped(sine, cosine, -sine.value / cosine)
