"""What the non-smooth scheme has to get right: ../shared/design/nonsmooth.md, "Measured", and closed forms."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.kernels.common.arrays import AT_REST, REACHED, TEAM_SIZE
from blocksim.kernels.common.members import Watched
from blocksim.kernels.nonsmooth.cone import solve_two
from blocksim.kernels.nonsmooth.energy import NONSMOOTH_LEDGER
from blocksim.kernels.nonsmooth.step import advance_nonsmooth_in_team, advance_nonsmooth_members
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world.build import build_stacks, only_stack
from blocksim.world.nonsmooth import NONSMOOTH, build_nonsmooth, with_more_threads
from tests.kernels.nonsmooth.scenes import rigid

if TYPE_CHECKING:
    from collections.abc import Callable

G = 9.81
ON_GROUND = HEIGHT / 2


@pytest.mark.parametrize("lane", [None, 0], ids=["four", "single"])
def test_two_points_are_solved_exactly(lane: int | None) -> None:
    random = np.random.default_rng(0)
    for _ in range(2000):
        root = random.normal(size=(2, 2))
        k = root @ root.T + 0.01 * np.eye(2)
        q = random.normal(size=2)
        x = np.array(solve_two(lane, k[0, 0], k[0, 1], k[1, 1], q[0], q[1]))
        rest = k @ x + q
        assert x.min() >= 0.0
        assert rest.min() >= -1e-9
        assert abs(x * rest).max() < 1e-9 * (1.0 + abs(x).max())


@pytest.mark.parametrize("substeps", [1, 4])
def test_slide_ends_where_coulomb_says(single: Callable[..., Any], substeps: int) -> None:
    run = single([{"x": 0.0, "y": ON_GROUND, "velocity": [1.0, 0.0]}], substeps=substeps).to_time(0.5)
    assert run.bodies.x[0] == pytest.approx(1.0 / (2 * 0.38 * G), abs=1e-5)
    assert abs(run.bodies.vx[0]) < 1e-12


def test_drop_rebounds_as_newton_says_to_first_order(single: Callable[..., Any]) -> None:
    errors = []
    for step in (1e-3, 2.5e-4):
        run = single([{"y": ON_GROUND + 0.05}], restitution=0.5, step=step, substeps=1)
        heights = [float(run.to_step(k).bodies.y[0]) for k in range(round(0.11 / step), round(0.2 / step))]
        errors.append(0.0125 - (max(heights) - ON_GROUND))
    assert abs(errors[0]) < 0.05 * 0.0125
    assert abs(errors[1]) < 0.3 * abs(errors[0])


def pendulum(start: float, time: float) -> tuple[float, float, float]:
    """Return x, y (m) and angle (rad) of a block that turns about its lower right corner, which is at the origin."""

    def centre(angle: float) -> tuple[float, float]:
        c, s = math.cos(angle), math.sin(angle)
        return -(c * WIDTH + s * HEIGHT) / 2, (c * HEIGHT - s * WIDTH) / 2

    square = (WIDTH**2 + HEIGHT**2) / 3  # of the radius of gyration about the corner
    found = solve_ivp(
        lambda _, y: (y[1], -G * centre(y[0])[0] / square), (0, time), (start, 0.0), rtol=1e-11, atol=1e-12
    )
    angle = float(found.y[0, -1])
    return (*centre(angle), angle)


def test_turning_about_an_edge_is_of_second_order(single: Callable[..., Any]) -> None:
    start, time = -math.radians(60.0), 0.08
    x, y, _ = pendulum(start, 0.0)
    exact = np.array(pendulum(start, time))

    def error(step: float, substeps: int) -> Any:
        block = {"x": x, "y": y + 1e-12, "angle": start}  # so far up that round-off does not let it touch at once
        run = single([block], restitution=0.0, friction=5.0, step=step, substeps=substeps).to_time(time)
        return abs(run.state()[0, :3] - exact)

    for step in (1e-3, 5e-4):
        assert (error(step / 2, 1) < 0.27 * error(step, 1)).all()
    for step in (1e-3, 5e-4):  # 0.45 where all substeps take the same bend
        assert (error(step / 2, 4) < 0.31 * error(step, 4)).all()
    assert error(1e-3, 4)[2] < 2e-5  # rad, of 0.19: seen 8e-6; 9e-4 with arms and normals of the start of the step
    assert error(1e-3, 4)[:2].max() < 2e-6


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize(("degrees", "slides"), [(-0.5, False), (0.5, True)])
def test_slope_holds_below_the_friction_angle_only(single: Callable[..., Any], degrees: float, slides: bool) -> None:
    slope = math.atan(0.38) + math.radians(degrees)
    run = single([{"y": ON_GROUND}], tilt=slope, restitution=0.0).to_time(0.5)
    before = float(run.bodies.x[0])
    moved = abs(float(run.to_time(2.0).bodies.x[0]) - before)
    assert moved > 1e-3 if slides else moved < 1e-12


def test_static_friction_holds_what_kinetic_friction_does_not_stop(single: Callable[..., Any]) -> None:
    slope = math.radians(20.0)
    friction = {"static": 0.45, "kinetic": 0.2, "transition_speed": 0.001}
    body = [{"y": ON_GROUND}]
    stays = single(body, tilt=slope, restitution=0.0, ground_friction=friction, velocity_tolerance=1e-5).to_time(1.0)
    assert abs(stays.bodies.x[0]) < 1e-4
    pushed = [{"y": ON_GROUND, "velocity": [-0.3, 0.0]}]
    slides = single(pushed, tilt=slope, restitution=0.0, ground_friction=friction, velocity_tolerance=1e-5).to_time(0.5)
    expected = 0.3 + 0.5 * G * (math.sin(slope) - 0.2 * math.cos(slope))
    assert abs(slides.bodies.vx[0]) == pytest.approx(expected, rel=0.01)


def test_stack_stands_still_and_sags_as_its_stiffness_says(single: Callable[..., Any]) -> None:
    blocks = [{"y": (i + 0.5) * HEIGHT} for i in range(10)]
    sags = []
    for substeps in (1, 4):
        run = single(blocks, restitution=0.0, substeps=substeps).to_time(2.5)
        then = run.state()
        run.to_time(3.0)
        assert abs(run.state()[:, :3] - then[:, :3]).max() < 1e-13
        sags.append(9.5 * HEIGHT - float(run.bodies.y[9]))
    assert sags[0] == pytest.approx(16.0 * sags[1], rel=1e-4)  # h^2
    # springs in series, one below each block with the weight above it: F A / w^2, A shared by two points of a face
    assert sags[1] == pytest.approx(142e-6, rel=0.01)


def test_three_blocks_end_where_the_prototype_had_them(begin: Callable[..., Any]) -> None:
    run = begin(three_blocks({"restitution": 0.0}), substeps=1, velocity_sweeps=1).to_time(2.0)
    assert run.status == AT_REST
    assert 1e3 * run.bodies.x[:2] == pytest.approx([16.0, 67.03], abs=0.15)
    assert 1e3 * run.bodies.x[2] == pytest.approx(128.78, abs=0.25)
    run = begin(three_blocks({"restitution": 0.2}), substeps=1, step=2e-4, velocity_tolerance=1e-3).to_time(2.0)
    assert 1e3 * run.bodies.x[1:] == pytest.approx([68.55, 132.8], abs=0.15)


@pytest.mark.parametrize(("step", "within"), [(1e-3, 0.3e-3), (1e-4, 0.03e-3)])
def test_toppling_before_the_first_impact(begin: Callable[..., Any], step: float, within: float) -> None:
    run = begin(three_blocks({"restitution": 0.0}), substeps=1, step=step).to_time(0.2)
    assert run.bodies.x[1:] == pytest.approx([64.446e-3, 116.650e-3], abs=within)
    assert run.bodies.y[1:] == pytest.approx([32.025e-3, 48.972e-3], abs=within)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.9])
@pytest.mark.parametrize("substeps", [1, 4])
def test_energy_adds_up_to_round_off(begin: Callable[..., Any], restitution: float, substeps: int) -> None:
    run = begin(three_blocks({"restitution": restitution}), substeps=substeps)
    for time in (0.05, 0.2, 0.3, 0.6):
        assert run.to_time(time).residual() < 1e-12


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.4, 1.0])
def test_impacts_create_no_energy(single: Callable[..., Any], restitution: float, friction: float) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        angle = float(random.uniform(-1.5, 1.5))
        height = abs(math.sin(angle)) * WIDTH / 2 + abs(math.cos(angle)) * HEIGHT / 2 + 1e-4
        body = {"y": height, "angle": angle, "velocity": [float(random.normal()), -1.0], "spin": float(random.normal())}
        values = {"gravity": 0.0, "restitution": restitution, "ground_friction": friction, "step": 2e-4}
        run = single([body], friction=friction, substeps=1, **values)
        energies = [run.kinetic, *(run.to_step(k).kinetic for k in range(1, 20))]
        assert np.diff(energies).max() < 1e-5 * energies[0]


def test_edges_of_pieces_of_ground(begin: Callable[..., Any]) -> None:
    tables: dict[str, Any] = {
        "contact": {"restitution": 0.0},
        "friction": {"block_block": 0.31, "block_ground": 0.38},
        "time": {"stop_at_rest": False},
        "ground": {"profile": [[-0.5, 0.0], [0.0, 0.0], [0.0, -0.06], [0.5, -0.06]]},
    }
    run = begin(scenario_of([{"x": 0.004, "y": ON_GROUND}], **tables), substeps=1).to_time(0.1)
    # as the explicit scheme has it: turned about the edge of a step
    assert run.bodies.x[0] == pytest.approx(12.285e-3, abs=1e-4)
    assert math.degrees(run.bodies.angle[0]) == pytest.approx(-47.69, abs=0.3)


def test_flush_joints_do_not_stop_a_block(single: Callable[..., Any]) -> None:
    base = [{"x": i * WIDTH, "y": ON_GROUND, "fixed": True} for i in range(3)]
    block = {"x": 0.0, "y": 3 * ON_GROUND, "velocity": [0.5, 0.0]}
    run = single([*base, block], restitution=0.0).to_time(0.5)
    assert run.bodies.x[3] == pytest.approx(0.5**2 / (2 * 0.31 * G), abs=5e-5)


@pytest.mark.parametrize(("restitution", "steps"), [(0.1, 200), (0.9, 30)])
def test_same_bits_for_any_number_of_threads_and_calls(
    begin: Callable[..., Any], restitution: float, steps: int
) -> None:
    scenario = pushed_wall(8, 6, contact={"restitution": restitution})
    whole = begin(scenario, velocity_tolerance=0.03).to_step(steps)
    parts = begin(scenario, velocity_tolerance=0.03).to_step(steps // 3).to_step(steps)
    assert np.array_equal(whole.state(), parts.state())
    scene = with_more_threads(build_nonsmooth(rigid(scenario, velocity_tolerance=0.03)), 2)
    scene.world.team[TEAM_SIZE] = 2
    codes = [0, 0]

    def be(k: int) -> None:
        codes[k] = advance_nonsmooth_in_team(scene, steps, k)

    threads = [threading.Thread(target=be, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert codes == [REACHED, REACHED]
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        assert np.array_equal(scene.world.bodies[name], whole.world.bodies[name])


def test_members_of_an_ensemble_have_the_same_bits(begin: Callable[..., Any]) -> None:
    scenarios = [three_blocks({"restitution": e}) for e in (0.0, 0.1)]
    alone = [begin(scenario).to_step(400) for scenario in scenarios]
    scenes = only_stack(build_stacks([rigid(scenario) for scenario in scenarios], NONSMOOTH)).scenes
    codes, starts = np.zeros(2, dtype=np.int64), np.zeros((2, len(NONSMOOTH_LEDGER) + 2))
    places, lengths = np.zeros((2, 3, 3)), np.zeros((2, 3))
    watched = Watched(
        np.zeros(2), np.zeros(2), np.zeros(2, dtype=np.int64), places, places, lengths, lengths, np.zeros(2)
    )  # no frames
    advance_nonsmooth_members(scenes, np.arange(2), np.full(2, 400), starts, codes, watched)
    for m in range(2):
        assert codes[m] == alone[m].status
        assert np.array_equal(scenes.world.bodies[m].x, alone[m].world.bodies.x)
