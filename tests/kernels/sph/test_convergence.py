"""Measured orders of convergence, against what Taylor expansion and Fourier transforms of the sums say.

The error at a point depends on the particles within its support only, so a case is a small patch of particles around
one point of a smooth field, and the spacing can be as small as it takes to see an order clearly. With disorder the
root mean square over some patches counts; the same disorder is scaled with the spacing.

On a lattice with areas dx^2, Poisson's summation formula says that at a particle sum_b V W is the sum of
W^(2 pi k h/dx) over all integer vectors k, with W^ the Fourier transform of W as a function of q = r/h: k = 0 is the
integral, that is one, and the rest is what the sum has too much. It depends on h/dx only and falls as a power of it;
this is where plain sums stall.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, get_args

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from blocksim.kernels.sph.fields import GradientForm, InterpolationForm, KernelName, Particles, gradient, interpolate
from blocksim.kernels.sph.functions import KERNEL_CODES, kernel_slope, kernel_value, support_radius

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Floats

EVERY_KERNEL = pytest.mark.parametrize("kernel", get_args(KernelName))
PLACE = np.array([0.4, 0.3])
RATIO = 1.3  # h/dx
DISORDER = 0.2  # of dx, each way along x and y
WAVES = 12  # wave vectors up to this length (times 2 pi/dx) are summed
SPACINGS = (1.0 / 1024.0, 1.0 / 4096.0)


def field(places: Floats) -> Floats:
    x, y = places.T
    return np.asarray(2.0 + np.sin(3.0 * x) * np.cos(2.0 * y))


def slope(places: Floats) -> Floats:
    x, y = places.T
    along_x, along_y = 3.0 * np.cos(3.0 * x) * np.cos(2.0 * y), -2.0 * np.sin(3.0 * x) * np.sin(2.0 * y)
    return np.stack([along_x, along_y], axis=-1)


def laplacian(places: Floats) -> Floats:
    return -13.0 * (field(places) - 2.0)


class Case(NamedTuple):
    """A kind of patch."""

    kernel: KernelName
    is_edge: bool = False
    disorder: float = 0.0
    seed: int = 0
    at_particle: bool = False  # or between particles, for interpolation

    def patch(self, spacing: float, ratio: float = RATIO) -> tuple[Particles, int]:
        """Return particles around PLACE and which is the middle one; an edge has none below that one."""
        reach = math.ceil(support_radius(KERNEL_CODES[self.kernel], ratio)) + 1
        steps = np.arange(-reach, reach + 1)
        lattice = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        lattice = lattice[lattice[:, 1] >= 0] if self.is_edge else lattice
        moved = np.random.default_rng(self.seed).uniform(-self.disorder, self.disorder, lattice.shape)
        positions = PLACE + spacing * (lattice + moved)
        middle = int(np.flatnonzero((lattice == 0).all(axis=1))[0])
        return Particles(positions, 1600.0 * spacing**2, 1600.0, ratio * spacing, self.kernel), middle


def interpolation_error(case: Case, form: InterpolationForm, spacing: float, ratio: float = RATIO) -> float:
    """Return the error between the particles, or on the edge, half a spacing out."""
    particles, _ = case.patch(spacing, ratio)
    between = spacing * np.array([0.3, -0.5 if case.is_edge else 0.2])
    point = (PLACE if case.at_particle else PLACE + between)[None, :]
    found = interpolate(particles, field(particles.sources.positions), point, form)
    return float((found - field(point))[0])


def gradient_error(case: Case, form: GradientForm, spacing: float, ratio: float = RATIO) -> float:
    """Return the length of the error at the middle particle."""
    particles, middle = case.patch(spacing, ratio)
    places = particles.sources.positions
    return float(np.linalg.norm(gradient(particles, field(places), form)[middle] - slope(places[middle])))


def order(error: Callable[[Case, float], float], case: Case) -> float:
    """Return the order between the two spacings at a fixed h/dx; for disorder, of the RMS over four patches."""
    cases = [case._replace(seed=seed) for seed in range(4 if case.disorder else 1)]
    coarse, fine = (math.sqrt(sum(error(one, spacing) ** 2 for one in cases)) for spacing in SPACINGS)
    return math.log(coarse / fine) / math.log(SPACINGS[0] / SPACINGS[1])


@EVERY_KERNEL
@pytest.mark.parametrize(
    ("form", "inside", "disordered", "edge"),
    [
        ("plain", None, 0, 0),  # a part of the integral is missing
        ("shepard", 2, 1, 1),  # the mean of r_b - r is of order h; zero by symmetry at the particles of a lattice
        ("linear", 2, 2, 2),
    ],
)
def test_order_of_interpolation(
    kernel: KernelName, form: InterpolationForm, inside: int | None, disordered: int, edge: int
) -> None:
    def error(case: Case, spacing: float) -> float:
        return interpolation_error(case, form, spacing)

    if inside is not None:
        assert order(error, Case(kernel, at_particle=True)) == pytest.approx(inside, abs=0.1)
    assert order(error, Case(kernel, disorder=DISORDER)) == pytest.approx(disordered, abs=0.1)
    assert order(error, Case(kernel, is_edge=True)) == pytest.approx(edge, abs=0.1)


@EVERY_KERNEL
@pytest.mark.parametrize(
    ("form", "inside", "disordered", "edge"),
    [
        ("plain", None, -1, -1),  # A sum V grad W, and that sum is 1/h times a number
        ("symmetric", None, -1, -1),
        ("difference", None, 0, 0),
        ("corrected", 2, 1, 1),  # second derivatives times third moments, which vanish on a lattice
    ],
)
def test_order_of_gradients(
    kernel: KernelName, form: GradientForm, inside: int | None, disordered: int, edge: int
) -> None:
    def error(case: Case, spacing: float) -> float:
        return gradient_error(case, form, spacing)

    if inside is not None:
        assert order(error, Case(kernel)) == pytest.approx(inside, abs=0.1)
    assert order(error, Case(kernel, disorder=DISORDER)) == pytest.approx(disordered, abs=0.1)
    assert order(error, Case(kernel, is_edge=True)) == pytest.approx(edge, abs=0.1)


def lattice_excess(kernel: KernelName, ratio: float, profile: Callable[[int, float, float], float]) -> float:
    """Return how much larger the sum of a profile over a lattice is than its integral, which is one."""
    code = KERNEL_CODES[kernel]
    pieces = range(round(support_radius(code, 1.0)))

    def transformed(k: float) -> float:
        def integrand(q: float) -> float:
            return 2.0 * math.pi * q * profile(code, q, 1.0) * float(j0(k * q))

        return float(sum(quad(integrand, i, i + 1, epsabs=1e-10)[0] for i in pieces))

    squares = np.add.outer(np.arange(-WAVES, WAVES + 1) ** 2, np.arange(-WAVES, WAVES + 1) ** 2)
    counts = {int(n): int((squares == n).sum()) for n in np.unique(squares) if 0 < n <= WAVES**2}
    return float(sum(count * transformed(2.0 * math.pi * ratio * math.sqrt(n)) for n, count in counts.items()))


def half_slope(code: int, q: float, h: float) -> float:
    """Return -q W'/2, whose integral is one too: the mean of the diagonal of sum V grad W (r_b - r)^T."""
    return -0.5 * q * kernel_slope(code, q, h)


def lattice_sums(kernel: KernelName, ratio: float) -> tuple[float, float]:
    """Return sum V W - 1 and the error of the plain derivative of x, at a particle."""
    particles, middle = Case(kernel).patch(1.0, ratio)
    place = particles.sources.positions[middle]
    x = particles.sources.positions[:, 0] - place[0]
    return interpolate(particles, 1.0, place[None, :])[0] - 1.0, gradient(particles, x)[middle, 0] - 1.0


@EVERY_KERNEL
@pytest.mark.parametrize("ratio", [1.0, 1.3, 1.7])
def test_sums_over_a_lattice_miss_their_integrals_by_what_the_transform_says(kernel: KernelName, ratio: float) -> None:
    of_unity, of_slope = lattice_sums(kernel, ratio)
    cut_off = 1e-8 if kernel == "quintic-spline" else 1e-5  # what is left of the sum of transforms beyond WAVES
    assert of_unity == pytest.approx(lattice_excess(kernel, ratio, kernel_value), rel=1e-3, abs=cut_off)
    assert of_slope == pytest.approx(lattice_excess(kernel, ratio, half_slope), rel=1e-3, abs=cut_off)


@EVERY_KERNEL
def test_unity_is_approached_as_the_smoothing_length_grows_against_the_spacing(kernel: KernelName) -> None:
    # the transform falls at least as k^-4.5 (edges of the cubic spline, where W ~ (2 - q)^3, and j0 ~ k^-1.5 of them)
    few, many = (np.abs(lattice_sums(kernel, ratio)) for ratio in (1.0, 4.0))
    assert many[0] < 3.0 * 4.0**-4.5 * max(few)
    assert many[1] < 3.0 * 4.0**-3.5 * max(few)


@EVERY_KERNEL
def test_plain_sums_stall_at_a_fixed_ratio(kernel: KernelName) -> None:
    of_unity, of_slope = lattice_sums(kernel, RATIO)
    case = Case(kernel, at_particle=True)
    place = PLACE[None, :]
    for spacing in SPACINGS:
        assert interpolation_error(case, "plain", spacing) == pytest.approx(of_unity * field(place)[0], abs=2e-5)
        error = gradient_error(case, "plain", spacing)
        assert error == pytest.approx(abs(of_slope) * np.linalg.norm(slope(place)), abs=2e-5)


def second_moment(kernel: KernelName) -> float:
    """Return the integral of W q^2 over the plane."""
    code = KERNEL_CODES[kernel]
    end = support_radius(code, 1.0)
    return float(quad(lambda q: 2.0 * math.pi * q**3 * kernel_value(code, q, 1.0), 0.0, end, points=[1.0, 2.0])[0])


@EVERY_KERNEL
@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_error_inside_is_that_of_smoothing_and_of_plain_sums_that_of_the_lattice_too(
    kernel: KernelName, ratio: float
) -> None:
    # Taylor: <A> - A = (h^2/4) M Laplacian A, and its gradient, with M the integral of W q^2; Laplacian A = -13 (A - 2)
    spacing = 1.0 / 200.0
    smoothing = 0.25 * (ratio * spacing) ** 2 * second_moment(kernel)
    of_unity, of_slope = lattice_sums(kernel, ratio)
    case = Case(kernel, at_particle=True)
    value, steepness = field(PLACE[None, :])[0], np.linalg.norm(slope(PLACE))
    for form in get_args(InterpolationForm):
        expected = -13.0 * (value - 2.0) * smoothing + (of_unity * value if form == "plain" else 0.0)
        assert interpolation_error(case, form, spacing, ratio) == pytest.approx(expected, rel=0.02), form
    for other in get_args(GradientForm):
        change = -13.0 * smoothing + (0.0 if other == "corrected" else of_slope)
        assert gradient_error(case, other, spacing, ratio) == pytest.approx(abs(change) * steepness, rel=0.02), other


@EVERY_KERNEL
@pytest.mark.parametrize("form", ["plain", "shepard", "linear"])
def test_order_of_interpolation_with_a_growing_ratio(kernel: KernelName, form: InterpolationForm) -> None:
    coarse, fine = (
        abs(interpolation_error(Case(kernel), form, 1.0 / n, RATIO * math.sqrt(n / 16.0))) for n in (32, 128)
    )
    assert math.log(coarse / fine) / math.log(2.0) == pytest.approx(2.0, abs=0.1)  # h halved, dx a quarter


def square(count: int) -> tuple[Particles, Floats]:
    """Return a disordered unit square of count x count particles, and the field on it."""
    spacing = 1.0 / count
    lattice = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2) + 0.5
    moved = np.random.default_rng(count).uniform(-DISORDER, DISORDER, lattice.shape)
    positions = spacing * (lattice + moved)
    return Particles(positions, 1600.0 * spacing**2, 1600.0, RATIO * spacing), field(positions)


def test_whole_square_with_its_edges_and_corners() -> None:
    points = np.random.default_rng(0).uniform(0.0, 1.0, (200, 2)).round(1)  # many on the edges and in the corners
    largest: dict[str, list[float]] = {}
    for count in (12, 48):
        particles, values = square(count)
        for form in ("plain", "corrected"):
            errors = gradient(particles, values, form) - slope(particles.sources.positions)
            largest.setdefault(form, []).append(float(np.abs(errors).max()))
        error = interpolate(particles, values, points, "linear") - field(points)
        largest.setdefault("linear", []).append(float(np.abs(error).max()))
    orders = {form: math.log(coarse / fine) / math.log(4.0) for form, (coarse, fine) in largest.items()}
    assert orders["plain"] == pytest.approx(-1.0, abs=0.25)
    assert orders["corrected"] == pytest.approx(1.0, abs=0.25)
    assert orders["linear"] == pytest.approx(2.0, abs=0.25)
