"""Wendland's C2 function (Wendland 1995), support 2 h.

Its Fourier transform is positive, so that particles do not pair up however many neighbours they have (Dehnen & Aly
2012).
"""

import math

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import Lanes, greater

SUPPORT = 2.0  # smoothing lengths
SCALE = 7.0 / (4.0 * math.pi)  # makes the integral over the plane one


@kernel
def value(r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    q = r / h
    if q >= 2.0:
        return 0.0
    s = 1.0 - 0.5 * q
    return SCALE * s * s * s * s * (1.0 + 2.0 * q) / (h * h)


@kernel
def slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3), never positive."""
    q = r / h
    if q >= 2.0:
        return 0.0
    s = 1.0 - 0.5 * q
    return -SCALE * 5.0 * q * s * s * s / (h * h * h)


@kernel
def steepness(h: float) -> float:
    """Return -W'/r (1/m^4) at r = 0, where it is largest."""
    return 5.0 * SCALE / (h * h * h * h)


@kernel
def fading(r: Lanes, inverse: float) -> Lanes:
    """Return -W'/r (-) as a share of that, zero from the support radius on, whose inverse (1/m) is given; no branch."""
    s = greater(1.0 - r * inverse, 0.0)
    return s * s * s
