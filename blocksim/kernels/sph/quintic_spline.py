"""Quintic spline (Morris, Fox & Zhu 1997; Liu & Liu 2003), support 3 h, four times continuously differentiable."""

import math

from blocksim.kernels.common.jit import kernel

SUPPORT = 3.0  # smoothing lengths
SCALE = 7.0 / (478.0 * math.pi)  # makes the integral over the plane one


# For q < 1 the powers of (3 - q), (2 - q) and (1 - q) are multiplied out: they cancel in the centre, and what round-off
# left of the slope there would be divided by r.


@kernel
def value(r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    q = r / h
    if q >= 3.0:
        return 0.0
    if q < 1.0:
        q2 = q * q
        return SCALE * (66.0 - q2 * (60.0 - q2 * (30.0 - 10.0 * q))) / (h * h)
    outer = 3.0 - q
    inner = max(2.0 - q, 0.0)
    return SCALE * (outer**5 - 6.0 * inner**5) / (h * h)


@kernel
def slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3), never positive."""
    q = r / h
    if q >= 3.0:
        return 0.0
    if q < 1.0:
        return -SCALE * q * (120.0 - q * q * (120.0 - 50.0 * q)) / (h * h * h)
    outer = 3.0 - q
    inner = max(2.0 - q, 0.0)
    return -SCALE * 5.0 * (outer**4 - 6.0 * inner**4) / (h * h * h)
