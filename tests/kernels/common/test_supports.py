"""Motion of bodies: Verlet steps, supports that move and their work, and members that stop once a block has moved."""

import math
from collections.abc import Callable, Mapping, Sequence
from math import cos, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import AT_REST, BODY, CONTROLS, MOTION_PIECE, REACHED, Records, World, zeros
from blocksim.kernels.common.mechanics import accelerate_and_kick
from blocksim.kernels.common.members import Watched, frame_to_watch, watch
from blocksim.kernels.common.supports import acceleration, displacement, tally_moved
from blocksim.scenario import Model
from blocksim.verification.scene import HEIGHT, SteppedScene, scenario_of
from blocksim.world.build import build_world


def finish(bodies: Records) -> None:
    """Finish the step of all bodies; nobody does it for the ground."""
    for body in bodies[:-1]:
        accelerate_and_kick(body, zeros(1, CONTROLS)[0], 1e-3)


def test_change_of_the_number_of_pairs_is_flagged_for_free_bodies_only() -> None:
    bodies: Any = zeros(4, BODY)
    bodies.inverse_mass = (1.0, 1.0, 0.0, 0.0)
    bodies.pairs_now, bodies.pairs_before = (2, 3, 2, 5), (2, 2, 0, 0)
    finish(bodies)
    assert bodies.pairs_changed.tolist() == [0, 1, 0, 0]
    assert bodies.pairs_before[:2].tolist() == [2, 3]
    assert not bodies.pairs_now[:2].any()
    finish(bodies)
    assert bodies.pairs_before[:2].tolist() == [0, 0]
    assert bodies.pairs_changed.tolist() == [1, 1, 0, 0]


SOFT = 1e-4  # of the material's stiffness: milliseconds are some hundred steps
FRICTION = 0.4
LYING = {"y": HEIGHT / 2}


def pieces_of(*rows: tuple[float, ...]) -> Records:
    """Return pieces from their start (s) and coefficients, lowest first."""
    pieces = zeros(len(rows), MOTION_PIECE)
    for piece, (start, *coefficients) in zip(pieces, rows, strict=True):
        piece.start = start
        for k, value in enumerate(coefficients):
            piece[f"c{k}"] = value
    return pieces


def on_support(
    bodies: Sequence[Mapping[str, object]],
    pieces: Records | None = None,
    *,
    direction: float = 0.0,
    restitution: float = 0.2,
    change: Callable[[World], None] | None = None,
    time: Mapping[str, object] | None = None,
    **tables: Any,
) -> SteppedScene:
    """Start soft blocks on a support that moves along `direction` (rad); None: that rests."""
    scenario = scenario_of(
        bodies,
        contact={"restitution": restitution, "stiffness_scale": SOFT},
        friction={"block_block": FRICTION, "block_ground": FRICTION},
        time={"stop_at_rest": False, **(time or {})},
        **tables,
    )
    world = build_world(Model(scenario))
    if pieces is not None:
        world = world._replace(motion=pieces)
        world.controls.motion_x, world.controls.motion_y = cos(direction), sin(direction)
    if change is not None:
        change(world)
    return SteppedScene(world)


@given(seed=st.integers(0, 1000), time=st.floats(0.5, 1.5))
def test_acceleration_is_the_second_difference_of_the_displacement(seed: int, time: float) -> None:
    coefficients = np.random.default_rng(seed).uniform(-1.0, 1.0, 4)
    piece, h = pieces_of((0.5, *coefficients))[0], 1e-4
    here, before, after = (displacement(piece, time + shift) for shift in (0.0, -h, h))
    assert acceleration(piece, time) == pytest.approx((after - 2.0 * here + before) / h**2, abs=1e-5)


SCENES: list[tuple[list[dict[str, Any]], dict[str, Any]]] = [
    ([{"y": 0.03, "angle": 0.4, "velocity": [0.2, -0.5], "spin": 2.0}], {}),
    ([LYING, {"y": 1.5 * HEIGHT + 1e-4, "x": 0.004, "velocity": [0.3, 0.0]}], {}),
    ([LYING, {"y": 1.5 * HEIGHT, "x": 0.03, "fixed": True, "width": 0.01}], {}),
    ([{"y": 0.03, "x": -0.01, "velocity": [0.6, 0.0]}], {"walls": [{"from": [0.012, 0.1], "to": [0.012, 0.0]}]}),
]


@pytest.mark.parametrize(("bodies", "tables"), SCENES)
def test_uniformly_accelerated_support_is_gravity_from_the_side(
    bodies: list[dict[str, object]], tables: dict[str, Any]
) -> None:
    pull, direction = 6.0, 0.3

    def pull_aside(world: World) -> None:
        world.controls.gravity_x -= pull * cos(direction)
        world.controls.gravity_y -= pull * sin(direction)

    resting = on_support(bodies, restitution=1.0, change=pull_aside, **tables)
    moving = on_support(bodies, pieces_of((0.0, 0.0, 0.0, 0.5 * pull)), direction=direction, restitution=1.0, **tables)
    for time in (0.005, 0.02, 0.04):
        resting.to_time(time)
        moving.to_time(time)
        gone, speed = 0.5 * pull * moving.time**2, pull * moving.time
        along, up = cos(direction), sin(direction)
        shift = np.array([gone * along, gone * up, 0.0, speed * along, speed * up, 0.0])
        seen, expected = moving.state() - shift, resting.state()
        for state in seen, expected:
            state[:, 5] *= resting.bodies.radius[: len(state)]  # speed of a corner by spin; rounding grows in impacts
        free = resting.bodies.inverse_mass > 0.0
        assert seen[free] == pytest.approx(expected[free], abs=2e-10), time
        assert seen[~free, :2] == pytest.approx(resting.state()[~free, :2], abs=1e-12), time
    assert moving.residual() < 1e-3


def test_work_on_the_support_is_tallied_by_the_trapezoid_rule_and_its_totals_are_used_up() -> None:
    world = on_support([LYING, {"y": 0.1, "x": 0.2, "fixed": True}], pieces_of((0.0, 0.0, 0.3))).world
    wall, ground, step = world.bodies[1], world.bodies[2], 1e-3
    assert world.moved.body.tolist() == [1, 2]
    world.moved.fx, world.moved.fy = (1.0, 2.0), (3.0, 4.0)
    for body, force in ((wall, 5.0), (ground, -7.0)):
        body.vx, body.vy, body.fx, body.fy, body.torque = 0.2, -0.1, force, 2.0 * force, 1.0
    before = float(world.ledger[0].to_support)
    tally_moved(world, step, False)
    work = 0.5 * step * (0.2 * (1.0 + 2.0 + 5.0 - 7.0) - 0.1 * (3.0 + 4.0 + 10.0 - 14.0))
    assert world.ledger[0].to_support - before == pytest.approx(work)
    assert world.moved["fx"].tolist() == [5.0, -7.0]
    assert world.moved["fy"].tolist() == [10.0, -14.0]
    assert [(body.fx, body.fy, body.torque) for body in (wall, ground)] == [(0.0, 0.0, 0.0)] * 2


@pytest.mark.parametrize("last", [(0.02,), (0.02, 0.0, 1e-3)])
def test_rest_is_not_found_before_the_support_has_stopped(last: tuple[float, ...]) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 2e-3, "rest_hold": 2e-3}
    creeping = pieces_of((0.0, 0.0, 1e-3), (0.01, 1e-5, -1e-3), last)
    scene = on_support([LYING], creeping, time=rest).to_time(0.06)
    assert scene.code == (AT_REST if len(last) == 1 else REACHED)
    assert scene.time > 0.02


def test_the_largest_rotation_is_followed_to_the_end_and_the_first_frame_of_a_move_kept() -> None:
    """Of the second of two members of two blocks each, the second fixed."""
    thresholds = np.array([[math.inf, math.inf], [1e-3, math.inf]])
    periods, places = np.array([0.0, 3.0]), np.zeros((2, 3, 2))
    reaches, steps, bodies = np.full((2, 2), 0.03), np.zeros(2, dtype=np.int64), zeros(3, BODY)
    seen = Watched(periods, periods, steps, places, places.copy(), reaches, thresholds, np.zeros(2))
    bodies.x[:2], bodies.y[:2], bodies.angle[:2] = 0.6e-3, -0.79e-3, -0.99e-3 / 0.03
    watch(bodies, seen, 1, 3)
    assert seen.steps.tolist() == [0, 0]
    assert [frame_to_watch(seen, m, 4) for m in (0, 1)] == [0, 6]
    for step, angle in ((6, -0.2), (9, 0.1)):
        bodies.angle[:2] = angle
        watch(bodies, seen, 1, step)
    assert seen.steps.tolist() == [0, 6]
    assert seen.peaks.tolist() == [0.0, 0.2]
    assert frame_to_watch(seen, 1, 7) == 9
