"""Smoothing functions W(r, h) in the plane and their dispatch.

All are functions of q = r/h alone up to a factor, positive and falling within their support, zero beyond it, and
normalised: their integral over the plane is one. The smoothing length h is the scale of q, not the support radius: that
is 2 h or 3 h. Each has a code and a branch in the three functions for users (on an integer, for the reason given in
kernels/explicit/laws.py).

Wendland's C2 function (Wendland 1995), support 2 h: its Fourier transform is positive, so that particles do not pair up
however many neighbours they have (Dehnen & Aly 2012).

Cubic spline (Monaghan & Lattanzio 1985; Monaghan 1992), support 2 h, twice continuously differentiable.

Quintic spline (Morris, Fox & Zhu 1997; Liu & Liu 2003), support 3 h, four times continuously differentiable. For q < 1
the powers of (3 - q), (2 - q) and (1 - q) are multiplied out: they cancel in the centre, and what round-off left of the
slope there would be divided by r.
"""

import math

from blocksim.kernels.common.jit import entry_kernel, kernel
from blocksim.kernels.common.simd import Lanes, greater

WENDLAND_C2, CUBIC_SPLINE, QUINTIC_SPLINE = range(3)
KERNEL_CODES = {"wendland-c2": WENDLAND_C2, "cubic-spline": CUBIC_SPLINE, "quintic-spline": QUINTIC_SPLINE}
WENDLAND_SUPPORT, CUBIC_SUPPORT, QUINTIC_SUPPORT = 2.0, 2.0, 3.0  # smoothing lengths
WENDLAND_SCALE = 7.0 / (4.0 * math.pi)  # these make the integral over the plane one
CUBIC_SCALE = 10.0 / (7.0 * math.pi)
QUINTIC_SCALE = 7.0 / (478.0 * math.pi)


@entry_kernel
def kernel_value(code: int, r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    if code == CUBIC_SPLINE:
        return cubic_value(r, h)
    if code == QUINTIC_SPLINE:
        return quintic_value(r, h)
    return wendland_value(r, h)


@entry_kernel
def kernel_slope(code: int, r: float, h: float) -> float:
    """Return dW/dr (1/m^3) at a distance r >= 0 (m); never positive."""
    if code == CUBIC_SPLINE:
        return cubic_slope(r, h)
    if code == QUINTIC_SPLINE:
        return quintic_slope(r, h)
    return wendland_slope(r, h)


@entry_kernel
def support_radius(code: int, h: float) -> float:
    """Return the distance (m) from which on W is zero."""
    if code == CUBIC_SPLINE:
        return CUBIC_SUPPORT * h
    if code == QUINTIC_SPLINE:
        return QUINTIC_SUPPORT * h
    return WENDLAND_SUPPORT * h


@kernel
def wendland_value(r: float, h: float) -> float:
    """Return W (1/m^2) of Wendland's function."""
    q = r / h
    if q >= 2.0:
        return 0.0
    s = 1.0 - 0.5 * q
    return WENDLAND_SCALE * s * s * s * s * (1.0 + 2.0 * q) / (h * h)


@kernel
def wendland_slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3) of Wendland's function."""
    q = r / h
    if q >= 2.0:
        return 0.0
    s = 1.0 - 0.5 * q
    return -WENDLAND_SCALE * 5.0 * q * s * s * s / (h * h * h)


@kernel
def wendland_steepness(h: float) -> float:
    """Return -W'/r (1/m^4) of Wendland's function at r = 0, where it is largest."""
    return 5.0 * WENDLAND_SCALE / (h * h * h * h)


@kernel
def wendland_fading(r: Lanes, inverse: float) -> Lanes:
    """Return -W'/r (-) of Wendland's function as a share of its steepness, without a branch.

    Zero from the support radius on, whose inverse (1/m) is given.
    """
    s = greater(1.0 - r * inverse, 0.0)
    return s * s * s


@kernel
def cubic_value(r: float, h: float) -> float:
    """Return W (1/m^2) of the cubic spline."""
    q = r / h
    if q >= 2.0:
        return 0.0
    if q >= 1.0:
        s = 2.0 - q
        return CUBIC_SCALE * 0.25 * s * s * s / (h * h)
    return CUBIC_SCALE * (1.0 - q * q * (1.5 - 0.75 * q)) / (h * h)


@kernel
def cubic_slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3) of the cubic spline."""
    q = r / h
    if q >= 2.0:
        return 0.0
    if q >= 1.0:
        s = 2.0 - q
        return -CUBIC_SCALE * 0.75 * s * s / (h * h * h)
    return -CUBIC_SCALE * q * (3.0 - 2.25 * q) / (h * h * h)


@kernel
def quintic_value(r: float, h: float) -> float:
    """Return W (1/m^2) of the quintic spline."""
    q = r / h
    if q >= 3.0:
        return 0.0
    if q < 1.0:
        q2 = q * q
        return QUINTIC_SCALE * (66.0 - q2 * (60.0 - q2 * (30.0 - 10.0 * q))) / (h * h)
    outer = 3.0 - q
    inner = max(2.0 - q, 0.0)
    return QUINTIC_SCALE * (outer**5 - 6.0 * inner**5) / (h * h)


@kernel
def quintic_slope(r: float, h: float) -> float:
    """Return dW/dr (1/m^3) of the quintic spline."""
    q = r / h
    if q >= 3.0:
        return 0.0
    if q < 1.0:
        return -QUINTIC_SCALE * q * (120.0 - q * q * (120.0 - 50.0 * q)) / (h * h * h)
    outer = 3.0 - q
    inner = max(2.0 - q, 0.0)
    return -QUINTIC_SCALE * 5.0 * (outer**4 - 6.0 * inner**4) / (h * h * h)
