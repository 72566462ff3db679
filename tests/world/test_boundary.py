"""Boundary particles of a rectangle."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocksim.world.boundary import BoundaryParticles, boundary_particles

sides = st.floats(1e-3, 0.2)
spacings = st.floats(2e-4, 0.3)


def on_sides(particles: BoundaryParticles, width: float, height: float) -> list[np.ndarray]:
    """Return the positions along the sides, both corners included: below, right, above, left."""
    x, y, tiny = particles.x, particles.y, 1e-12
    return [
        np.sort(x[np.abs(y + height / 2) < tiny]),
        np.sort(y[np.abs(x - width / 2) < tiny]),
        np.sort(x[np.abs(y - height / 2) < tiny]),
        np.sort(y[np.abs(x + width / 2) < tiny]),
    ]


@given(width=sides, height=sides, spacing=spacings)
def test_tributary_lengths_sum_to_the_perimeter(width: float, height: float, spacing: float) -> None:
    particles = boundary_particles(width, height, spacing)
    assert particles.tributary_length.sum() == pytest.approx(2.0 * (width + height), rel=1e-12)
    assert particles.tributary_length.min() > 0.0


@given(width=sides, height=sides, spacing=spacings)
def test_every_side_is_divided_evenly_and_no_wider_than_asked(width: float, height: float, spacing: float) -> None:
    particles = boundary_particles(width, height, spacing)
    for places, side in zip(on_sides(particles, width, height), (width, height, width, height), strict=True):
        gaps = np.diff(places)
        assert gaps.max() <= spacing * (1.0 + 1e-9)
        assert gaps == pytest.approx(np.full(len(gaps), gaps[0]), rel=1e-6)
        assert len(gaps) == max(1, np.ceil(side / spacing * (1.0 - 1e-12)))


@given(width=sides, height=sides, spacing=spacings)
def test_corners_are_particles_and_no_particle_comes_twice(width: float, height: float, spacing: float) -> None:
    particles = boundary_particles(width, height, spacing)
    points = set(zip(particles.x.tolist(), particles.y.tolist(), strict=True))
    assert len(points) == len(particles.x)
    for sx, sy in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        assert min(hypot(x - sx * width, y - sy * height) for x, y in points) < 1e-15


@given(width=sides, height=sides, spacing=spacings)
def test_particles_go_round_counter_clockwise_from_the_lower_left(width: float, height: float, spacing: float) -> None:
    particles = boundary_particles(width, height, spacing)
    assert [particles.x[0], particles.y[0]] == [-width / 2, -height / 2]
    x, y = particles.x, particles.y
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert area == pytest.approx(width * height, rel=1e-9)


def test_tributary_length_reaches_half_way_to_both_neighbours() -> None:
    particles = boundary_particles(0.032, 0.025, 2e-3)
    ring = np.stack([particles.x, particles.y], axis=1)
    ahead = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T)
    assert particles.tributary_length == pytest.approx(0.5 * (ahead + np.roll(ahead, 1)), rel=1e-9)


def test_round_off_in_the_division_adds_no_particle() -> None:
    assert len(boundary_particles(0.3, 0.3, 0.1).x) == 12  # 0.3/0.1 is just below 3, 0.1 * 3 just above 0.3
    assert len(boundary_particles(0.032, 0.025, 1e-3).x) == 2 * (32 + 25)


@pytest.mark.parametrize("values", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 0.0)])
def test_sizes_and_spacing_that_are_not_positive_are_refused(values: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        boundary_particles(*values)
