"""Quintic spline (Morris, Fox & Zhu 1997; Liu & Liu 2003), support 3 h, four times continuously differentiable."""

import math

from blocksim.kernels.jit import kernel

SUPPORT = 3.0  # smoothing lengths
SCALE = 7.0 / (478.0 * math.pi)  # makes the integral over the plane one


@kernel
def power_4(s: float) -> float:
    """Return s^4, or zero for negative s."""
    return s * s * s * s if s > 0.0 else 0.0


@kernel
def value(r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    q = r / h
    a, b, c = 3.0 - q, 2.0 - q, 1.0 - q
    return SCALE * (a * power_4(a) - 6.0 * b * power_4(b) + 15.0 * c * power_4(c)) / (h * h)


@kernel
def slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3), never positive."""
    q = r / h
    return -SCALE * 5.0 * (power_4(3.0 - q) - 6.0 * power_4(2.0 - q) + 15.0 * power_4(1.0 - q)) / (h * h * h)
