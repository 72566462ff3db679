"""Polygons in motion with rigid contacts: impacts, rolling, slopes, wedges; closed forms and laws of conservation."""

from __future__ import annotations

import math
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import TEAM_SIZE
from blocksim.kernels.common.members import Watched
from blocksim.kernels.nonsmooth.energy import NONSMOOTH_LEDGER
from blocksim.kernels.nonsmooth.step import advance_nonsmooth_in_team, advance_nonsmooth_members
from blocksim.scenario.geometry import centre_outline, regular, section_of
from blocksim.verification.collapse import SIZES, staircase
from blocksim.verification.scene import CaseScene, Simulation
from blocksim.world.build import build_stacks, only_stack
from blocksim.world.nonsmooth import NONSMOOTH, build_nonsmooth, with_more_threads
from tests.kernels.nonsmooth.polygons import HEXAGON, RADIUS, TRIANGLE, depth_below, random_outline, turned
from tests.kernels.nonsmooth.scenes import RIGID, Block, listed, place, posed, rigid

if TYPE_CHECKING:
    from blocksim.scenario.geometry import Corners

G = 9.81
RESTITUTIONS = (0.0, 0.5, 1.0)
SHAPES = {"hexagon": HEXAGON, "triangle": TRIANGLE}


def started(blocks: list[Block], **values: Any) -> Simulation:
    """Return blocks under way; keywords as of posed."""
    return Simulation(posed(blocks, **values))


def thrown(outline: Corners, angle: float, e: float) -> Any:
    """Return a polygon after it has met the ground at 1 m/s, without friction and gravity."""
    block = Block(0.0, depth_below(outline, angle) + 1.5e-4, angle, vy=-1.0, outline=outline)
    run = started([block], restitution=e, gravity=0.0, ground_friction=0.0, step=1e-4, substeps=1)
    return run.to_step(3).bodies[0]


@pytest.mark.usefixtures("compiler")
def test_rectangles_given_as_outlines_collapse_as_rectangles_do() -> None:
    """To 1e-9 of what they move: each of the two rounds in its own way, which impacts multiply."""
    half_x, half_y = SIZES["width"] / 2, SIZES["height"] / 2
    outline = [[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]]
    collapses = [
        CaseScene([{**body, **extra} for body in staircase()], restitution=0.0, time={"scheme": "nonsmooth"}).start()
        for extra in ({}, {"outline": outline})
    ]
    usual, other = (run.to_time(0.5).state()[:, :3] for run in collapses)
    assert usual[2, 0] > 0.12  # m
    assert np.abs(usual - other).max() < 1e-9


@pytest.mark.parametrize("e", RESTITUTIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_polygon_that_lands_flat_leaves_with_the_asked_speed_and_no_spin(shape: str, e: float) -> None:
    body = thrown(SHAPES[shape], 0.0, e)
    assert body.vy == pytest.approx(e, abs=1e-9)
    assert abs(body.spin) < 1e-6


@pytest.mark.parametrize("e", RESTITUTIONS)
@pytest.mark.parametrize(("shape", "angle"), [("hexagon", 0.2), ("triangle", -0.4), ("triangle", 2.0)])
def test_corner_impact_is_that_of_its_effective_mass(shape: str, angle: float, e: float) -> None:
    """With J = (1 + e) m_eff v and 1 / m_eff = 1 / m + r^2 / I at the lever arm r of the corner."""
    corners = turned(SHAPES[shape], angle)
    arm = float(corners[np.argmin(corners[:, 1]), 0])
    area, moment = section_of(SHAPES[shape])
    impulse = (1.0 + e) / (1.0 + arm**2 * area / moment)  # over the mass
    body = thrown(SHAPES[shape], angle, e)
    assert body.vy == pytest.approx(-1.0 + impulse, abs=1e-8)
    assert body.spin == pytest.approx(arm * impulse * area / moment, rel=1e-8)


def test_hexagon_that_rolls_onto_its_next_face_keeps_eleven_seventeenths_of_its_spin() -> None:
    """About the new corner: w' (I + m R^2) = w (I + m R^2 cos 60 deg), I = 5/12 m R^2."""
    angle, spin = math.radians(-58.0), -8.0  # two degrees before it lands
    corners = turned(HEXAGON, angle)
    pivot = corners[np.argmin(corners[:, 1])]
    vx, vy = spin * pivot[1], -spin * pivot[0]
    block = Block(0.0, depth_below(HEXAGON, angle), angle, vx, vy, spin, outline=HEXAGON)
    run = started([block], restitution=0.0, ground_friction=5.0, step=1e-4)
    spins = [float(run.to_step(run.steps + 1).bodies.spin[0]) for _ in range(60)]
    fall = int(np.argmax(np.diff(spins)))
    assert spins[fall + 3] / spins[fall - 1] == pytest.approx(11.0 / 17.0, rel=0.005)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("ground", ["half-plane", "piece"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("degrees", "slides"), [(-0.5, False), (0.5, True)])
def test_slope_holds_a_polygon_below_the_friction_angle_only(
    shape: str, degrees: float, slides: bool, ground: str
) -> None:
    outline = SHAPES[shape]
    profile = {"profile": [[-1.0, 0.0], [1.0, 0.0]]} if ground == "piece" else {}
    tilt = math.atan(0.3) + math.radians(degrees)
    block = Block(0.0, depth_below(outline), outline=outline)
    run = started([block], tilt=-tilt, restitution=0.0, ground_friction=0.3, ground=profile).to_time(0.3)
    place_before, speed = float(run.bodies.x[0]), float(run.bodies.vx[0])
    run.to_time(0.8)
    if slides:
        rate = G * (math.sin(tilt) - 0.3 * math.cos(tilt))
        assert run.bodies.vx[0] - speed == pytest.approx(0.5 * rate, rel=1e-3)
    else:
        assert abs(run.bodies.x[0] - place_before) < 1e-9
    assert abs(run.bodies.angle[0]) < 1e-4


def test_spin_without_torque_stays() -> None:
    run = started([Block(0.0, 2.0, vx=0.3, spin=7.0, outline=TRIANGLE)], gravity=0.0).to_step(200)
    assert float(run.bodies.spin[0]) == 7.0
    assert float(run.bodies.angle[0]) == pytest.approx(1.4, abs=1e-12)


PAIRS, POSES = 100, 20


def poses(random: Any, outlines: list[Corners]) -> list[Block]:
    """Return pairs that meet or nearly do, moving towards one another at random; they are 1 m apart."""
    blocks = []
    for k in range(PAIRS):
        way, angle, other = random.uniform(-math.pi, math.pi, 3)
        distance = float(random.uniform(0.5, 1.2)) * RADIUS
        for i, turn in ((0, angle), (1, other)):
            side = distance if i else -distance
            vx, vy = (-side / RADIUS * math.cos(way), -side / RADIUS * math.sin(way))
            speed = random.normal(size=3)
            place_x, place_y = float(k) + side * math.cos(way), 5.0 + side * math.sin(way)
            vx, vy = vx + 0.3 * float(speed[0]), vy + 0.3 * float(speed[1])
            spin = 10.0 * float(speed[2])
            blocks.append(Block(place_x, place_y, float(turn), vx, vy, spin, outline=outlines[2 * k + i]))
    return blocks


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("e", [0.3, 1.0])
def test_random_pairs_push_one_another_alike_and_gain_no_energy(e: float) -> None:
    """2000 of them: impulses and their moments are opposite and equal, at the places where bodies were."""
    random = np.random.default_rng(8)
    outlines = [random_outline(random) for _ in range(2 * PAIRS)]
    scene = posed(poses(random, outlines), restitution=e, friction=0.4, gravity=0.0, velocity_tolerance=1e-10)
    run: Any = Simulation(scene)
    hit = 0
    for _ in range(POSES):
        place(run.scene, poses(random, outlines))
        for state, body in zip(run.scene.contacts.states[:-1], run.bodies, strict=True):
            state.vx, state.vy, state.spin = body.vx, body.vy, body.spin
        for constraint in run.scene.contacts.constraints:
            constraint.normal_one = constraint.normal_two = constraint.shear = 0.0
        run.world.clock[0].rebuilds = 0
        run.scene = listed(run.scene)
        bodies = run.bodies
        start, mass, inertia = run.state(), bodies.mass.copy(), bodies.inertia.copy()
        run.to_step(run.steps + 1)
        after = run.state()
        change = (after - start)[:, 3:] * np.stack([mass, mass, inertia], axis=-1)
        moment = start[:, 0] * change[:, 1] - start[:, 1] * change[:, 0] + change[:, 2]
        of_pair = change.reshape(PAIRS, 2, 3).sum(axis=1)
        assert np.abs(of_pair[:, :2]).max() < 1e-12
        assert np.abs(moment.reshape(PAIRS, 2).sum(axis=1)).max() < 1e-11

        def energy(state: Any) -> Any:
            one = 0.5 * (mass * (state[:, 3] ** 2 + state[:, 4] ** 2) + inertia * state[:, 5] ** 2)  # noqa: B023
            return one.reshape(PAIRS, 2).sum(axis=1)

        was, now = energy(start), energy(after)
        assert (now <= was * (1.0 + 1e-6)).all()
        hit += int(np.count_nonzero(np.abs(change[::2, :2]).max(axis=1) > 0.0))
    assert hit > PAIRS * POSES // 3


def test_polygons_heaped_up_between_walls_come_to_rest_without_falling_through() -> None:
    random = np.random.default_rng(4)
    valley = {"profile": [[-0.3, 0.3], [0.0, 0.0], [0.3, 0.3]]}
    blocks = [
        Block(0.03 * (i % 3 - 1), 0.12 + 0.05 * (i // 3), float(random.uniform(-3.0, 3.0)), outline=shape)
        for i, shape in enumerate([HEXAGON, TRIANGLE, *(random_outline(random) for _ in range(7))])
    ]
    run = started([*blocks, Block(0.0, 0.4)], restitution=0.2, friction=0.6, ground_friction=0.6, ground=valley)
    run.to_time(1.5)
    assert run.status == 0
    assert (run.bodies.y[:10] > np.abs(run.bodies.x[:10])).all()
    assert np.hypot(run.bodies.vx, run.bodies.vy)[:10].max() < 0.01
    assert run.ledger_row()[-1] < 5e-4
    assert run.residual() < 1e-9


@pytest.mark.usefixtures("compiler")
def test_heap_of_polygons_has_the_same_bits_for_any_number_of_threads_and_calls() -> None:
    random = np.random.default_rng(7)
    heap = [
        Block(
            0.045 * (i % 6), 0.03 + 0.045 * (i // 6), float(random.uniform(-3.0, 3.0)), outline=random_outline(random)
        )
        for i in range(24)
    ]
    values = {"restitution": 0.3, "friction": 0.5}
    whole, parts = started(heap, **values).to_step(150), started(heap, **values).to_step(70).to_step(150)
    assert np.array_equal(whole.state(), parts.state())
    scene = with_more_threads(posed(heap, **values), 2)
    scene.world.team[TEAM_SIZE] = 2
    threads = [Thread(target=advance_nonsmooth_in_team, args=(scene, 150, k)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        assert np.array_equal(scene.world.bodies[name], whole.world.bodies[name])


@pytest.mark.long  # compiles all once more
def test_members_of_an_ensemble_of_polygons_have_the_same_bits() -> None:
    def dropped(radius: float) -> Any:
        corners = [list(corner) for corner in regular(5, radius)]
        return rigid(CaseScene([{"outline": corners, "y": 1.2 * radius, "spin": 3.0}], time=RIGID).scenario())

    scenarios = [dropped(radius) for radius in (0.02, 0.03)]
    alone = [Simulation(build_nonsmooth(scenario)).to_step(100) for scenario in scenarios]
    scenes = only_stack(build_stacks(scenarios, NONSMOOTH)).scenes
    codes, starts = np.zeros(2, dtype=np.int64), np.zeros((2, len(NONSMOOTH_LEDGER) + 2))
    places, lengths = np.zeros((2, 1, 3)), np.zeros((2, 1))
    watched = Watched(
        np.zeros(2), np.zeros(2), np.zeros(2, dtype=np.int64), places, places, lengths, lengths, np.zeros(2)
    )  # no frames
    advance_nonsmooth_members(scenes, np.arange(2), np.full(2, 100), starts, codes, watched)
    for m in range(2):
        assert codes[m] == alone[m].status
        assert np.array_equal(scenes.world.bodies[m].angle, alone[m].world.bodies.angle)
        assert np.array_equal(scenes.world.bodies[m].y, alone[m].world.bodies.y)


BETA = math.radians(20.0)


def wedge(mass_ratio: float, speed: float = 0.0) -> tuple[list[Block], float]:
    """Return a wedge that fits between two jaws on the ground, which move together, and the mass of a jaw over its."""
    low, high, t = 0.01, 0.05, math.tan(BETA)

    def half(y: float) -> float:
        return 0.01 + y * t

    width = 2.0 * mass_ratio * (half(low) + half(high)) * (high - low) / (2.0 * high)
    shape = [(-half(low), low), (half(low), low), (half(high), high), (-half(high), high)]
    jaw = [(half(0.0), 0.0), (width, 0.0), (width, high), (half(high), high)]
    left = [(-x, y) for x, y in reversed(jaw)]
    blocks = []
    for corners, vx in ((shape, 0.0), (jaw, -speed), (left, speed)):
        outline = centre_outline(corners)
        x, y = corners[0][0] - outline[0][0], corners[0][1] - outline[0][1]
        blocks.append(Block(x, y, vx=vx, outline=outline))
    return blocks, section_of(blocks[1].outline)[0] / section_of(blocks[0].outline)[0]


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_wedge_slides_in_between_jaws_with_the_force_of_limit_equilibrium(friction: float) -> None:
    """N = W / (2 (sin b + mu cos b)) on either side as jaws become heavy; of these N pushes a = N (cos b - mu sin b)/M.

    The wedge sinks by the way of a jaw over tan b.
    """
    blocks, ratio = wedge(40.0)
    sin, cos = math.sin(BETA), math.cos(BETA)
    push, carry = cos - friction * sin, sin + friction * cos
    sinks = G / (1.0 + 2.0 * ratio * math.tan(BETA) * carry / push)
    run = started(blocks, restitution=0.0, friction=friction, ground_friction=0.0, velocity_tolerance=1e-8)
    run.to_time(0.1)
    assert run.bodies.vx[1] == pytest.approx(0.1 * sinks * math.tan(BETA), rel=0.01)
    assert run.bodies.vy[0] == pytest.approx(-0.1 * sinks, rel=0.01)
    weight = float(run.bodies.mass[0]) * G
    constraints = run.scene.contacts.constraints[: run.scene.contacts.stepping[0].constraint_count]
    normals = [
        (constraint.normal_one + constraint.normal_two) / 2.5e-4 for constraint in constraints if constraint.a == 0
    ]
    limit = weight / (2.0 * carry)
    assert normals == pytest.approx([limit * (1.0 - sinks / G)] * 2, rel=0.01)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.98, 1.02, 1.2])
def test_wedge_locks_where_friction_exceeds_the_tangent_of_its_half_angle(share: float) -> None:
    """Jaws that come together, and cannot turn, squeeze it out; or they stop.

    With the impulse P at either face and speed V of the jaws afterwards:
    m V / tan b = 2 P (sin b - mu cos b) and M (v - V) = P (cos b + mu sin b).
    """
    blocks, ratio = wedge(10.0, speed=0.1)
    sin, cos, friction = math.sin(BETA), math.cos(BETA), share * math.tan(BETA)
    scene = posed(blocks, restitution=0.0, friction=friction, ground_friction=0.0, gravity=0.0, velocity_tolerance=1e-9)
    for record in (scene.world.bodies, scene.contacts.states):
        record.inverse_inertia[1:3] = 0.0
    run = Simulation(scene).to_step(1)
    lift = max(0.0, sin - friction * cos)
    left = 0.1 / (1.0 + (cos + friction * sin) / (2.0 * ratio * math.tan(BETA) * lift)) if lift else 0.0
    assert run.bodies.vx[1:3] == pytest.approx([-left, left], abs=1e-5)
    assert run.bodies.vy[0] == pytest.approx(left / math.tan(BETA), abs=1e-5)


def test_polygon_of_many_corners_rolls_nearly_as_a_disc() -> None:
    """Down a slope without slip: a = g sin / (1 + I / m R^2), less what its sixteen corners take at every impact."""
    outline = regular(16, RADIUS)
    area, moment = section_of(outline)
    tilt = math.radians(20.0)
    block = Block(0.0, depth_below(outline), outline=outline)
    run = started([block], tilt=-tilt, restitution=0.0, ground_friction=2.0, step=2e-4).to_time(0.4)
    disc = G * math.sin(tilt) / (1.0 + moment / area / RADIUS**2)
    assert 0.3 * disc * 0.4 < run.bodies.vx[0] < disc * 0.4
    assert run.bodies.vx[0] == pytest.approx(-run.bodies.spin[0] * RADIUS, rel=0.05)
