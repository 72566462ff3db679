"""Points between bodies: where, how deep, what share of a face; and what is checked of overlaps, energy and rest."""

from math import cos, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import (
    AT_REST,
    CONTACT,
    CONTACTS,
    LEDGER,
    NORMAL,
    PAIR,
    POINT,
    REACHED,
    SHEAR,
    SLOTS,
    SUPPORT,
    Record,
    World,
    zeros,
)
from blocksim.kernels.common.mechanics import potential_energy, renew_rotations
from blocksim.kernels.common.shapes import separation, to_world
from blocksim.kernels.common.tolerances import CONE_TOLERANCE, FLAT, SHARE_PERIOD
from blocksim.kernels.explicit.bearing import bearing_along
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.contact import is_too_deep, pair_forces
from blocksim.kernels.explicit.inertia import piece_of
from blocksim.kernels.explicit.models.smoothed import add_row
from blocksim.kernels.explicit.models.surface import block_points, find_points
from blocksim.kernels.explicit.sides import MOST_CORNERS, side_normal
from blocksim.kernels.explicit.step import check, contact_summary, tallied
from blocksim.kernels.sph.functions import kernel_value
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.conftest import PaperBlock, Start
from tests.kernels.references import corners, in_frame
from tests.kernels.scenes import Touching, make_body, pose, touch

OF_B = MOST_CORNERS  # slots from there on
ALL = np.array([*range(4), *range(OF_B, OF_B + 4)])
W, H = 0.032, 0.025


def place_of(body: Record, corner: int) -> np.ndarray:
    return np.asarray(corners(body)[corner])


def points_and_duplicates(a: Record, b: Record, touching: tuple[int, ...] = ()) -> tuple[list[Any], list[int]]:
    """Return the points between two blocks, some of whose corners are in contact, and the slots of duplicates."""
    points, contacts, pair = zeros(SLOTS, POINT), zeros(CONTACTS, CONTACT), zeros(1, PAIR)[0]
    contacts.slot[: len(touching)] = touching
    pair.near, pair.active = SLOTS, len(touching)
    pair.duplicates = 0xFFFFFFFF  # of the step before
    count = block_points(a, b, pair, ALL, contacts, points, None)
    return list(points[:count]), [k for k in range(32) if (int(pair.duplicates) >> k) & 1]


def points_between(a: Record, b: Record) -> list[Any]:
    return points_and_duplicates(a, b)[0]


@given(x=st.floats(-0.035, 0.035), y=st.floats(-0.03, 0.03), one=st.floats(-4.0, 4.0), two=st.floats(-4.0, 4.0))
def test_every_contact_point_is_a_corner_inside_the_other_block(x: float, y: float, one: float, two: float) -> None:
    a, b = make_body(x, y, one), make_body(0.0, 0.0, two, width=0.02)
    found = points_between(a, b)
    for point in found:
        owner, touched = (a, b) if point.slot < OF_B else (b, a)
        corner = place_of(owner, point.slot % OF_B)
        assert [point.x, point.y] == pytest.approx(corner, abs=1e-15)
        local = in_frame(corner, touched)
        outward = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)][point.face])
        half = abs(outward @ (touched.half_x, touched.half_y))
        assert point.depth == pytest.approx(half - outward @ local, abs=1e-15)
        assert point.depth > 0.0
        sign = 1.0 if point.slot < OF_B else -1.0  # from b to a
        assert [point.nx, point.ny] == pytest.approx(sign * np.array(side_normal(touched, None, point.face)))
    assert len({point.slot for point in found}) == len(found)
    assert not found or separation(a, b) < 0.0


@given(x=st.floats(-0.03, 0.03), one=st.floats(-0.7, 0.7), depth=st.floats(1e-9, 1e-4))
def test_shallow_overlap_of_two_blocks_is_always_found(x: float, one: float, depth: float) -> None:
    a, b = make_body(x, 0.0, one), make_body(0.0, 0.0)
    a.y = 0.03
    a.y -= separation(a, b) + depth  # from above: its gap along y is the largest one
    assume(separation(a, b) < 0.0)
    assert points_between(a, b)


@pytest.mark.parametrize("shift", [0.0, 1e-9, -1e-9, 0.01])
@pytest.mark.parametrize("depth", [1e-9, 1e-6])
def test_stacked_blocks_touch_at_the_top_and_not_at_the_sides(shift: float, depth: float) -> None:
    found = points_between(make_body(shift, H - depth), make_body())
    assert len(found) == 2
    for point in found:
        assert [point.nx, point.ny] == pytest.approx([0.0, 1.0], abs=1e-15)
        assert point.depth == pytest.approx(depth, rel=1e-6)
    assert abs(found[0].x - found[1].x) == pytest.approx(W - abs(shift))


def test_aligned_blocks_keep_the_corner_that_was_in_contact() -> None:
    a, b = make_body(0.0, H - 1e-6), make_body()
    for touching, duplicates in (((), [18, 19]), ((0, 1), [18, 19]), ((18, 19), [0, 1]), ((1, 19), [0, 18])):
        points, found = points_and_duplicates(a, b, touching)
        assert sorted(point.slot for point in points) == list(touching or (0, 1))
        assert found == duplicates


@pytest.mark.parametrize(
    ("angle", "slots"), [(0.0, [0, 1]), (0.3, [0, 1]), (-1.2, [1, 2]), (3.0, [2, 3]), (2.0, [0, 3])]
)
def test_block_deep_under_ground_has_its_two_deepest_points_and_no_room_is_overrun(
    angle: float, slots: list[int]
) -> None:
    world = pose((0.0, -0.05, angle), (0.1, 0.0124, 0.0))
    assert [(pair.a, pair.b, pair.near) for pair in world.pairs[:2]] == [(0, 2, 4), (1, 2, 2)]
    world.contacts[1] = beside = np.full(CONTACTS, 7.0).astype(world.contacts.dtype).view(np.recarray)
    assert find_points(world, 0) == CONTACTS
    assert world.points.slot[:CONTACTS].tolist() == slots
    pair_forces(world, 0, 1e-6)
    assert world.pairs[0].active == CONTACTS
    assert world.contacts[0].slot.tolist() == slots
    heights = [place_of(world.bodies[0], k)[1] for k in slots]
    assert world.contacts[0].depth == pytest.approx(-np.array(heights))
    assert world.contacts[1].tobytes() == beside.tobytes()
    assert not world.contacts["normal_force"][2:].any()


UP = (0.0, 1.0)


@pytest.mark.parametrize(("fixed", "length"), [("a", 0.032), ("b", 0.02), ("", 0.032)])
def test_share_refers_to_the_face_of_the_free_body_and_of_two_to_the_longer(fixed: str, length: float) -> None:
    a, b = make_body(y=HEIGHT, width=0.02), make_body()
    for name, body in (("a", a), ("b", b)):
        if name == fixed:
            body.is_moved = SUPPORT
    assert bearing_along(a, b, *UP, None)[0].per_length == pytest.approx(1.0 / length)


def pushed(x: float, angle: float) -> np.ndarray:
    """Return the force (N) and torque (N m) on a block whose lower left corner lies 1 um deep in another one."""
    c, s = np.cos(angle), np.sin(angle)
    foot_x, foot_y = -0.5 * WIDTH * c + 0.5 * HEIGHT * s, -0.5 * WIDTH * s - 0.5 * HEIGHT * c
    world: World = pose((x - foot_x, 1.0 + 0.5 * HEIGHT - 1e-6 - foot_y, angle), (0.0, 1.0, 0.0))
    pair_forces(world, 0, 0.0)
    action = world.action[0]
    return np.array([action.fx, action.fy, action.torque_a])


@pytest.mark.parametrize(
    "angle", [1e-6 / 0.006, FLAT, CONE_TOLERANCE], ids=["other end lifts off", "tilts", "stands on its corner"]
)
def test_force_does_not_jump_while_a_block_tilts_onto_its_corner(angle: float) -> None:
    """The interval is 6 mm long: at 1 um over it the far end of the other block's face leaves the tilted one."""
    before, after = (pushed(0.01, angle * (1.0 + sign * 1e-7)) for sign in (-1.0, 1.0))
    assert before[1] > 0.0
    assert after == pytest.approx(before, abs=1e-4 * before[1])


JOINT = 0.004
K = 1e9


def test_two_pieces_have_together_mass_centre_and_inertia_of_the_body() -> None:
    body = make_body()
    stiffness, arms = np.array([0.7, 0.3]) * K, np.array([-0.003, 0.007])
    body.seats, body.k_yy, body.k_y = 2, stiffness.sum(), stiffness @ arms
    pieces = [piece_of(body, k, 0.0, 1.0, arm, NORMAL) for k, arm in zip(stiffness, arms, strict=True)]
    masses, centres = np.array([1.0 / piece.inverse_mass for piece in pieces]), np.array([p.arm for p in pieces])
    assert masses.sum() == pytest.approx(1.0 / body.inverse_mass)
    assert masses @ centres == pytest.approx(0.0, abs=1e-15)
    inertia = sum(1.0 / piece.inverse_inertia for piece in pieces) + masses @ centres**2
    assert inertia == pytest.approx(1.0 / body.inverse_inertia)
    shear = piece_of(body, stiffness[0], 0.0, 1.0, arms[0], SHEAR)
    assert shear == pytest.approx((body.inverse_mass / 0.7, body.inverse_inertia / 0.7, 0.0))


def test_seats_are_known_before_a_block_comes_down_on_them(start: Start) -> None:
    left = {"x": JOINT - 0.05, "y": 0.5 * HEIGHT, "width": 0.1, "fixed": True}
    right = {"x": JOINT + 0.05, "y": 0.5 * HEIGHT, "width": 0.1, "fixed": True}
    block = {"y": 1.5 * HEIGHT + 1e-3, "velocity": [0.0, -1.0]}
    step = start([left, right, block], gravity=0.0).step
    block["y"] = 1.5 * HEIGHT + (3 * SHARE_PERIOD + 0.5) * step
    scene = start([left, right, block], gravity=0.0)
    body = scene.world.bodies[2]
    scene.to_step(3 * SHARE_PERIOD)
    assert scene.contact_count == 0
    stiffness = 2.0 * float(scene.world.interactions[1, 1].normal_stiffness)
    assert (body.seats, body.k_xx) == (2, 0.0)
    assert body.k_yy == pytest.approx(stiffness)
    assert body.k_y == pytest.approx(0.0, abs=1e-9 * stiffness * WIDTH)
    scene.to_step(3 * SHARE_PERIOD + 2)
    assert scene.contact_count == 4


SPACING = 1e-3


def overlaps(touching: Touching) -> NDArray[np.float64]:
    """Return depth and normal of all discs of two blocks that overlap, by brute force, the deepest last."""
    particles, found = touching.world.particles, []
    for body in touching.world.bodies[:2]:
        own = particles[body.first_particle : body.first_particle + body.particle_count]
        found.append(np.array([to_world(body, particle.x, particle.y) for particle in own]))
    ways = (found[0][:, None] - found[1][None]).reshape(-1, 2)
    lengths = np.hypot(*ways.T)
    table = np.column_stack([SPACING - lengths, ways / lengths[:, None]])[lengths < SPACING]
    return np.asarray(table[np.argsort(table[:, 0])])


@given(shift=st.floats(-1.2 * WIDTH, 1.2 * WIDTH), depth=st.floats(1e-7, 4e-4), angle=st.floats(-0.8, 0.8))
def test_two_discs_touch_while_their_centres_are_nearer_than_the_diameter(
    shift: float, depth: float, angle: float
) -> None:
    found = touch("particles", shift=shift, depth=depth, angle=angle)
    order = np.argsort(found.points.depth)
    seen = np.column_stack([found.points.depth, found.normals])[order]
    expected = overlaps(found)
    assert seen[:, 0] == pytest.approx(expected[:, 0], abs=1e-15)
    assert seen[:, 0] @ seen[:, 1:] == pytest.approx(expected[:, 0] @ expected[:, 1:], abs=1e-12)


COARSE, ABOVE, LOWER = 2e-3, 1e-4, 0


@pytest.mark.parametrize("along", [0.0, 0.4 * COARSE, WIDTH / 2, WIDTH])
def test_weight_of_a_row_is_the_integral_of_the_kernel_along_it(along: float) -> None:
    world = pose((0.0, 1.0, 0.0), contact={"model": "kernel", "particle_spacing": COARSE})
    body, controls, sums = world.bodies[0], world.controls[0], zeros(1, POINT)[0]
    add_row(along - body.half_x, -body.half_y - ABOVE, 1.0, body, LOWER, controls, sums)
    places = np.linspace(0.0, WIDTH, round(WIDTH / COARSE) + 1)
    values = [
        kernel_value(int(controls.sph_kernel), float(np.hypot(place - along, ABOVE)), float(controls.smoothing_length))
        for place in places
    ]
    assert sums.weight == pytest.approx(np.trapezoid(values, places), rel=1e-12)


@pytest.mark.parametrize("spacing", [0.5e-3, 1e-3, 2e-3, 4e-3])
@pytest.mark.parametrize("below", [None, WIDTH])
def test_face_has_the_stiffness_of_two_corners_at_any_spacing(spacing: float, below: float | None) -> None:
    corners, particles = (touch(model, spacing=spacing, below=below) for model in ("surface", "kernel"))
    assert len(corners.points) == 2
    assert len(particles.points) > WIDTH / spacing
    assert particles.wrench() == pytest.approx(corners.wrench(), abs=1e-18)


ON_GROUND = (0.0, 0.5 * HEIGHT - 1e-7, 0.0)
RESTS = {"stop_at_rest": True, "rest_speed": 1e-3, "rest_hold": 1e-3}


def at_rest(pairs: int) -> World:
    """Return a block that does not move and has so many pairs that touch."""
    world = pose(ON_GROUND, time=RESTS)
    world.bodies[0].pairs_before = pairs
    assert world.controls[0].rest_checks > 2
    return world


def test_rest_counts_only_where_it_has_lasted() -> None:
    world = at_rest(pairs=1)
    most = int(world.controls[0].rest_checks)
    assert [check(world, None) for _ in range(most - 1)] == [REACHED] * (most - 1)
    world.bodies[0].vx = 1.0  # pushed once more
    assert check(world, None) == REACHED
    world.bodies[0].vx = 0.0
    assert [check(world, None) for _ in range(most)] == [REACHED] * (most - 1) + [AT_REST]


def test_block_that_touches_nothing_never_rests() -> None:
    world = at_rest(pairs=0)
    assert {check(world, None) for _ in range(2 * int(world.controls[0].rest_checks))} == {REACHED}


def touching(*, depth: float, spring: float = 0.0) -> World:
    """Return two blocks with one contact that has this overlap and shear spring (m)."""
    world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + HEIGHT, 0.0))
    world.pairs[0].active = 1
    world.pairs[0].stiffness = world.interactions[1, 1].normal_stiffness
    contact = world.contacts[0, 0]
    contact.depth, contact.spring = depth, spring
    return world


@pytest.mark.parametrize("small", [0, 1])
def test_smaller_block_of_a_pair_limits_the_overlap(small: int) -> None:
    overlaps = {0.02: False, 0.03: True, 0.07: True}  # of a height; twentieths of the smallest side: 0.025
    for share, is_deep in overlaps.items():
        world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + (0.75 - share) * HEIGHT, 0.0))
        body = world.bodies[small]
        body.half_x = body.half_y = 0.25 * HEIGHT
        body.least_width = 0.5 * HEIGHT
        renew_rotations(world.bodies)
        assert rebuild_pairs(world)
        pair_forces(world, 0, 0.0)
        assert world.pairs[0].active == 2
        assert world.action[0].is_too_deep == is_deep


@pytest.mark.parametrize(("share", "is_deep"), [(0.001, False), (0.9, True)])
def test_bodies_within_one_another_overlap_too_far_where_no_contact_is_found(share: float, *, is_deep: bool) -> None:
    world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + (1.0 - share) * HEIGHT, 0.0))
    assert is_too_deep(world, 0, 0) == is_deep


def test_springs_hold_half_of_force_times_way() -> None:
    world = touching(depth=2e-6, spring=-3e-6)
    pair = world.interactions[world.bodies[0].contact_class, world.bodies[1].contact_class]
    normal, shear, count, deepest = contact_summary(world)
    assert (count, deepest) == (1, 2e-6)
    assert normal == pytest.approx(0.5 * pair.normal_stiffness * 2e-6**2, rel=1e-12)
    assert shear == pytest.approx(0.5 * pair.shear_ratio * pair.normal_stiffness * 3e-6**2, rel=1e-12)


def test_potential_energy_counts_against_gravity_also_on_a_slope(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"x": 0.5, "y": 1.0}, {"x": -0.2, "y": 2.0}], tilt=0.2)
    expected = sum(paper_block.mass * 9.81 * (sin(0.2) * x + cos(0.2) * y) for x, y in ((0.5, 1.0), (-0.2, 2.0)))
    assert potential_energy(scene.world) == pytest.approx(expected, rel=1e-12)


def test_losses_are_those_of_all_tallies() -> None:
    tallies = zeros(5, LEDGER)
    amounts = np.random.default_rng(0).uniform(0.0, 1.0, (3, 5))
    tallies.dashpot, tallies.friction, tallies.broken = amounts
    assert tallied(tallies) == pytest.approx(tuple(amounts.sum(axis=1)), rel=1e-14)
