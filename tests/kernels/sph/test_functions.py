"""Smoothing functions: normalised, compact, smooth, and their slope is their derivative."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from scipy.special import j0

from blocksim.kernels.sph.functions import KERNEL_CODES, kernel_slope, kernel_value, support_radius

H = 0.013
EVERY_KERNEL = pytest.mark.parametrize("code", KERNEL_CODES.values(), ids=KERNEL_CODES.keys())


def over_pieces(integrand: Callable[[float], float], end: float) -> float:
    """Integrate from 0 to `end` (in smoothing lengths), knot by knot."""
    return float(sum(quad(integrand, i, i + 1, epsabs=1e-13, epsrel=1e-12)[0] for i in range(round(end))))


def test_every_kernel_has_a_code_of_its_own() -> None:
    assert set(KERNEL_CODES) == {"wendland-c2", "cubic-spline", "quintic-spline"}
    assert len(set(KERNEL_CODES.values())) == len(KERNEL_CODES)


@EVERY_KERNEL
@pytest.mark.parametrize("h", [1.0, H, 250.0])
def test_integral_over_the_plane_is_one(code: int, h: float) -> None:
    end = support_radius(code, h) / h
    total = over_pieces(lambda q: 2.0 * math.pi * q * h * kernel_value(code, q * h, h) * h, end)
    assert total == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "q", "expected"),
    [
        # Monaghan 1992: 10/(7 pi h^2) (1, 1/4, 0) at q = 0, 1, 2
        ("cubic-spline", 0.0, 10.0 / (7.0 * math.pi)),
        ("cubic-spline", 1.0, 2.5 / (7.0 * math.pi)),
        # Dehnen & Aly 2012, table 1: C2 in two dimensions, 7/(pi H^2) (1 - r/H)^4 (1 + 4 r/H) with H = 2 h
        ("wendland-c2", 0.0, 7.0 / (4.0 * math.pi)),
        ("wendland-c2", 1.0, 7.0 / (4.0 * math.pi) * 3.0 / 16.0),
        # Morris, Fox & Zhu 1997: 7/(478 pi h^2) (66, 26, 1) at q = 0, 1, 2
        ("quintic-spline", 0.0, 66.0 * 7.0 / (478.0 * math.pi)),
        ("quintic-spline", 1.0, 26.0 * 7.0 / (478.0 * math.pi)),
        ("quintic-spline", 2.0, 7.0 / (478.0 * math.pi)),
    ],
)
def test_values_of_the_literature(name: str, q: float, expected: float) -> None:
    assert kernel_value(KERNEL_CODES[name], q * H, H) == pytest.approx(expected / H**2, rel=1e-14)


@pytest.mark.parametrize(("name", "support"), [("cubic-spline", 2.0), ("wendland-c2", 2.0), ("quintic-spline", 3.0)])
def test_function_is_positive_and_falls_within_its_support_and_is_zero_beyond(name: str, support: float) -> None:
    code = KERNEL_CODES[name]
    assert support_radius(code, H) == pytest.approx(support * H)
    inside = [kernel_value(code, q * H, H) for q in np.linspace(0.0, 0.99 * support, 200)]
    assert min(inside) > 0.0
    assert (np.diff(inside) < 0.0).all()
    for q in (support, 1.001 * support, 1e6):
        assert kernel_value(code, q * H, H) == 0.0
        assert kernel_slope(code, q * H, H) == 0.0


@EVERY_KERNEL
@given(q=st.floats(0.0, 3.2))
def test_slope_is_the_derivative(code: int, q: float) -> None:
    # central difference of step e: error W''' e^2/6; |W'''| < 10/h^5 for all three
    step = 1e-4 * H
    r = max(q * H, step)
    difference = (kernel_value(code, r + step, H) - kernel_value(code, r - step, H)) / (2.0 * step)
    assert kernel_slope(code, r, H) == pytest.approx(difference, abs=3e-8 / H**3)
    assert kernel_slope(code, r, H) <= 0.0


@EVERY_KERNEL
def test_slope_goes_to_zero_in_the_centre_as_the_distance_does(code: int) -> None:
    assert kernel_slope(code, 0.0, H) == 0.0
    ratios = [kernel_slope(code, r * H, H) / (r * H) for r in (1e-4, 1e-10, 1e-17, 1e-150)]
    assert ratios == pytest.approx([ratios[0]] * 4, rel=1e-3)
    assert ratios[0] < -0.5 / H**4


@EVERY_KERNEL
@given(q=st.floats(0.0, 3.2), h=st.floats(1e-6, 1e6))
def test_smoothing_length_only_scales(code: int, q: float, h: float) -> None:
    r = q * h
    assert kernel_value(code, r, h) * h**2 == pytest.approx(kernel_value(code, r / h, 1.0), rel=1e-12)
    assert kernel_slope(code, r, h) * h**3 == pytest.approx(kernel_slope(code, r / h, 1.0), rel=1e-12)


def transform(name: str, k: float) -> float:
    """Return the Fourier transform of W with h = 1 at the wave number k."""
    code = KERNEL_CODES[name]

    def integrand(q: float) -> float:
        return 2.0 * math.pi * q * kernel_value(code, q, 1.0) * float(j0(k * q))

    return over_pieces(integrand, support_radius(code, 1.0))


def test_only_the_wendland_function_has_a_positive_transform() -> None:
    assert min(transform("wendland-c2", k) for k in np.arange(0.0, 15.0, 0.5)) > 0.0
    assert min(transform("cubic-spline", k) for k in np.arange(0.0, 15.0, 0.5)) < -1e-4
