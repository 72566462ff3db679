"""When the pair list is looked at again: always before anything can have come out of its reach."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import MOTION_PIECE, REACHED, World, zeros
from blocksim.kernels.common.neighbours import travel
from blocksim.kernels.common.shapes import separation
from blocksim.kernels.common.tolerances import MOST_UNSEEN, MOST_UNSEEN_DRIVEN
from blocksim.kernels.explicit.broad_phase import PAIR_SHARE, unseen_steps, update_pairs
from blocksim.verification.scene import Simulation, scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conftest import Start
    from tests.kernels.conftest import MakeBody

SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps
G = 9.81


@pytest.fixture(scope="module")
def world() -> World:
    """Return a block in the air; nothing has been looked at."""
    return build_world(scenario_of([{"y": 1.0}], contact=SOFT))


def test_travel_is_that_of_the_farthest_corner(make_body: MakeBody) -> None:
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


def test_moving_support_is_looked_at_more_often() -> None:
    world = build_world(scenario_of([{"y": 1.0}], contact=SOFT))
    assert unseen_steps(world, 0.0, 0.0) > MOST_UNSEEN_DRIVEN
    world.controls[0].motion_y = 1.0
    assert unseen_steps(world, 0.0, 0.0) == MOST_UNSEEN_DRIVEN


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


def fall() -> World:
    """Let blocks fall on one another that hang still in the air, a wall of them just apart."""
    bodies = [{"x": 0.034 * (i % 4) + 0.005 * (i // 4), "y": 0.02 + 0.03 * (i // 4), "angle": 0.1} for i in range(12)]
    return build_world(scenario_of(bodies, contact=SOFT, time={"stop_at_rest": False}))


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


@pytest.mark.parametrize(("make", "end"), [(crash, 0.12), (fall, 0.08), (jolt, 0.02)])
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
