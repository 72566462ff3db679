"""Cubic spline (Monaghan & Lattanzio 1985; Monaghan 1992), support 2 h, twice continuously differentiable."""

import math

from blocksim.kernels.common.jit import kernel

SUPPORT = 2.0  # smoothing lengths
SCALE = 10.0 / (7.0 * math.pi)  # makes the integral over the plane one


@kernel
def value(r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    q = r / h
    if q >= 2.0:
        return 0.0
    if q >= 1.0:
        s = 2.0 - q
        return SCALE * 0.25 * s * s * s / (h * h)
    return SCALE * (1.0 - q * q * (1.5 - 0.75 * q)) / (h * h)


@kernel
def slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3), never positive."""
    q = r / h
    if q >= 2.0:
        return 0.0
    if q >= 1.0:
        s = 2.0 - q
        return -SCALE * 0.75 * s * s / (h * h * h)
    return -SCALE * q * (3.0 - 2.25 * q) / (h * h * h)
