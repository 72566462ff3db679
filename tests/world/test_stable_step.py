"""The admissible step: its frequency bound against eigenvalues, and what must never make it larger."""

from math import cos, inf, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.world.step import BlockKind, ContactStiffness, frequency_squared, stable_step

sizes = st.floats(1e-3, 1.0)
ratios = st.floats(0.0, 6.0)
shears = st.floats(0.05, 1.5)  # of the normal stiffness
K = 9.5e8


def body_of(size_x: float, size_y: float, density: float = 2700.0, depth: float = 0.05) -> BlockKind:
    mass = density * size_x * size_y * depth
    return BlockKind(0.5 * size_x, 0.5 * size_y, 1.0 / mass, 12.0 / (mass * (size_x**2 + size_y**2)), 1)


def stiffness_at(points: list[tuple[float, float, float]], normal: float, shear: float) -> np.ndarray:
    """Return the 3 x 3 stiffness of a body for contact points x, y and the angle of their normal."""
    total = np.zeros((3, 3))
    for x, y, angle in points:
        for stiffness, direction in ((normal, angle), (shear, angle + pi / 2)):
            nx, ny = cos(direction), sin(direction)
            row = np.array([nx, ny, x * ny - y * nx])
            total += stiffness * np.outer(row, row)
    return total


def largest(body: BlockKind, stiffness: np.ndarray) -> float:
    root = np.sqrt([body.inverse_mass, body.inverse_mass, body.inverse_inertia])
    return float(np.linalg.eigvalsh(root[:, None] * stiffness * root).max())


@given(w=sizes, h=sizes, ratio=shears)
def test_bound_is_the_largest_eigenvalue_of_a_face_contact(w: float, h: float, ratio: float) -> None:
    body = body_of(w, h)
    on_base = stiffness_at([(-w / 2, -h / 2, pi / 2), (w / 2, -h / 2, pi / 2)], K, ratio * K)
    on_side = stiffness_at([(w / 2, -h / 2, pi), (w / 2, h / 2, pi)], K, ratio * K)
    expected = max(largest(body, on_base), largest(body, on_side))
    assert frequency_squared(body, K, ratio * K) == pytest.approx(expected, rel=1e-9)


@given(w=sizes, h=sizes, ratio=st.floats(0.3, 1.5), place=st.floats(-1.0, 1.0), second=st.floats(-1.0, 1.0))
def test_partly_overlapping_faces_are_faster_than_the_bound_by_a_fifth_at_most(
    w: float, h: float, ratio: float, place: float, second: float
) -> None:
    # both points near one end see more rotation than the two ends do; a safety far below one has room for that
    points = [(place * w / 2, -h / 2, pi / 2), (second * w / 2, -h / 2, pi / 2)]
    frequency = sqrt(largest(body_of(w, h), stiffness_at(points, K, ratio * K)))
    assert frequency <= 1.2 * sqrt(frequency_squared(body_of(w, h), K, ratio * K))


@given(w=sizes, h=sizes, ratio=st.floats(0.3, 1.0), angle=st.floats(0.0, 2.0 * pi))
def test_single_corner_is_not_faster_than_the_bound(w: float, h: float, ratio: float, angle: float) -> None:
    corner = stiffness_at([(w / 2, h / 2, angle)], K, ratio * K)
    assert largest(body_of(w, h), corner) <= 1.000001 * frequency_squared(body_of(w, h), K, ratio * K)


@given(w=sizes, h=sizes, other=sizes, ratio=shears, shift=st.floats(-1.0, 1.0))
def test_two_bodies_are_not_stiffer_than_the_sum_of_both_bounds(
    w: float, h: float, other: float, ratio: float, shift: float
) -> None:
    a, b = body_of(w, h), body_of(other, other)
    place = shift * other / 2
    rows = []
    for x in (-w / 2, w / 2):  # corners of a on the top of b, whose centre lies at `place`
        for nx, ny, stiffness in ((0.0, 1.0, K), (1.0, 0.0, ratio * K)):
            on_a = [nx, ny, x * ny + h / 2 * nx]
            on_b = [-nx, -ny, -((x - place) * ny - other / 2 * nx)]
            rows.append(sqrt(stiffness) * np.array(on_a + on_b))
    inverse = [a.inverse_mass, a.inverse_mass, a.inverse_inertia, b.inverse_mass, b.inverse_mass, b.inverse_inertia]
    scaled = np.array(rows) * np.sqrt(inverse)
    inside = all(abs(x - place) <= other / 2 for x in (-w / 2, w / 2))
    bound = frequency_squared(a, K, ratio * K) + frequency_squared(b, K, ratio * K)
    assert not inside or float(np.linalg.eigvalsh(scaled @ scaled.T).max()) <= 1.000001 * bound


@given(w=sizes, h=sizes, ratio=ratios, safety=st.floats(0.01, 1.0))
def test_safety_is_the_share_of_the_stability_limit(w: float, h: float, ratio: float, safety: float) -> None:
    body, contact = body_of(w, h), ContactStiffness(K, 0.8 * K, ratio)
    whole = stable_step([(body, None, contact)], 1.0)
    assert stable_step([(body, None, contact)], safety) == pytest.approx(safety * whole, rel=1e-12)
    assert whole * sqrt(frequency_squared(body, K, 0.8 * K)) == pytest.approx(2.0 / max(1.0, ratio / 2), rel=1e-12)


def test_stiffest_pair_decides() -> None:
    big, small = body_of(0.1, 0.1), body_of(0.01, 0.01)
    soft, hard = ContactStiffness(K, K, 0.5), ContactStiffness(10 * K, K, 0.5)
    alone = stable_step([(small, None, hard)], 0.05)
    assert stable_step([(big, None, soft), (small, None, hard), (big, big, soft)], 0.05) == alone


def test_two_bodies_get_a_smaller_step_than_one_on_the_ground() -> None:
    body, contact = body_of(0.03, 0.02), ContactStiffness(K, 0.8 * K, 0.5)
    on_ground = stable_step([(body, None, contact)], 0.05)
    assert stable_step([(body, body, contact)], 0.05) == pytest.approx(on_ground / sqrt(2.0), rel=1e-12)


def test_scene_in_which_nothing_can_move_has_no_limit() -> None:
    wall = BlockKind(0.5, 0.5, 0.0, 0.0, 1)
    assert (
        stable_step([(wall, None, ContactStiffness(K, K, 0.5)), (wall, wall, ContactStiffness(K, K, 0.5))], 1.0) == inf
    )
    assert stable_step([], 1.0) == inf
