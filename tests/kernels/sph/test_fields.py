"""Smoothing functions, sums over particles, what they keep exactly, and the face for users."""

import doctest
import math
import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from blocksim.kernels.common.arrays import Floats
from blocksim.kernels.sph import fields
from blocksim.kernels.sph.fields import KernelName, Particles, find_neighbours, gradient, interpolate
from blocksim.kernels.sph.functions import KERNEL_CODES, kernel_slope, kernel_value, support_radius
from tests.golden import Golden

H = 0.013
EVERY_CODE = pytest.mark.parametrize("code", KERNEL_CODES.values(), ids=KERNEL_CODES.keys())


@pytest.mark.parametrize(("name", "support"), [("cubic-spline", 2.0), ("wendland-c2", 2.0), ("quintic-spline", 3.0)])
def test_function_falls_within_its_support_is_zero_beyond_and_has_the_integral_one(name: str, support: float) -> None:
    code, h = KERNEL_CODES[name], H
    assert support_radius(code, h) == pytest.approx(support * h)
    inside = [kernel_value(code, q * h, h) for q in np.linspace(0.0, 0.99 * support, 200)]
    assert min(inside) > 0.0
    assert (np.diff(inside) < 0.0).all()
    for q in (support, 1.001 * support, 1e6):
        assert kernel_value(code, q * h, h) == kernel_slope(code, q * h, h) == 0.0
    pieces = [  # knot by knot
        quad(lambda q: 2.0 * math.pi * q * h * kernel_value(code, q * h, h) * h, i, i + 1, epsabs=1e-13, epsrel=1e-12)
        for i in range(round(support))
    ]
    assert sum(piece for piece, _ in pieces) == pytest.approx(1.0, abs=1e-12)


@EVERY_CODE
@given(q=st.floats(0.0, 3.2))
def test_slope_is_the_derivative(code: int, q: float) -> None:
    # central difference of step e: error W''' e^2/6; |W'''| < 10/h^5 for all three
    step = 1e-4 * H
    r = max(q * H, step)
    difference = (kernel_value(code, r + step, H) - kernel_value(code, r - step, H)) / (2.0 * step)
    assert kernel_slope(code, r, H) == pytest.approx(difference, abs=3e-8 / H**3)
    assert kernel_slope(code, r, H) <= 0.0


EVERY_KERNEL = pytest.mark.parametrize("kernel", get_args(KernelName))
POINTS = np.array([[0.0, 0.0], [-0.5, 0.3], [0.61, 0.61], [0.23, -0.41]])  # inside, and on edges and corners
ROUND_OFF = 1e-12


def scatter(kernel: KernelName) -> Particles:
    """Throw 12 x 12 particles, 0.1 m apart and moved by up to 0.03 m, with masses and densities that differ."""
    random = np.random.default_rng(0)
    lattice = np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1).reshape(-1, 2)
    positions = 0.1 * (lattice + random.uniform(-0.3, 0.3, lattice.shape)) - 0.5
    density = random.uniform(1000.0, 2000.0, len(lattice))
    return Particles(positions, density * 0.01 * random.uniform(0.8, 1.2, len(lattice)), density, 0.15, kernel)


def values_and_slopes(particles: Particles, places: Floats) -> tuple[Floats, Floats]:
    """Return W_ab and grad_a W_ab for all places a and particles b."""
    sources = particles.sources
    apart = places[:, None, :] - sources.positions[None, :, :]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    value, slope = (
        np.vectorize(function)(sources.function, distance, sources.smoothing_length)
        for function in (kernel_value, kernel_slope)
    )
    return value, slope[..., None] * apart / np.maximum(distance, 1e-300)[..., None]


@EVERY_KERNEL
def test_sums_over_particles_are_their_equations(kernel: KernelName) -> None:
    particles = scatter(kernel)
    m, rho, places = particles.sources.mass, particles.sources.density, particles.sources.positions
    values = np.random.default_rng(1).normal(size=m.size)
    _, slopes = values_and_slopes(particles, places)
    pairs: dict[Any, Any] = {
        "plain": values / rho * np.ones_like(rho)[:, None],
        "symmetric": rho[:, None] * (values[:, None] / rho[:, None] ** 2 + values / rho**2),
        "difference": (values - values[:, None]) / rho,
    }
    for form, terms in pairs.items():
        expected = np.einsum("b,ab,abk->ak", m, terms, slopes)
        np.testing.assert_allclose(gradient(particles, values, form), expected, atol=ROUND_OFF * np.abs(expected).max())
    weights = values_and_slopes(particles, POINTS)[0] * (m / rho)
    assert interpolate(particles, values, POINTS, "plain") == pytest.approx(weights @ values, rel=ROUND_OFF)
    mean = weights @ values / weights.sum(axis=1)
    assert interpolate(particles, values, POINTS, "shepard") == pytest.approx(mean, rel=ROUND_OFF)


@EVERY_KERNEL
def test_corrected_forms_reproduce_linear_fields(kernel: KernelName) -> None:
    particles = scatter(kernel)

    def linear(places: Floats) -> Floats:
        return 7.0 - 3.0 * places[:, 0] + 2.0 * places[:, 1]

    values = linear(particles.sources.positions)
    assert interpolate(particles, values, POINTS, "linear") == pytest.approx(linear(POINTS), rel=ROUND_OFF)
    slopes = gradient(particles, values, "corrected")
    np.testing.assert_allclose(slopes, np.broadcast_to([-3.0, 2.0], slopes.shape), rtol=ROUND_OFF * 10)


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2])
def test_neighbours_on_a_line_know_the_slope_along_it_only(angle: float) -> None:
    along, steepest = np.array([np.cos(angle), np.sin(angle)]), np.array([2.0, -5.0])
    places = np.outer(np.linspace(-0.4, 0.4, 9) ** 3 + np.linspace(-0.4, 0.4, 9), along)
    particles, values = Particles(places, 1.0, 100.0, 0.2), 3.0 + places @ steepest
    expected = np.broadcast_to(along * (steepest @ along), (9, 2))
    np.testing.assert_allclose(gradient(particles, values, "corrected"), expected, atol=1e-11)
    points = np.array([0.05 * along, 0.05 * along + 0.1 * np.array([-along[1], along[0]])])  # on the line, beside it
    on_it = 3.0 + 0.05 * steepest @ along
    assert interpolate(particles, values, points, "linear") == pytest.approx([on_it, on_it], rel=1e-11)


def test_without_particles_nearby_the_plain_sum_is_zero_and_a_mean_is_none() -> None:
    alone = Particles([[1.0, 1.0]], 1.0, 100.0, 0.1)
    assert interpolate(alone, [7.0], [[2.0, 1.0]], "plain").tolist() == [0.0]
    for form in ("shepard", "linear"):
        assert np.isnan(interpolate(alone, [7.0], [[2.0, 1.0]], form)).all()


GOOD: dict[str, Any] = {
    "positions": [[0.0, 0.0], [0.1, 0.0]],
    "mass": [1.0, 2.0],
    "density": 1000.0,
    "smoothing_length": 0.1,
}


@pytest.mark.usefixtures("compiler")
def test_example_of_the_documentation_gives_what_it_says() -> None:
    assert doctest.testmod(fields) == (0, 10)


NAN, INF = math.nan, math.inf
WRONG: dict[str, list[Any]] = {
    "positions": [[[0, NAN], [0, 0]], [[0, INF], [0, 0]], [[0, 1e31], [0, 0]], [0, 1], [[0, 1, 2]], np.empty((0, 2))],
    "mass": [[1, NAN], [1, 0], [1, -1], [1, 1, 1]],
    "density": [0, [[1, 1]]],
    "smoothing_length": [0, NAN, 1e-31],
    "kernel": ["gaussian"],
    "values": [[1], [1, NAN], [[1, 2]], [1, 2, 3]],
    "slopes": [[1], [1, NAN], [[1, 2]], [1, 2, 3]],
    "points": [[0, 0], [[0, NAN]], [[0, 0, 0]]],
    "form": ["cubic"],
    "form of a gradient": ["cubic"],
    "search": [
        ([[0, NAN]], [[0, 0]], 1),
        ([[0, 0]], [[INF, 0]], 1),
        *(([[0, 0]], [[0, 0]], radius) for radius in (0, NAN)),
        ([], [[0, 0]], 1),
    ],
}


def test_particles_that_make_no_sense_are_refused(golden: Golden) -> None:
    """And so are values, points, forms and searches for neighbours."""
    good = Particles(**GOOD)
    calls: dict[str, Callable[[Any], object]] = {
        "values": lambda values: interpolate(good, values, [[0.0, 0.0]]),
        "slopes": lambda values: gradient(good, values),
        "points": lambda points: interpolate(good, 1.0, points),
        "form": lambda form: interpolate(good, 1.0, [[0.0, 0.0]], form),
        "form of a gradient": lambda form: gradient(good, 1.0, form),
        "search": lambda given: find_neighbours(np.array(given[0]).reshape(-1, 2), np.array(given[1]), given[2]),
    }
    said = []
    for name, values in WRONG.items():
        for bad in values:
            with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is in the golden file
                calls[name](bad) if name in calls else Particles(**GOOD | {name: bad})
            said.append(f"{name} = {bad}: {caught.value}")
    golden("\n".join(said))


@pytest.mark.parametrize("h", [1e-30, 1e-5, 1e30])
@pytest.mark.parametrize(("mass", "density"), [(1e-30, 1e30), (1e30, 1e-30), (1.0, 1.0)])
def test_numbers_at_the_limits_overflow_nowhere(h: float, mass: float, density: float) -> None:
    pair = Particles([[0.0, 0.0], [0.5 * h, 0.0]], mass, density, h)
    assert interpolate(pair, [1e30, 1e30], [[0.1 * h, 0.0]], "linear") == pytest.approx([1e30])
    slopes = gradient(pair, [0.0, 1e30], "corrected") / 1e30 * h
    assert slopes.ravel().tolist() == pytest.approx([2.0, 0.0, 2.0, 0.0])
    assert np.isfinite(gradient(pair, [1e30, 1e30], "symmetric")).all()


ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "blocksim/kernels/README.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(
    r"<!-- sph example -->\n```python\n(.*?)```\n\n```\n(.*?)```\n<!-- end of sph example -->", re.DOTALL
)


@pytest.mark.usefixtures("compiler")
def test_example_prints_what_the_readme_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = EXAMPLE.search(TEXT)
    assert found is not None
    (tmp_path / "example.py").write_text(found.group(1), encoding="utf-8")
    runpy.run_path(str(tmp_path / "example.py"))
    assert capsys.readouterr().out == found.group(2)
