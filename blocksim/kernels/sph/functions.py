"""Smoothing functions W(r, h) in the plane and their dispatch.

A smoothing function is one file with `value(r, h)`, `slope(r, h)` and `SUPPORT`, one code here and one branch in each
dispatcher below (on an integer code, for the reason given in kernels/laws). All are functions of q = r/h alone up to a
factor, positive and falling within their support, zero beyond it, and normalised: their integral over the plane is one.
The smoothing length h is the scale of q, not the support radius: that is 2 h or 3 h.
"""

from blocksim.kernels.common.jit import entry_kernel
from blocksim.kernels.sph import cubic_spline, quintic_spline, wendland_c2

WENDLAND_C2, CUBIC_SPLINE, QUINTIC_SPLINE = range(3)
KERNEL_CODES = {"wendland-c2": WENDLAND_C2, "cubic-spline": CUBIC_SPLINE, "quintic-spline": QUINTIC_SPLINE}


@entry_kernel
def kernel_value(code: int, r: float, h: float) -> float:
    """Return W (1/m^2) at a distance r >= 0 (m) for the smoothing length h (m)."""
    if code == CUBIC_SPLINE:
        return cubic_spline.value(r, h)
    if code == QUINTIC_SPLINE:
        return quintic_spline.value(r, h)
    return wendland_c2.value(r, h)


@entry_kernel
def kernel_slope(code: int, r: float, h: float) -> float:
    """Return dW/dr (1/m^3) at a distance r >= 0 (m); never positive."""
    if code == CUBIC_SPLINE:
        return cubic_spline.slope(r, h)
    if code == QUINTIC_SPLINE:
        return quintic_spline.slope(r, h)
    return wendland_c2.slope(r, h)


@entry_kernel
def support_radius(code: int, h: float) -> float:
    """Return the distance (m) from which on W is zero."""
    if code == CUBIC_SPLINE:
        return cubic_spline.SUPPORT * h
    if code == QUINTIC_SPLINE:
        return quintic_spline.SUPPORT * h
    return wendland_c2.SUPPORT * h
