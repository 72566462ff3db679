"""What the sums keep exactly, on disordered particles of different masses and densities too."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.sph.fields import (
    GRADIENT_CODES,
    INTERPOLATION_CODES,
    GradientForm,
    InterpolationForm,
    KernelName,
    Particles,
    gradient,
    interpolate,
    pseudo_inverse,
)
from blocksim.kernels.sph.functions import KERNEL_CODES, kernel_slope, kernel_value

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Floats
    from tests.kernels.sph.conftest import Scatter

EVERY_KERNEL = pytest.mark.parametrize("kernel", get_args(KernelName))
POINTS = np.array([[0.0, 0.0], [-0.5, 0.3], [0.61, 0.61], [0.23, -0.41]])  # inside, and on edges and corners
ROUND_OFF = 1e-12


def test_names_in_the_types_are_those_with_codes() -> None:
    assert set(get_args(KernelName)) == set(KERNEL_CODES)
    assert set(get_args(InterpolationForm)) == set(INTERPOLATION_CODES)
    assert set(get_args(GradientForm)) == set(GRADIENT_CODES)


def way(particles: Particles, points: Floats) -> tuple[Floats, Floats]:
    """Return r - r_b for every point and particle, and its length."""
    apart = points[:, None, :] - particles.sources.positions[None, :, :]
    return apart, np.hypot(apart[..., 0], apart[..., 1])


def dense(function: Callable[..., float], particles: Particles, distance: Floats) -> Floats:
    """Return W or dW/dr for a table of distances."""
    sources = particles.sources
    table: Floats = np.vectorize(function)(sources.function, distance, sources.smoothing_length)
    return table


def gradients_of_kernel(particles: Particles) -> Floats:
    """Return grad_a W_ab for all pairs (a, b)."""
    apart, distance = way(particles, particles.sources.positions)
    return dense(kernel_slope, particles, distance)[..., None] * apart / np.maximum(distance, 1e-300)[..., None]


@EVERY_KERNEL
def test_plain_interpolation_is_equation_1(scatter: Scatter, kernel: KernelName) -> None:
    particles = scatter(kernel)
    sources = particles.sources
    values = np.random.default_rng(1).normal(size=sources.mass.size)
    w = dense(kernel_value, particles, way(particles, POINTS)[1])
    expected = (sources.mass * values / sources.density * w).sum(axis=1)
    np.testing.assert_allclose(interpolate(particles, values, POINTS), expected, rtol=ROUND_OFF)


@EVERY_KERNEL
def test_plain_and_symmetric_gradients_are_their_equations(scatter: Scatter, kernel: KernelName) -> None:
    particles = scatter(kernel)
    m, rho = particles.sources.mass, particles.sources.density
    values = np.random.default_rng(1).normal(size=m.size)
    slopes = gradients_of_kernel(particles)
    plain = np.einsum("b,abk->ak", m * values / rho, slopes)
    symmetric = np.einsum("a,ab,abk->ak", rho, m * (values[:, None] / rho[:, None] ** 2 + values / rho**2), slopes)
    np.testing.assert_allclose(gradient(particles, values), plain, atol=ROUND_OFF * np.abs(plain).max())
    np.testing.assert_allclose(
        gradient(particles, values, "symmetric"), symmetric, atol=ROUND_OFF * np.abs(symmetric).max()
    )


@EVERY_KERNEL
@given(x=st.floats(-0.3, 0.3), y=st.floats(-0.3, 0.3))
def test_kernel_gradient_is_antisymmetric_to_the_last_bit(kernel: KernelName, x: float, y: float) -> None:
    pair = Particles([[0.1, 0.2], [0.1 + x, 0.2 + y]], mass=1.0, density=1.0, smoothing_length=0.15, kernel=kernel)
    of_b_at_a = gradient(pair, [0.0, 1.0])[0]
    of_a_at_b = gradient(pair, [1.0, 0.0])[1]
    assert (of_b_at_a == -of_a_at_b).all()
    assert of_b_at_a @ (x, y) >= 0.0  # W grows towards b


@EVERY_KERNEL
def test_forces_of_the_symmetric_form_and_their_moments_add_up_to_zero(scatter: Scatter, kernel: KernelName) -> None:
    particles = scatter(kernel)
    sources = particles.sources
    values = np.random.default_rng(2).normal(5.0, 1.0, sources.mass.size)
    forces = -(sources.mass / sources.density)[:, None] * gradient(particles, values, "symmetric")
    size = np.abs(forces).sum()
    x, y = sources.positions.T
    assert np.abs(forces.sum(axis=0)).max() <= 1e-14 * size
    assert abs((x * forces[:, 1] - y * forces[:, 0]).sum()) <= 1e-14 * size
    plain = -(sources.mass / sources.density)[:, None] * gradient(particles, values, "plain")
    assert np.abs(plain.sum(axis=0)).max() > 1e-3 * np.abs(plain).sum()


@EVERY_KERNEL
@pytest.mark.parametrize("seed", range(3))
def test_corrected_forms_reproduce_linear_fields(scatter: Scatter, kernel: KernelName, seed: int) -> None:
    particles = scatter(kernel, seed)

    def linear(places: Floats) -> Floats:
        return 7.0 - 3.0 * places[:, 0] + 2.0 * places[:, 1]

    values = linear(particles.sources.positions)
    assert interpolate(particles, values, POINTS, "linear") == pytest.approx(linear(POINTS), rel=ROUND_OFF)
    slopes = gradient(particles, values, "corrected")
    np.testing.assert_allclose(slopes, np.broadcast_to([-3.0, 2.0], slopes.shape), rtol=ROUND_OFF * 10)
    # and nothing else does
    for form in ("plain", "shepard"):
        assert np.abs(interpolate(particles, values, POINTS, form) - linear(POINTS)).max() > 0.01
    for other in ("plain", "symmetric", "difference"):
        assert np.abs(gradient(particles, values, other) - (-3.0, 2.0)).max() > 0.1


@EVERY_KERNEL
def test_constants_are_reproduced_by_all_but_the_plain_forms(scatter: Scatter, kernel: KernelName) -> None:
    particles = scatter(kernel)
    assert interpolate(particles, 5.0, POINTS, "shepard") == pytest.approx(5.0, rel=ROUND_OFF)
    assert interpolate(particles, 5.0, POINTS, "linear") == pytest.approx(5.0, rel=ROUND_OFF)
    assert not gradient(particles, 5.0, "difference").any()
    assert not gradient(particles, 5.0, "corrected").any()


def test_result_turns_with_the_particles(scatter: Scatter) -> None:
    particles = scatter()
    sources = particles.sources
    c, s = np.cos(0.7), np.sin(0.7)
    rotation = np.array([[c, -s], [s, c]])
    turned = Particles(sources.positions @ rotation.T + (3.0, -8.0), sources.mass, sources.density, 0.15)
    values = np.random.default_rng(3).normal(size=sources.mass.size)
    for form in get_args(GradientForm):
        before, after = gradient(particles, values, form), gradient(turned, values, form)
        np.testing.assert_allclose(after, before @ rotation.T, atol=1e-11 * np.abs(before).max())
    for kind in get_args(InterpolationForm):
        one = interpolate(particles, values, POINTS, kind)
        two = interpolate(turned, values, POINTS @ rotation.T + (3.0, -8.0), kind)
        assert two == pytest.approx(one, rel=1e-10)


def on_a_line(angle: float) -> tuple[Particles, Floats]:
    """Return nine particles on a line through the origin, and its direction."""
    along = np.array([np.cos(angle), np.sin(angle)])
    places = np.outer(np.linspace(-0.4, 0.4, 9) ** 3 + np.linspace(-0.4, 0.4, 9), along)
    return Particles(places, 1.0, 100.0, 0.2), along


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2, 2.5])
def test_neighbours_on_a_line_know_the_slope_along_it_only(angle: float) -> None:
    particles, along = on_a_line(angle)
    steepest = np.array([2.0, -5.0])
    values = 3.0 + particles.sources.positions @ steepest
    expected = np.broadcast_to(along * (steepest @ along), (9, 2))
    np.testing.assert_allclose(gradient(particles, values, "corrected"), expected, atol=1e-11)
    points = np.array([0.05 * along, 0.05 * along + 0.1 * np.array([-along[1], along[0]])])  # on the line, beside it
    on_it = 3.0 + 0.05 * steepest @ along
    assert interpolate(particles, values, points, "linear") == pytest.approx([on_it, on_it], rel=1e-11)


def test_particle_alone_has_no_gradient_and_its_value_around_it() -> None:
    alone = Particles([[1.0, 1.0]], 1.0, 100.0, 0.1)
    for form in get_args(GradientForm):
        assert gradient(alone, [7.0], form).tolist() == [[0.0, 0.0]]
    for kind in ("shepard", "linear"):
        assert interpolate(alone, [7.0], [[1.05, 1.02]], kind) == pytest.approx([7.0], rel=1e-15)


def test_without_particles_nearby_the_plain_sum_is_zero_and_a_mean_is_none() -> None:
    alone = Particles([[1.0, 1.0]], 1.0, 100.0, 0.1)
    assert interpolate(alone, [7.0], [[2.0, 1.0]], "plain").tolist() == [0.0]
    for form in ("shepard", "linear"):
        assert np.isnan(interpolate(alone, [7.0], [[2.0, 1.0]], form)).all()


def test_particles_in_one_place_do_no_harm(scatter: Scatter) -> None:
    once = scatter().sources.positions
    twice = Particles(np.concatenate([once, once]), 8.0, 1600.0, 0.15)
    values = 1.0 + twice.sources.positions @ (2.0, -5.0)
    slopes = gradient(twice, values, "corrected")
    np.testing.assert_allclose(slopes, np.broadcast_to([2.0, -5.0], slopes.shape), rtol=1e-11)


@given(
    entries=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    rank=st.sampled_from([1, 2]),
)
def test_pseudo_inverse_is_the_one_of_numpy(entries: tuple[float, float, float], rank: int) -> None:
    a, b, c = entries
    root = np.array([[a, b], [0.0, c if rank == 2 else 0.0]])
    matrix = root.T @ root
    low, high = np.linalg.eigvalsh(matrix)
    least = 1e-6 * max(high, 1e-3)
    if abs(low - least) < 0.1 * least or abs(high - least) < 0.1 * least:
        return
    xx, xy, yy = pseudo_inverse(matrix[0, 0], matrix[0, 1], matrix[1, 1], least)
    expected = np.linalg.pinv(matrix, rcond=least / high, hermitian=True) if high > least else np.zeros((2, 2))
    np.testing.assert_allclose([[xx, xy], [xy, yy]], expected, atol=1e-8 * max(1.0, np.abs(expected).max()))
