"""Lists of pairs: all that is near, looked at before anything leaves their reach; no contact begins unseen."""

from __future__ import annotations

from itertools import combinations
from math import nan, pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from blocksim.kernels.common.arrays import MOTION_PIECE, PAIRS_FULL, REACHED, SLOTS, World, zeros
from blocksim.kernels.common.integrate import place_all_corners, renew_rotations
from blocksim.kernels.common.neighbours import travel
from blocksim.kernels.common.shapes import separation
from blocksim.kernels.common.tolerances import MOST_UNSEEN
from blocksim.kernels.explicit.broad_phase import PAIR_SHARE, unseen_steps, update_pairs
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.persistent_forces import CHANGED, UNTOUCHED, persistent_forces
from blocksim.kernels.explicit.sides import MOST_CORNERS
from blocksim.kernels.explicit.step import advance
from blocksim.verification.scene import Simulation, scenario_of
from blocksim.world.build import build_world, empty_lists
from tests.kernels.crews import bits
from tests.kernels.references import apart as gap, corners, distances, in_frame
from tests.kernels.scenes import make_body, pose, rows, soft_world, with_pairs

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Record, World
    from tests.conftest import Start


COUNT = 30


def scattered(start: Start, seed: int, skin: float) -> Simulation:
    """Throw blocks, two of them fixed, into a heap that no scenario would allow."""

    def scatter(world: World) -> None:
        random = np.random.default_rng(seed)
        bodies: Any = world.bodies[:-1]
        bodies.x, bodies.y = random.uniform(0.0, 0.15, COUNT), random.uniform(0.0, 0.15, COUNT)
        bodies.angle = random.uniform(-4.0, 4.0, COUNT)
        bodies.cos, bodies.sin = np.cos(bodies.angle), np.sin(bodies.angle)
        controls = world.controls[0]
        controls.skin, controls.approach = skin, 0.0
        controls.cell_width = 2.0 * controls.cell_radius + skin

    bodies = [{"x": 0.1 * i, "y": 0.1, "fixed": i < 2, "width": 0.01 + 0.001 * i} for i in range(COUNT)]
    return start(bodies, change=scatter)


def near_corners(owner: Record, other: Record, reach: float) -> list[int]:
    beyond = (np.abs(in_frame(corners(owner), other)) - (other.half_x, other.half_y)).max(axis=1)
    return np.flatnonzero(beyond <= reach).tolist()


def distance(one: Record, two: Record) -> float:
    """Return the distance of two rectangles: zero, or that of a corner of one from the other."""
    if gap(one, two) <= 0.0:
        return 0.0
    return float(min(distances(corners(one), two).min(), distances(corners(two), one).min()))


def pairs_by_brute_force(world: World, within: Callable[[Record, Record], float]) -> dict[tuple[int, int], list[int]]:
    """Return the candidate corners of every pair that is `within` reach; pairs and corners sorted."""
    bodies, reach = world.bodies, float(world.controls[0].skin)
    found: dict[tuple[int, int], list[int]] = {}
    for i, j in combinations(range(COUNT), 2):
        is_free = bodies[i].inverse_mass or bodies[j].inverse_mass
        if is_free and within(bodies[i], bodies[j]) <= reach:
            of_b = near_corners(bodies[j], bodies[i], reach)
            found[i, j] = near_corners(bodies[i], bodies[j], reach) + [k + MOST_CORNERS for k in of_b]
    for i in range(COUNT):
        if bodies[i].inverse_mass:
            found[i, COUNT] = [k for k in range(4) if corners(bodies[i])[k, 1] <= reach]
    return {pair: near for pair, near in sorted(found.items()) if near}


@pytest.mark.parametrize("skin", [1e-4, 2e-3, 2e-2])
@pytest.mark.parametrize("seed", range(2))
def test_list_misses_no_corner_within_reach_and_has_none_beyond(start: Start, seed: int, skin: float) -> None:
    world = with_pairs(scattered(start, seed, skin).world)
    count = int(world.clock[0].pair_count)
    found = {
        (int(pair.a), int(pair.b)): near[: pair.near].tolist()
        for pair, near in zip(world.pairs[:count], world.candidates[:count], strict=True)
    }
    assert list(found) == sorted(found)
    assert len(found) > 20
    needed, allowed = pairs_by_brute_force(world, distance), pairs_by_brute_force(world, gap)
    assert {pair: found.get(pair) for pair in needed} == needed
    assert {pair: allowed.get(pair) for pair in found} == found


def test_full_list_stops_before_anything_has_moved() -> None:
    roomy = soft_world(rows(3, 4))
    world = roomy._replace(**empty_lists(1, SLOTS, roomy.before))
    place_all_corners(world.bodies)  # as advance does before anything else
    before = bits(world.bodies) | bits(world.clock)
    for _ in range(2):
        assert advance(world, 1000) == PAIRS_FULL
        assert bits(world.bodies) | bits(world.clock) == before
    assert world.clock[0].steps == 0
    assert world.clock[0].pair_count == 0


SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps
G = 9.81


@pytest.fixture(scope="module")
def world() -> World:
    """Return a block in the air; nothing has been looked at."""
    return build_world(scenario_of([{"y": 1.0}], contact=SOFT))


def test_travel_is_that_of_the_farthest_corner() -> None:
    body = make_body(0.3, -0.2, 1.0)
    body.list_x, body.list_y, body.list_angle = 0.1, 0.1, 1.5
    assert travel(body, 0.0, 0.0) == pytest.approx(np.hypot(0.2, 0.3) + 0.5 * body.radius)
    body.list_x, body.list_y, body.list_angle = body.x, body.y, body.angle
    assert travel(body, 0.0, 0.0) == 0.0


shares = st.floats(0.0, 0.999)
speeds = st.one_of(st.just(0.0), st.floats(1e-6, 100.0))


@given(share=shares, fastest=speeds)
def test_no_falling_body_comes_beyond_its_share_unseen(world: World, share: float, fastest: float) -> None:
    """The worst: the fastest body is at the edge of its share already and falls the way that it moves."""
    reach = PAIR_SHARE * float(world.controls[0].skin)
    steps = unseen_steps(world, share * reach, fastest)
    time = steps * float(world.controls[0].step)
    assert 0 <= steps <= MOST_UNSEEN
    assert share * reach + fastest * time + 0.5 * G * time**2 <= reach


def test_list_that_reaches_far_enough_is_kept_and_one_that_does_not_is_made_anew(start: Start) -> None:
    world = start([{"y": 0.0125}], contact=SOFT).world
    assert world.clock[0].rebuilds == 1
    share = PAIR_SHARE * float(world.controls[0].skin)
    for moved, rebuilds in ((0.9, 1), (1.01, 2), (0.9, 2), (-1.01, 3), (50.0, 4)):
        world.bodies[0].x = world.bodies[0].list_x + moved * share
        assert update_pairs(world) == REACHED
        assert world.clock[0].rebuilds == rebuilds
        assert world.clock[0].next_update > world.clock[0].steps
    assert world.bodies[0].list_x == world.bodies[0].x


@pytest.mark.parametrize("name", ["x", "vx"])
def test_state_that_is_not_finite_is_left_to_the_next_check(start: Start, name: str) -> None:
    world = start([{"y": 1.0}], contact=SOFT).world
    world.bodies[0][name] = nan
    assert update_pairs(world) == REACHED
    assert world.clock[0].rebuilds == 1
    assert 10 < world.clock[0].next_update <= MOST_UNSEEN


def crash() -> World:
    """Throw nine blocks from all sides at a pile of four."""
    pile = [{"x": 0.036 * (i % 2), "y": 0.0126 + 0.026 * (i // 2)} for i in range(4)]
    thrown: list[dict[str, object]] = []
    for i in range(9):
        angle = pi * (i + 1) / 10
        x, y = 0.02 + 0.16 * np.cos(angle), 0.03 + 0.16 * np.sin(angle)
        velocity = [-1.5 * float(np.cos(angle)), -1.5 * float(np.sin(angle))]
        thrown.append({"x": float(x), "y": float(y), "angle": 0.7 * i, "velocity": velocity, "spin": 15.0 * (i - 4)})
    time = {"stop_at_rest": False}
    return build_world(scenario_of([*pile, *thrown], contact={**SOFT, "max_overlap": 0.02}, time=time))


def jolt() -> World:
    """Jerk the ground away below three blocks at rest: the support's speed jumps from none to 2 m/s."""
    bodies = [{"x": 0.04 * i, "y": 0.0125} for i in range(2)] + [{"x": 0.02, "y": 0.0376}]
    pieces = zeros(2, MOTION_PIECE)
    pieces[1].start, pieces[1].c1 = 2e-3, 2.0
    contact = {**SOFT, "max_overlap": 0.02}
    world = build_world(scenario_of(bodies, contact=contact, time={"stop_at_rest": False}))
    world.controls.motion_x = 1.0
    return world._replace(motion=pieces)


def touching_pairs(bodies: Any) -> set[tuple[int, int]]:
    """Return all pairs of bodies that overlap, found without any list; the half-plane is the last one."""
    ground = len(bodies) - 1
    x, y, radius = np.array(bodies.x), np.array(bodies.y), np.array(bodies.radius)
    found = set()
    for i in range(ground):
        if y[i] - np.abs(bodies.sin[i]) * bodies.half_x[i] - np.abs(bodies.cos[i]) * bodies.half_y[i] < 0.0:
            found.add((i, ground))
        for j in range(i + 1, ground):
            way = np.hypot(x[i] - x[j], y[i] - y[j])
            if way < radius[i] + radius[j] and separation(bodies[i], bodies[j]) < 0.0:
                found.add((i, j))
    return found


@pytest.mark.parametrize(("make", "end"), [(crash, 0.12), (jolt, 0.02)])
def test_no_body_comes_beyond_its_share_and_no_pair_is_missed(make: Callable[[], World], end: float, pace: int) -> None:
    scene = Simulation(make())
    controls, touched, stops = scene.world.controls[0], set(), round(end / scene.step) // pace
    share = PAIR_SHARE * float(controls.skin)
    for step in range(1, stops):
        bodies = scene.to_step(step).world.bodies
        moved = np.hypot(bodies.x - bodies.list_x, bodies.y - bodies.list_y)
        assert (moved + bodies.radius * np.abs(bodies.angle - bodies.list_angle)).max() <= share, step
        if step % 10 == 0:
            pairs: Any = scene.world.pairs[: scene.world.clock[0].pair_count]
            touching = touching_pairs(bodies)
            assert touching <= set(zip(pairs.a.tolist(), pairs.b.tolist(), strict=True)), step
            touched |= touching
    assert pace > 1 or len(touched) >= 4
    looks = scene.world.clock[0].rebuilds
    assert 1 <= looks < stops / 3


STEP = 1e-6
places = st.floats(-0.05, 0.05)
angles = st.floats(-4.0, 4.0)


@pytest.mark.parametrize("axis", [0, 1, 2, 3, 16, 17, 18, 19])
@given(x=places, y=places, one=angles, two=angles, seed=st.integers(0, 1000))
def test_no_contact_begins_unseen(*, axis: int, x: float, y: float, one: float, two: float, seed: int) -> None:
    world = pose((x, 1.0 + y, one), (0.0, 1.0, two))
    assume(world.clock[0].pair_count > 0)
    skin, random = float(world.controls[0].skin), np.random.default_rng(seed)
    for body in world.bodies[:2]:
        body.x += random.uniform(-0.2, 0.2) * skin
        body.y += random.uniform(-0.2, 0.2) * skin
        body.angle += random.uniform(-0.2, 0.2) * skin / float(body.radius)
    renew_rotations(world.bodies)
    pair = world.pairs[0]
    pair.axis = axis  # whichever was the best one last
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result in {CHANGED, UNTOUCHED}
    if contact_points(world, 0) > 0:
        assert result == CHANGED
    elif separation(*world.bodies[:2]) > 0.0:
        assert result == UNTOUCHED


@given(y=st.floats(0.0, 0.02), angle=angles, down=st.floats(-0.4, 0.4))
@pytest.mark.parametrize("axis", [0, 1])
def test_no_contact_with_the_ground_begins_unseen(axis: int, y: float, angle: float, down: float) -> None:
    world = pose((0.2, y, angle))
    assume(world.clock[0].pair_count > 0)
    world.bodies[0].y += down * float(world.controls[0].skin)
    world.pairs[0].axis = axis
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result == (CHANGED if contact_points(world, 0) > 0 else UNTOUCHED)
