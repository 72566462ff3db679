"""Contact manifolds of two blocks, against polygons clipped another way, and what all of them have in common."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.nonsmooth.arrays import AWAY, CONSTRAINT, FAR, OPEN, STATE, TOUCHING
from blocksim.kernels.nonsmooth.narrow_phase import find_manifolds
from tests.kernels.nonsmooth.references import apart, brought_near, meet, meeting, places_of
from tests.kernels.nonsmooth.scenes import Block, listed, listed_constraints, posed

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record
    from tests.kernels.conftest import MakeBody

MARGIN = 2e-3  # m
EXAMPLES = 250
FEW = 100  # without the compiler


@pytest.fixture(scope="module")
def pairs(make_body: MakeBody, pace: int) -> list[tuple[Record, Record]]:
    """Return pairs of blocks with gaps and overlaps of up to 4 mm, of which no faces are nearly parallel."""
    random = np.random.default_rng(1)
    found = []
    for _ in range(EXAMPLES if pace == 1 else FEW):
        first, turn, way = random.uniform(-4.0, 4.0), random.uniform(0.12, 1.45), random.uniform(-math.pi, math.pi)
        second = first + turn + math.pi / 2 * random.integers(4)
        sides = random.uniform(0.02, 0.06, 4)
        b = make_body(0.3, -0.2, first, width=sides[0], height=sides[1])
        a = brought_near(make_body, b, sides[2:], second, way, random.uniform(-4e-3, 4e-3))
        found.append((a, b))
    return found


def row_of(a: Record, b: Record, margin: float = MARGIN) -> Record:
    """Return the constraint of two bodies at rest that have not touched before."""
    return meet(a, b, margin)


def test_manifold_is_what_two_clipped_polygons_have(pairs: list[tuple[Record, Record]]) -> None:
    found = []
    for a, b in pairs:
        constraint, expected = row_of(a, b), meeting(a, b, MARGIN)
        is_near = apart(a, b) <= MARGIN and expected.gaps.size > 0
        assert bool(constraint.reach != AWAY) is is_near
        found.append(constraint.reach)
        if not is_near:
            continue
        assert (constraint.nx, constraint.ny) == pytest.approx(expected.normal, abs=1e-6)  # round-off
        gaps = np.array([constraint.gap_one, constraint.gap_two])
        near = gaps < FAR
        assert gaps[near] == pytest.approx(expected.gaps, abs=1e-8)
        for body, of_a in ((a, True), (b, False)):
            assert places_of(constraint, body, of_a=of_a)[near] == pytest.approx(expected.places, abs=1e-7)
        assert constraint.reach == (TOUCHING if gaps.min() <= 0.0 else OPEN)
    assert min(found.count(reach) for reach in (AWAY, OPEN, TOUCHING)) > len(pairs) // 10


def test_blocks_pushed_apart_by_the_deepest_point_just_touch(
    make_body: MakeBody, pairs: list[tuple[Record, Record]]
) -> None:
    touching = 0
    for a, b in pairs:
        constraint = row_of(a, b)
        if constraint.reach != TOUCHING:
            continue
        depth = -min(constraint.gap_one, constraint.gap_two)
        assert depth == pytest.approx(-apart(a, b), abs=1e-12)
        moved = make_body(
            a.x + depth * constraint.nx, a.y + depth * constraint.ny, a.angle, width=2 * a.half_x, height=2 * a.half_y
        )
        assert apart(moved, b) == pytest.approx(0.0, abs=1e-12)
        touching += 1
    assert touching > len(pairs) // 10


def test_bodies_swapped_have_the_same_points_and_the_opposite_normal(pairs: list[tuple[Record, Record]]) -> None:
    for a, b in pairs:
        one, two = row_of(a, b), row_of(b, a)
        assert one.reach == two.reach
        if one.reach != AWAY:
            assert (one.nx, one.ny) == (-two.nx, -two.ny)
            assert (one.gap_one, one.gap_two) == (two.gap_two, two.gap_one)
            assert places_of(one, a, of_a=True) == pytest.approx(places_of(two, a, of_a=False)[::-1], abs=1e-15)


def mirrored(body: Record, make_body: MakeBody) -> Record:
    return make_body(-body.x, body.y, -body.angle, width=2 * body.half_x, height=2 * body.half_y)


def test_mirror_image_has_the_mirrored_points(make_body: MakeBody, pairs: list[tuple[Record, Record]]) -> None:
    for a, b in pairs:
        constraint, image = row_of(a, b), row_of(mirrored(a, make_body), mirrored(b, make_body))
        assert constraint.reach == image.reach
        if constraint.reach != AWAY:
            assert (-constraint.nx, constraint.ny) == pytest.approx((image.nx, image.ny), abs=1e-15)
            assert (constraint.gap_one, constraint.gap_two) == pytest.approx((image.gap_two, image.gap_one), abs=1e-15)
            expected = (places_of(constraint, a, of_a=True) * (-1.0, 1.0))[::-1]
            assert places_of(image, mirrored(a, make_body), of_a=True) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("quarter", range(4))
def test_faces_that_lie_flat_on_one_another_have_the_ends_of_their_overlap(make_body: MakeBody, quarter: int) -> None:
    """Whichever faces they are: the upper block is turned by right angles."""
    upper = make_body(0.01, 0.0125 + 0.016 + 1e-4, quarter * math.pi / 2, width=0.032, height=0.032)
    constraint = row_of(upper, make_body(0.0, 0.0, width=0.032, height=0.025))
    assert (constraint.nx, constraint.ny) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert (constraint.gap_one, constraint.gap_two) == pytest.approx((1e-4, 1e-4), abs=1e-15)
    assert sorted(places_of(constraint, upper, of_a=True)[:, 0].tolist()) == pytest.approx([-0.006, 0.016], abs=1e-12)


@pytest.mark.parametrize(("sunk", "way"), [(5e-6, -1.0), (5e-6, 1.0), (5e-5, 1.0)])
def test_block_that_has_sunk_in_a_little_is_not_stopped_by_the_side_of_the_next(
    make_body: MakeBody, sunk: float, way: float
) -> None:
    """It overlaps the side of the next block by less than it has sunk into it: separating axes alone would stop it."""
    slider = make_body(way * (0.032 - 0.1 * sunk), 0.025 - sunk)
    constraint = row_of(slider, make_body())
    assert (constraint.nx, constraint.ny) == (0.0, 1.0)
    assert min(constraint.gap_one, constraint.gap_two) == pytest.approx(-sunk, abs=1e-15)


def test_block_that_stands_beside_another_is_held_by_its_side(make_body: MakeBody) -> None:
    constraint = row_of(make_body(0.032 - 1e-5, 0.02), make_body())
    assert (constraint.nx, constraint.ny) == (1.0, 0.0)
    assert (constraint.gap_one, constraint.gap_two) == pytest.approx((-1e-5, -1e-5), abs=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_four_pairs_at_a_time_have_the_bits_of_each_alone(seed: int, pace: int) -> None:
    """Open, pressed and turned ones; the ones alone are of an odd number that is left."""
    random = np.random.default_rng(seed)
    count = 20 if pace == 1 else 8
    blocks = [Block(*random.uniform(0.0, (0.1, 0.1, 6.0)), *random.normal(size=2)) for _ in range(count)]
    scene = listed(posed(blocks, substeps=4))
    constraints: Any = listed_constraints(scene)
    find_manifolds(scene, 0, constraints.size)
    angles = np.arctan2(constraints.ny, constraints.nx) + random.uniform(-0.8, 0.8, constraints.size)
    constraints["normal_one"] = random.uniform(0.0, 1.0, constraints.size) * (
        random.uniform(size=constraints.size) < 0.5
    )
    constraints["normal_two"], constraints["shear"] = constraints["normal_one"] / 2, -constraints["normal_one"] / 3
    constraints["nx"], constraints["ny"] = np.cos(angles), np.sin(angles)
    alone = constraints.copy()
    find_manifolds(scene, 0, constraints.size)
    fours = constraints.copy()
    constraints[:] = alone
    for r in range(constraints.size):
        find_manifolds(scene, r, r + 1)
    assert np.array_equal(constraints.reach, fours.reach)
    for name in ("normal_one", "normal_two", "shear"):
        assert np.array_equal(constraints[name], fours[name]), name
    near = constraints.reach != AWAY
    for name in CONSTRAINT.names or ():
        assert np.array_equal(constraints[name][near], fours[name][near]), name
    assert near.sum() > 4
    assert 0 < np.count_nonzero(fours["normal_one"]) < np.count_nonzero(alone["normal_one"])


@pytest.mark.parametrize(("degrees", "is_kept"), [(24.0, True), (-24.0, True), (26.0, False), (180.0, False)])
def test_impulses_are_kept_until_the_normal_has_turned_by_25_degrees(
    make_body: MakeBody, degrees: float, is_kept: bool
) -> None:
    constraint = zeros(1, CONSTRAINT)[0]
    constraint.normal_one, constraint.normal_two, constraint.shear = 3.0, 2.0, 1.0
    constraint.nx, constraint.ny = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    constraint = meet(make_body(0.0, 0.025), make_body(), MARGIN, constraint)
    expected = (3.0, 2.0, 1.0) if is_kept else (0.0, 0.0, 0.0)
    assert (constraint.normal_one, constraint.normal_two, constraint.shear) == expected


def test_impulses_are_forgotten_where_blocks_have_parted(make_body: MakeBody) -> None:
    constraint = zeros(1, CONSTRAINT)[0]
    constraint.normal_one, constraint.normal_two, constraint.shear, constraint.ny, constraint.reach = (
        3.0,
        2.0,
        1.0,
        1.0,
        TOUCHING,
    )
    constraint = meet(make_body(0.0, 0.025 + 2 * MARGIN), make_body(), MARGIN, constraint)
    assert (constraint.normal_one, constraint.normal_two, constraint.shear, constraint.reach) == (0.0, 0.0, 0.0, AWAY)


@pytest.mark.parametrize("pressed", [True, False])
def test_contact_that_presses_has_the_normal_and_arms_of_the_middle_of_the_step(
    make_body: MakeBody, pressed: bool
) -> None:
    """One to come is taken as it is, one with an impulse of round-off too. Gaps are those of now, along that normal."""
    ahead = 1e-3
    a, b = make_body(0.004, 0.0262, 0.06), make_body(0.0, 0.0, 0.02)
    states, constraint = zeros(2, STATE), zeros(1, CONSTRAINT)[0]
    states.vx, states.vy, states.spin = (0.4, -0.1), (-0.3, 0.2), (8.0, -9.0)
    states.inverse_mass = 9.0
    constraint.normal_one, constraint.nx, constraint.ny = (
        (1e-8 if pressed else 1e-13),
        0.0,
        1.0,
    )  # 18/kg makes 1e-10 m/s
    stepping = {"touch_gap": 1e-14, "open_bias": 1e4, "substep": 1e-3}
    constraint = meet(a, b, MARGIN, constraint, states, ahead=ahead, stepping=stepping)
    time = ahead if pressed else 0.0
    late_a, late_b = (
        make_body(body.x + time * state.vx, body.y + time * state.vy, body.angle + time * state.spin)
        for body, state in zip((a, b), states, strict=True)
    )
    expected = row_of(late_a, late_b)
    names = ["nx", "ny", "arm_a", "arm_b", "width", "shear_arm_a", "shear_arm_b"]
    assert [constraint[name] for name in names] == pytest.approx([expected[name] for name in names], abs=1e-6)
    rate = constraint.nx * 0.5 + constraint.ny * -0.5 + constraint.arm_a * 8.0 + constraint.arm_b * 9.0
    assert constraint.gap_one == pytest.approx(expected.gap_one - time * rate, abs=1e-7)
    assert constraint.gap_two == pytest.approx(expected.gap_two - time * (rate - constraint.width * 17.0), abs=1e-7)
    assert bool(constraint.bend != 0.0) is pressed
