"""Motion of bodies: Verlet steps, supports that move and their work, and members that stop once a block has moved."""

from __future__ import annotations

import math
from math import cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import AT_REST, BODY, CONTROLS, MOTION_PIECE, REACHED, Records, World, zeros
from blocksim.kernels.common.mechanics import accelerate_and_kick, kick_and_drift
from blocksim.kernels.common.members import Watched, frame_to_watch, watch
from blocksim.kernels.common.supports import acceleration, displacement, tally_moved
from blocksim.simulation.instruments import POSITION
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation, scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blocksim.kernels.common.arrays import Record, Records

STEP = 1e-3


def bodies_of(**values: float) -> Records:
    """Return one free body of 2 kg and 0.5 kg m2, and the ground."""
    bodies = zeros(2, BODY)
    bodies.cos = 1.0
    body = bodies[0]
    body.mass, body.inertia, body.inverse_mass, body.inverse_inertia, body.radius = 2.0, 0.5, 0.5, 2.0, 0.1
    for name, value in values.items():
        body[name] = value
    return bodies


def controls_with_gravity() -> Record:
    controls = zeros(1, CONTROLS)[0]
    controls.step, controls.gravity_x, controls.gravity_y = STEP, 0.3, -9.81
    return controls


def finish_all(bodies: Records, step: float) -> None:
    """Finish the step of all bodies; nobody does it for the ground."""
    for body in bodies[:-1]:
        accelerate_and_kick(body, controls_with_gravity(), step)


def free_steps(bodies: Records, count: int) -> None:
    finish_all(bodies, 0.0)
    for _ in range(count):
        kick_and_drift(bodies, 0, bodies.size, STEP)
        finish_all(bodies, STEP)


def test_gravity_and_free_spin_are_exact() -> None:
    bodies = bodies_of(vx=1.0, vy=2.0, spin=3.0)
    free_steps(bodies, 500)
    body, t = bodies[0], 0.5
    assert [body.x, body.y] == pytest.approx([1.0 * t + 0.15 * t * t, 2.0 * t - 4.905 * t * t], abs=1e-13)
    assert [body.vx, body.vy, body.spin] == pytest.approx([1.0 + 0.3 * t, 2.0 - 9.81 * t, 3.0], abs=1e-13)
    assert body.angle == pytest.approx(1.5, abs=1e-13)
    assert [body.cos, body.sin] == pytest.approx([cos(1.5), sin(1.5)], abs=1e-12)


def test_forces_and_torques_accelerate_by_the_inverse_masses_and_are_used_up() -> None:
    bodies = bodies_of(fx=4.0, fy=6.0, torque=1.5)
    finish_all(bodies, STEP)
    body = bodies[0]
    assert [body.ax, body.ay, body.spin_rate] == pytest.approx([0.3 + 2.0, -9.81 + 3.0, 3.0])
    assert [body.vx, body.vy, body.spin] == pytest.approx([2.3 * STEP / 2, -6.81 * STEP / 2, 3.0 * STEP / 2])
    assert (body.fx, body.fy, body.torque) == (0.0, 0.0, 0.0)


def test_change_of_the_number_of_pairs_is_flagged_for_free_bodies_only() -> None:
    bodies: Any = zeros(4, BODY)
    bodies.inverse_mass = (1.0, 1.0, 0.0, 0.0)
    bodies.pairs_now, bodies.pairs_before = (2, 3, 2, 5), (2, 2, 0, 0)
    finish_all(bodies, STEP)
    assert bodies.pairs_changed.tolist() == [0, 1, 0, 0]
    assert bodies.pairs_before[:2].tolist() == [2, 3]
    assert not bodies.pairs_now[:2].any()
    finish_all(bodies, STEP)
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
) -> Simulation:
    """Start soft blocks on a support that moves along `direction` (rad); None: that rests."""
    scenario = scenario_of(
        bodies,
        contact={"restitution": restitution, "stiffness_scale": SOFT},
        friction={"block_block": FRICTION, "block_ground": FRICTION},
        time={"stop_at_rest": False, **(time or {})},
        **tables,
    )
    world = build_world(scenario)
    if pieces is not None:
        world = world._replace(motion=pieces)
        world.controls.motion_x, world.controls.motion_y = cos(direction), sin(direction)
    if change is not None:
        change(world)
    return Simulation(world)


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
    (
        [{"y": 0.03, "x": -0.01, "velocity": [0.6, 0.0]}],
        {"ground": {"profile": [[-0.1, 0.0], [0.02, 0.0], [0.06, 0.04]]}},
    ),
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


@pytest.mark.parametrize("is_driven", [False, True])
def test_forces_count_on_fixed_bodies_only_where_the_support_moves(is_driven: bool) -> None:
    bodies = [LYING, {"y": HEIGHT / 2, "x": WIDTH, "fixed": True}]
    world = on_support(bodies, pieces_of((0.0, 0.0, 0.3)) if is_driven else None).to_step(3).world
    assert world.bodies.counts.tolist() == [1, is_driven, is_driven]
    assert world.moved.fy.any() == is_driven


@pytest.mark.parametrize("last", [(0.02,), (0.02, 0.0, 1e-3)])
def test_rest_is_not_found_before_the_support_has_stopped(last: tuple[float, ...]) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 2e-3, "rest_hold": 2e-3}
    creeping = pieces_of((0.0, 0.0, 1e-3), (0.01, 1e-5, -1e-3), last)
    scene = on_support([LYING], creeping, time=rest).to_time(0.06)
    assert scene.status == (AT_REST if len(last) == 1 else REACHED)
    assert scene.time > 0.02


THRESHOLD, REACH = 1e-3, 0.03  # m


def watched(**state: float) -> tuple[Watched, Records]:
    """Return what watches the second of two members of two blocks each, the second fixed, and where blocks are."""
    thresholds = np.array([[math.inf, math.inf], [THRESHOLD, math.inf]])
    periods, places = np.array([0.0, 3.0]), np.zeros((2, 3, 2))
    reaches, steps = np.full((2, 2), REACH), np.zeros(2, dtype=np.int64)
    bodies = zeros(3, BODY)
    for name, value in state.items():
        bodies[name][:2] = value
    return Watched(periods, periods, steps, places, places.copy(), reaches, thresholds, np.zeros(2)), bodies


@pytest.mark.parametrize(
    ("state", "moved"),
    [
        ({"x": 0.999e-3}, False),
        ({"x": -1.001e-3}, True),
        ({"x": 0.6e-3, "y": -0.801e-3}, True),
        ({"angle": -0.999 * THRESHOLD / REACH}, False),
        ({"angle": -1.001 * THRESHOLD / REACH}, True),
        ({"y": math.nan}, True),
    ],
)
def test_first_frame_in_which_a_free_block_has_moved_is_kept(state: dict[str, float], moved: bool) -> None:
    seen, bodies = watched(**state)
    watch(bodies, seen, 1, 6)
    assert seen.steps.tolist() == [0, 6 if moved else 0]
    if moved:
        assert np.array_equal(seen.places[1], [[state.get(name, 0.0)] * 2 for name in POSITION], equal_nan=True)


def test_the_largest_rotation_is_followed_to_the_end_and_the_first_frame_of_a_move_kept() -> None:
    seen, bodies = watched()
    assert [frame_to_watch(seen, m, 4) for m in (0, 1)] == [0, 6]
    for step, angle in ((6, -0.2), (9, 0.1)):
        bodies.angle[:2] = angle
        watch(bodies, seen, 1, step)
    assert seen.steps.tolist() == [0, 6]
    assert seen.peaks.tolist() == [0.0, 0.2]
    assert frame_to_watch(seen, 1, 7) == 9
