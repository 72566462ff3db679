"""Impacts of rigid blocks: energy, momentum, and that one impact leaves others alone."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.verification.scene import HEIGHT, WIDTH, Simulation

if TYPE_CHECKING:
    from collections.abc import Callable

ON_GROUND = HEIGHT / 2
SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}
SEED = 0


def box(count: int, side: float) -> list[dict[str, Any]]:
    """Return blocks that fly at random in a square box (m)."""
    wall, pitch = 0.1, side / math.ceil(math.sqrt(count))
    upright = {"y": side / 2, "width": wall, "height": side, "fixed": True}
    lid = {"x": side / 2, "y": side + wall / 2 + 1e-4, "width": side, "height": wall, "fixed": True}
    random = np.random.default_rng(SEED)
    bodies = [{"x": -wall / 2, **upright}, {"x": side + wall / 2, **upright}, lid]
    for i in range(count):
        constraint, column = divmod(i, math.ceil(math.sqrt(count)))
        bodies.append(
            {
                "x": (column + 0.5) * pitch,
                "y": (constraint + 0.5) * pitch,
                "width": 0.03,
                "height": 0.024,
                "angle": float(random.uniform(0.0, 6.0)),
                "velocity": random.normal(size=2).tolist(),
                "spin": float(5.0 * random.normal()),
            }
        )
    return bodies


@pytest.mark.parametrize("gravity", [0.0, 9.81])
@pytest.mark.parametrize(("count", "side", "time"), [(9, 0.25, 1.0), (500, 1.5, 2.0)])
def test_elastic_blocks_in_a_box_keep_their_energy(
    single: Callable[..., Simulation], count: int, side: float, time: float, gravity: float, pace: int
) -> None:
    run = single(box(count, side), restitution=1.0, gravity=gravity, **SMOOTH)
    start, moving = run.mechanical, run.kinetic
    run.to_time(time / (pace if count == 9 else pace**2))
    assert abs(run.mechanical - start) < 0.002 * moving  # seen 1e-4
    assert run.residual() < 1e-12


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_elastic_block_comes_back_to_where_it_fell_from(single: Callable[..., Simulation], angle: float) -> None:
    height = math.sin(angle) * WIDTH / 2 + math.cos(angle) * HEIGHT / 2 + 0.05
    run = single([{"y": height, "angle": angle}], restitution=1.0, **SMOOTH)
    start = run.mechanical
    assert run.to_time(0.5).mechanical == pytest.approx(start, rel=1e-9)  # 1 to 2 % lost with J v+ = -e J v-
    assert run.residual() < 1e-12


def constraint(gap: float) -> list[dict[str, Any]]:
    """Return five blocks in a constraint (m between them), of which the first meets the second within a substep."""
    blocks: list[dict[str, Any]] = [{"x": i * (WIDTH + gap), "y": 0.2} for i in range(5)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    return blocks


@pytest.mark.parametrize("has_cuts", [0, 1])  # in rounds of one substep, or in steps that are cut
@pytest.mark.parametrize(("gap", "within"), [(1e-4, 1e-6), (1e-5, 1e-3)])
def test_row_of_blocks_apart_passes_a_blow_on(
    single: Callable[..., Simulation], gap: float, within: float, has_cuts: int
) -> None:
    run = single(constraint(gap), restitution=1.0, gravity=0.0, **SMOOTH)
    run.scene.contacts.stepping[0].has_cuts = has_cuts
    run.to_time(0.02)
    assert run.bodies.vx == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0], abs=within)


def test_long_row_passes_a_blow_on(single: Callable[..., Simulation]) -> None:
    blocks: list[dict[str, Any]] = [{"x": i * WIDTH, "y": 0.2} for i in range(20)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    run = single(blocks, restitution=1.0, gravity=0.0, friction=0.0).to_step(4)
    assert run.bodies.vx == pytest.approx([*[0.0] * 19, 1.0], abs=0.02)


@pytest.mark.parametrize(("restitution", "substeps"), [(0.45, 8), (0.5, 8), (0.51, 4), (0.9, 4)])
def test_row_of_blocks_apart_loses_at_every_blow_what_newton_says(
    single: Callable[..., Simulation], restitution: float, substeps: int
) -> None:
    """Up to 0.5 that takes substeps in which no block is struck and strikes."""
    more = {**SMOOTH, "substeps": substeps}
    run = single(constraint(1e-4), restitution=restitution, gravity=0.0, **more).to_time(0.002)
    assert run.bodies.vx[4] == pytest.approx((0.5 + 0.5 * restitution) ** 4, abs=1e-6)


def struck_row(count: int, gap: float, **more: Any) -> tuple[list[dict[str, Any]], list[int]]:
    """Return a row of blocks that stand on the ground (m between them), `incoming` ones at 1 m/s, and their places.

    Optional are `heights` (m) and `middle` (m), `is_mirrored`, `has_outlines`, and the `order` in which they are given.
    """
    heights = more.get("heights", [HEIGHT] * count)
    incoming, sign = more.get("incoming", 1), -1.0 if more.get("is_mirrored") else 1.0
    order = more.get("order", list(range(count)))
    blocks = []
    for i in order:
        x = i * WIDTH + max(0, i - incoming + 1) * gap - (1e-3 if i < incoming else 0.0)
        speed = 1.0 if i < incoming else 0.0
        middle = more.get("middle", 0.5 * heights[i])
        corners = [[0.5 * a * WIDTH, 0.5 * b * heights[i]] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        shape = {"outline": corners} if more.get("has_outlines") else {"height": heights[i]}
        blocks.append({"x": sign * x, "y": middle, **shape, "velocity": [sign * speed, 0.0]})
    return blocks, [order.index(i) for i in range(count)]


GAPS = (0.0, 1e-9, 1e-6)
CRADLES: dict[str, tuple[int, dict[str, Any], list[float]]] = {
    "three": (3, {}, [0.0, 0.0, 1.0]),
    "five": (5, {}, [0.0, 0.0, 0.0, 0.0, 1.0]),
    "seven": (7, {}, [0.0] * 6 + [1.0]),
    "two on three": (5, {"incoming": 2}, [0.0, 0.0, 0.0, 1.0, 1.0]),
    "from the right": (5, {"is_mirrored": True}, [0.0, 0.0, 0.0, 0.0, 1.0]),
    "outlines": (5, {"has_outlines": True}, [0.0, 0.0, 0.0, 0.0, 1.0]),
    "in another order": (5, {"order": [3, 0, 4, 2, 1]}, [0.0, 0.0, 0.0, 0.0, 1.0]),
}


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("name", CRADLES)
def test_blocks_that_touch_are_struck_one_after_the_other(
    single: Callable[..., Simulation], name: str, gap: float
) -> None:
    count, more, expected = CRADLES[name]
    blocks, places = struck_row(count, gap, **more)
    run = single(blocks, restitution=1.0, **SMOOTH).to_time(0.01)
    sign = -1.0 if more.get("is_mirrored") else 1.0
    assert sign * run.bodies.vx[places] == pytest.approx(expected, abs=1e-3)  # the tolerance of the velocity pass
    assert sign * run.bodies.vx.sum() == pytest.approx(more.get("incoming", 1), abs=1e-9)
    assert run.kinetic <= 0.5 * run.bodies.mass[0] * more.get("incoming", 1) * (1.0 + 1e-9)


@pytest.mark.parametrize("gap", [*GAPS, 1e-4])
def test_a_row_loses_at_every_blow_what_newton_says_however_small_its_gaps_are(
    single: Callable[..., Simulation], gap: float
) -> None:
    """Up to 0.5 blocks that touched were struck as one; expected are blows between two at a time until all part."""
    blocks, _ = struck_row(5, gap)
    run = single(blocks, restitution=0.5, **SMOOTH).to_time(0.03)
    assert run.bodies.vx == pytest.approx([0.15387, 0.16718, 0.17798, 0.18457, 0.31641], abs=1e-4)


@pytest.mark.parametrize("gap", GAPS)
def test_touching_faces_of_unequal_heights_pass_a_blow_on(single: Callable[..., Simulation], gap: float) -> None:
    """Their middles are at one height, so that none turns: in pairs, v is shared as their masses say."""
    heights = [0.02, 0.04, 0.01, 0.03]
    blocks, _ = struck_row(4, gap, heights=heights, middle=0.2)
    run = single(blocks, restitution=1.0, gravity=0.0, **SMOOTH).to_time(0.02)
    velocities = [1.0, 0.0, 0.0, 0.0]
    blows = 0
    while blows < 100 and any(left > right + 1e-12 for left, right in pairwise(velocities)):
        for i in range(3):
            if velocities[i] > velocities[i + 1] + 1e-12:
                one, other = heights[i], heights[i + 1]
                middle = (one * velocities[i] + other * velocities[i + 1]) / (one + other)
                velocities[i : i + 2] = [2.0 * middle - velocities[i], 2.0 * middle - velocities[i + 1]]
                blows += 1
    assert run.bodies.vx == pytest.approx(velocities, abs=1e-3)
    assert abs(run.bodies.spin).max() < 1e-9


def test_blocks_that_press_on_one_another_are_struck_as_one(single: Callable[..., Simulation]) -> None:
    """A stack that stands gives a block that falls on it its restitution, as the ground would, and stays."""
    stack = [{"y": (i + 0.5) * HEIGHT} for i in range(4)]
    run = single([*stack, {"y": 4.5 * HEIGHT + 0.05}], restitution=0.8, **SMOOTH).to_time(0.12)
    fall = math.sqrt(2.0 * 9.81 * 0.05)
    assert run.bodies.vy[4] == pytest.approx(0.8 * fall - 9.81 * (0.12 - fall / 9.81), abs=2e-3)
    assert abs(run.bodies.vy[:4]).max() < 1e-3


def test_contacts_report_the_impulses_of_all_rounds(single: Callable[..., Simulation]) -> None:
    run = single(constraint(1e-4), restitution=1.0, gravity=0.0, substeps=1, **SMOOTH)
    run.scene.contacts.stepping[0].has_cuts = 0  # it would be in an interval each
    before = run.bodies.vx.copy()
    run.to_step(1)
    constraints = run.scene.contacts.constraints[: run.scene.contacts.stepping[0].constraint_count]
    impulses = constraints["nx"] * (constraints["normal_one"] + constraints["normal_two"])
    assert np.count_nonzero(impulses) == 3  # one after the other, within this substep
    gained = np.zeros(len(before) + 1)  # of momentum (kg m/s); the ground is the last
    np.add.at(gained, constraints["a"], impulses)
    np.add.at(gained, constraints["b"], -impulses)
    assert gained[:-1] == pytest.approx(run.bodies.mass * (run.bodies.vx - before), abs=1e-12)


def thrown(random: np.random.Generator) -> dict[str, Any]:
    """Return a block that is about to meet the ground with a corner."""
    angle = float(random.uniform(-1.5, 1.5))
    height = abs(math.sin(angle)) * WIDTH / 2 + abs(math.cos(angle)) * HEIGHT / 2 + 1e-4
    velocity = [float(1.5 * random.normal()), -1.0]
    return {"y": height, "angle": angle, "velocity": velocity, "spin": float(10.0 * random.normal())}


def test_landing_elsewhere_leaves_a_flat_elastic_landing_alone(single: Callable[..., Simulation]) -> None:
    flat = {"y": ON_GROUND + 1e-4, "velocity": [0.0, -1.0]}
    random = np.random.default_rng(3)
    values: dict[str, Any] = {"restitution": 1.0, "ground_friction": 3.0, "gravity": 0.0}
    alone = single([flat], **values).to_time(0.003)
    assert alone.bodies.vy[0] == pytest.approx(1.0, abs=1e-12)
    for _ in range(10):  # Newton's law alone gives some of them energy
        both = single([flat, {**thrown(random), "x": 1.0}], **values).to_time(0.003)
        assert both.state()[0, 3:] == pytest.approx(alone.state()[0, 3:], abs=1e-12)


def first_impact(run: Simulation) -> tuple[float, float]:
    """Step until a block has met the ground; return its upward momentum (m/s) and what energy it gained."""
    speed, energy = float(run.bodies.vy[0]), run.kinetic
    while run.steps < 50 and run.bodies.vy[0] == speed:
        run.to_step(run.steps + 1)
    return float(run.bodies.vy[0]), run.kinetic / energy - 1.0


@pytest.mark.parametrize("friction", [0.3, 1.0, 3.0])
def test_rebound_that_would_gain_energy_keeps_it_and_grows_with_restitution(
    single: Callable[..., Simulation], friction: float
) -> None:
    random = np.random.default_rng(3)
    restrained = 0
    for _ in range(20):
        body = thrown(random)
        values: dict[str, Any] = {"gravity": 0.0, "step": 2e-4, "substeps": 1, "ground_friction": friction}
        elastic = first_impact(single([body], restitution=1.0, **values))
        assert elastic[1] < 1e-9
        if abs(elastic[1]) < 1e-9:
            found = [first_impact(single([body], restitution=e, **values)) for e in (0.1, 0.3, 0.5, 0.7, 0.8, 0.9)]
            for (slower, _), (faster, _) in pairwise([*found, elastic]):
                assert faster > slower - 1e-12  # m/s, of 1; a share of two solutions with a bend between fell by 2e-4
            restrained += 1
    assert restrained > 0  # the throws are such that Newton's law alone would create energy


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
def test_momentum_of_blocks_in_flight_is_kept(single: Callable[..., Simulation], restitution: float, pace: int) -> None:
    bodies = [{**body, "y": body["y"] + 1.0} for body in box(16, 0.2)[3:]]
    run = single(bodies, restitution=restitution, friction=0.5, gravity=0.0)
    mass, inertia = run.bodies.mass.copy(), run.bodies.inertia.copy()

    def momenta() -> np.ndarray[Any, Any]:
        x, y, _, vx, vy, spin = run.state().T
        return np.array([mass @ vx, mass @ vy, mass @ (x * vy - y * vx) + inertia @ spin])

    before = momenta()
    run.to_time(0.3 / pace)
    assert float(run.ledger_row()[2]) > 0.01 * run.kinetic * (1.0 - restitution)
    # pushes of the position pass, which are gone after each substep, shift the arms of blocks that turn
    assert abs(momenta() - before) == pytest.approx(0.0, abs=2e-3 * float(mass.sum()))
    assert abs(momenta() - before)[:2].max() < 1e-12


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("restitution", [0.6, 0.9, 1.0])
def test_crowd_with_friction_never_gains_energy(
    single: Callable[..., Simulation], restitution: float, pace: int
) -> None:
    run = single(box(25, 0.25), restitution=restitution, friction=0.4, ground_friction=0.4, gravity=0.0)
    kinetic = [run.kinetic, *(run.to_step(k).kinetic for k in range(1, 400 // pace))]
    assert np.diff(kinetic).max() < 1e-6 * kinetic[0]
    assert pace > 1 or kinetic[-1] < 0.9 * kinetic[0]


def test_impacts_are_not_solved_beyond_round_off_where_the_velocity_pass_is(single: Callable[..., Simulation]) -> None:
    """They were solved to a share of its tolerance, below what velocities can hold, by as many sweeps as allowed."""
    values: dict[str, Any] = {"restitution": 0.9, "friction": 0.4, "ground_friction": 0.4, "gravity": 9.81}
    runs = [single(box(16, 0.2), velocity_tolerance=tolerance, **values).to_time(0.1) for tolerance in (1e-3, 1e-12)]
    usual, fine = (int(run.scene.contacts.stepping[0].sweeps) for run in runs)
    assert 1000 < usual < fine < 3 * usual


def test_friction_takes_from_a_block_that_slides_on_another(single: Callable[..., Simulation]) -> None:
    blocks = [{"y": ON_GROUND, "width": 0.2}, {"y": 3 * ON_GROUND, "velocity": [0.5, 0.0]}]
    run = single(blocks, restitution=0.9, ground_friction=0.05)
    friction = [float(run.to_step(k).ledger_row()[3]) for k in range(1, 150)]
    assert np.diff(friction).min() > -1e-15
    assert friction[-1] > 1e-3
