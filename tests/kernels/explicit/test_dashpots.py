"""Dashpots: the damping ratio of every mode, as defined for any number of points, and when they are made anew."""

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from blocksim.kernels.common.arrays import CONTACT, INTERACTION, NORMAL, OPERATOR, PAIR, POINT, SHEAR, World, zeros
from blocksim.kernels.common.tolerances import DASHPOT_RANK, OPERATOR_LIFE
from blocksim.kernels.explicit.contact import shared_step
from blocksim.kernels.explicit.damping import (
    BOTH,
    SIZE,
    add_coupled_dashpots,
    are_dashpots_due,
    damp,
    inverse_three_halves,
    keep_dashpots,
)
from blocksim.kernels.explicit.forces import Touch, grip_of, keep, renew_operator
from blocksim.kernels.explicit.kinematics import Point, point_of, resolve_point, weigh_first_step
from blocksim.kernels.explicit.laws import LINEAR, spring_at
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.conftest import PaperBlock, Start
from tests.contacts import contact_records
from tests.kernels.references import dashpots_by_definition, delassus, rates_of_points
from tests.kernels.scenes import make_body, pose

STEP = 2e-7
K = 1e9
SEEDS = st.integers(0, 10_000)


@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
def test_operator_of_one_direction_is_due_after_as_many_uses_as_it_was_kept_for(direction: int) -> None:
    pair = zeros(1, PAIR)[0]
    keep_dashpots(pair, NORMAL, BOTH, 9)
    keep_dashpots(pair, SHEAR, 2, 9)
    keep_dashpots(pair, direction, 1, 3)
    assert [are_dashpots_due(pair, direction) for _ in range(5)] == [False] * 3 + [True] * 2
    assert (pair.normal_left, pair.shear_left) == ((0, 9) if direction == NORMAL else (9, 0))
    assert pair.sticking == (2 if direction == NORMAL else 1)  # normals have their dashpots always


@pytest.mark.parametrize(("restitution", "friction", "way"), [(0.2, 0.5, -1.0), (0.5, 0.5, 1.0)])
def test_corner_that_slides_rebounds_as_asked(start: Start, restitution: float, friction: float, way: float) -> None:
    """With the mass of a corner without friction it left at 0.45 to 0.57 of its speed where 0.5 was asked."""
    turned, speed = pi / 6.0, 1.0
    x = 0.5 * (HEIGHT * sin(turned) - WIDTH * cos(turned))
    y = -0.5 * (WIDTH * sin(turned) + HEIGHT * cos(turned))
    falling = {"y": 1e-7 - y, "angle": turned, "velocity": [3.0 * way, -speed]}
    scene = start([falling], restitution=restitution, ground_friction=friction, gravity=0.0)
    scene.to_step(20)
    while scene.contact_count > 0:
        scene.to_step(scene.steps + 5)
    block = scene.bodies[0]
    assert way * (block.vx - block.spin * y) > 0.0  # it has slid all the time
    assert block.vy + block.spin * x == pytest.approx(restitution * speed, abs=2e-3)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
@given(seed=SEEDS, n=st.integers(3, 40), ratio=st.sampled_from([0.1, 1.0, 5.0]))
def test_any_number_of_points_follows_the_definition(
    direction: int, parallel: bool, ratio: float, n: int, seed: int
) -> None:
    """Points between two moving bodies, with random forces and stiffnesses; normals alike or not."""
    random = np.random.default_rng(seed)
    points: Any = zeros(n, POINT)
    a, b = make_body(0.1, 0.2, 0.3), make_body(0.12, 0.18, -0.5, width=0.05, mass=0.3)
    for body in (a, b):
        body.vx, body.vy, body.spin = random.normal(size=3)
    angle = random.uniform(-np.pi, np.pi)
    for point in points:
        angle = angle if parallel else random.uniform(-np.pi, np.pi)
        point.x, point.y = np.array([0.11, 0.19]) + 0.01 * random.normal(size=2)
        point.nx, point.ny = np.cos(angle), np.sin(angle)
        resolve_point(point, a, b, STEP)
    points.stiffness, points.weight = random.uniform(1e6, 1e8, n), random.uniform(0.5, 1.5, n)
    points.before, points.force = random.uniform(0.0, 100.0, (2, n))
    resolved = points.closing_rate if direction == NORMAL else points.slip_rate
    points.rate, before = resolved, points.force.copy()
    expected = dashpots_by_definition(points, delassus(points, a, b, direction), ratio, STEP)
    add_coupled_dashpots(points, n, a, b, direction, ratio, STEP, np.zeros((8, SIZE, SIZE)))
    assert points.force - before == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@given(seed=SEEDS, rank=st.integers(1, 3))
def test_power_of_three_agrees_with_eigenvalues(seed: int, rank: int) -> None:
    """A matrix of eigenvalues from 1 to 100, `rank` of them not zero."""
    random, found = np.random.default_rng(seed), np.zeros((3, 3))
    basis, _ = np.linalg.qr(random.normal(size=(3, 3)))
    values = np.where(np.arange(3) < rank, random.uniform(1.0, 100.0, 3), 0.0)
    powers = np.array([value**-1.5 if value else 0.0 for value in values])
    inverse_three_halves((basis * values) @ basis.T, np.zeros((3, 3)), found)
    assert found == pytest.approx((basis * powers) @ basis.T, abs=1e-12)


SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


@pytest.mark.parametrize(("of_a", "of_b", "times"), [(0, 0, 1.0), (2, 1, 1.0), (3, 2, 1.5), (1, 6, 3.0)])
def test_own_force_counts_more_where_more_than_two_pairs_act_on_a_body(of_a: int, of_b: int, times: float) -> None:
    a, b = make_body(), make_body()
    a.pairs_before, b.pairs_before = of_a, of_b
    assert shared_step(a, b, 1e-6) == pytest.approx(times * 1e-6)


def test_sliding_block_has_its_springs_at_the_cone(start: Start, paper_block: PaperBlock) -> None:
    slide = start([{"y": paper_block.height / 2, "velocity": [-0.5, 0.0]}], contact=SOFT).to_time(0.02)
    world, touching = slide.world, contact_records(slide.world)
    stiffness = float(world.interactions[1, 0].normal_stiffness * world.interactions[1, 0].shear_ratio)
    assert touching.size == 2
    assert abs(touching.shear_force) == pytest.approx(0.38 * touching.normal_force, rel=1e-12)
    assert stiffness * touching.spring == pytest.approx(touching.shear_force, rel=1e-12)
    assert world.ledger[0].friction == pytest.approx(
        0.38 * paper_block.mass * 9.81 * abs(float(slide.bodies[0].x)), rel=1e-2
    )


STIFFNESS = 1e8  # N/m, of two points


def two_points(seed: int, direction: int) -> World:
    """Return a pair of moving blocks with two random points, resolved along normals or tangents."""
    world, random = pose((0.1, 0.2, 0.3), (0.12, 0.18, -0.5)), np.random.default_rng(seed)
    pair = world.pairs[0]
    a, b = world.bodies[:2]
    assert (pair.a, pair.b) == (0, 1)
    for body in (a, b):
        for name in ("vx", "vy", "spin", "ax", "ay", "spin_rate"):
            body[name] = random.normal()
    for point in world.points[:2]:
        angle = random.uniform(-np.pi, np.pi)
        point.x, point.y = 0.11 + 0.01 * random.normal(), 0.19 + 0.01 * random.normal()
        point.nx, point.ny = np.cos(angle), np.sin(angle)
        resolve_point(point, a, b, STEP)
        point.rate = point.closing_rate if direction == NORMAL else point.slip_rate
        point.stiffness, point.before, point.force = STIFFNESS, *random.uniform(0.0, 100.0, 2)
    return world


def lives(world: World) -> list[int]:
    """Return for how many steps the dashpots of the first pair hold, along the normals and the tangents."""
    return [int(world.pairs[0].normal_left), int(world.pairs[0].shear_left)]


def renew(
    world: World,
    count: int,
    direction: int,
    pattern: int,
    *,
    step: float = STEP,
    k: float = STIFFNESS,
    steady: bool = False,
) -> None:
    """Rebuild the operator of one or two points of the work space where it is due."""
    a, b = world.bodies[:2]
    values, contacts = world.interactions[1, 1], world.contacts[0]
    values.normal_damping = values.shear_damping = 0.7
    operators = world.operators[0, NORMAL], world.operators[0, SHEAR]
    touch = Touch(world.pairs[0], a, b, values, contacts[0], contacts[1], *operators)
    one, two = (point_of(world.points[i], b) for i in (0, count - 1))
    renew_operator(touch, one, two, count == 2, direction, pattern, k, k, step, LINEAR, steady)


@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
@pytest.mark.parametrize(("count", "pattern"), [(1, 1), (2, BOTH), (2, 1), (2, 2)])
@given(seed=st.integers(0, 10_000), weights=st.sampled_from([(1.0, 1.0), (0.7, 0.7), (0.6, 1.2), (0.0, 1.0)]))
@example(seed=70, weights=(1.0, 1.0))  # tangents that are nearly parallel
@example(seed=70, weights=(0.6, 1.2))
def test_dashpots_of_a_pair_follow_the_definition(
    *, direction: int, weights: tuple[float, float], count: int, pattern: int, seed: int
) -> None:
    world = two_points(seed, direction)
    a, b = world.bodies[:2]
    points: Any = world.points[:count]
    points.weight = weights[:count]
    if count == 2 and pattern != BOTH:
        points.stiffness[2 - pattern] = 0.0  # it slides
    masses = delassus(points, a, b, direction)
    expected = points.force + dashpots_by_definition(points, masses, 0.7, STEP)
    renew(world, count, direction, pattern)
    one, two = points[0], points[-1]
    numbers = one.force, two.force, one.before, two.before, one.rate, two.rate
    found = damp(world.operators[0, direction], count == 2, *numbers)[:count]
    # masses of rank one but for an eigenvalue that counts as zero: A tr(A)^(-3/2) is off by its share of the other
    share = np.linalg.eigvalsh(masses)[0] / np.trace(masses)
    rank_one = share < DASHPOT_RANK and points.size == 2
    assert found == pytest.approx(expected, rel=1e-7 + 2.0 * share * rank_one, abs=1e-9 * np.abs(expected).max())
    assert lives(world)[direction] == (OPERATOR_LIFE if weights[0] == weights[count - 1] == 1.0 else 0)
    assert lives(world)[1 - direction] == 0
    assert direction == NORMAL or world.pairs[0].sticking == pattern
    assert world.operators[0, 1 - direction].tobytes() == bytes(world.operators.itemsize)


def test_operator_of_contacts_that_are_not_steady_keeps_its_masses_only() -> None:
    world, other = two_points(1, NORMAL), two_points(1, NORMAL)
    renew(world, 2, NORMAL, BOTH)
    world.points.x += 1e-3  # other masses
    renew(world, 2, NORMAL, BOTH, k=4.0 * STIFFNESS)
    renew(other, 2, NORMAL, BOTH, k=4.0 * STIFFNESS)
    made = [[one.operators[0, NORMAL][name] for name in OPERATOR.names or ()] for one in (world, other)]
    assert made[0] == pytest.approx(made[1], rel=1e-12)
    assert lives(world)[NORMAL] == OPERATOR_LIFE - 1


def test_dashpot_that_pulls_more_than_the_spring_pushes_leaves_no_force() -> None:
    """A spring of 5 N and a dashpot that leaves -3 N of it; no force was before."""
    point = Point(0.0, 0.0, 0.0, 1.0, 1e-6, -1e-6, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    contact, values = zeros(1, CONTACT)[0], zeros(1, INTERACTION)[0]
    spring, before = spring_at(LINEAR, 5e6, 1e-6), spring_at(LINEAR, 5e6, 0.0)
    grip = grip_of(contact, point, values, -3.0, spring, before, True)
    lost = 0.5 * keep(contact, point, grip, 0.0, spring, before)
    assert (contact.normal_force, grip.normal) == (0.0, 0.0)
    assert lost == pytest.approx(0.5 * -5.0 * -1e-6, rel=1e-12, abs=0.0)


@given(seed=st.integers(0, 10_000))
def test_displacements_and_rates_are_those_of_rigid_bodies(seed: int) -> None:
    world = two_points(seed, NORMAL)
    (a, b), point = world.bodies[:2], world.points[0]
    points: Any = world.points[:1]
    velocity = np.array([a.vx, a.vy, a.spin, b.vx, b.vy, b.spin])
    later = velocity + 0.5 * STEP * np.array([a.ax, a.ay, a.spin_rate, b.ax, b.ay, b.spin_rate])
    closing, slip = (rates_of_points(points, a, b, direction)[0] for direction in (NORMAL, SHEAR))
    assert point.closing == pytest.approx(STEP * closing @ velocity, abs=1e-20)
    assert point.slipping == pytest.approx(STEP * slip @ velocity, abs=1e-20)
    assert point.closing_rate == pytest.approx(closing @ later, abs=1e-14)
    assert point.slip_rate == pytest.approx(slip @ later, abs=1e-14)


@pytest.mark.parametrize(("depth", "weight"), [(0.0, 0.5), (0.25e-6, 0.75), (1e-6, 1.5)])
def test_first_step_weighs_the_dashpot_by_the_time_in_contact(depth: float, weight: float) -> None:
    point = zeros(1, POINT)[0]
    point.weight = point.drawn = 1.0
    point.closing, point.depth = 1e-6, depth
    weigh_first_step(point, LINEAR)
    assert point.weight == pytest.approx(weight)
    assert point.drawn == pytest.approx(depth / 1e-6)
