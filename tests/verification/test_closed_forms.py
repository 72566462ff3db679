"""Closed forms against numerical integration, balances of energy and momentum, and limits."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import atan, cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from blocksim.scenario.laws import LAWS
from blocksim.verification import closed_forms as forms

G = 9.81
MASS, INERTIA = 0.10887, 1.496e-5  # the paper's block, 32 x 25 x 50 mm
TIGHT = {"rtol": 1e-11, "atol": 1e-13}


def bounce(height: float, restitution: float, impacts: int) -> tuple[list[float], list[float]]:
    """Integrate a bouncing point from rest at `height`; return impact times and apexes between."""

    def landing(_: float, state: np.ndarray) -> float:
        return float(state[0])

    landing.terminal, landing.direction = True, -1  # type: ignore[attr-defined]
    time, state = 0.0, [height, 0.0]
    times, apexes = [], []
    for _ in range(impacts + 1):
        flight = solve_ivp(lambda _, y: [y[1], -G], (time, time + 1), state, events=landing, max_step=1e-3, **TIGHT)
        apexes.append(float(flight.y[0].max()))
        time = float(flight.t_events[0][0])
        times.append(time)
        state = [1e-15, -restitution * float(flight.y_events[0][0][1])]
    return times, apexes


def test_bounces_are_as_high_and_as_long_as_integrated_ones() -> None:
    times, apexes = bounce(0.1, 0.5, 3)
    assert times[0] == pytest.approx(forms.fall_time(0.1), rel=1e-9)
    assert forms.fall_distance(times[0]) == pytest.approx(0.1)
    for impact, apex in enumerate(apexes):
        assert apex == pytest.approx(forms.apex_height(0.1, 0.5, impact), rel=1e-4)
    for impact, (start, end) in enumerate(pairwise(times), 1):
        assert end - start == pytest.approx(forms.flight_time(0.1, 0.5, impact), rel=1e-8)


@pytest.mark.parametrize("part", [0.0, 0.2, 0.5])
def test_printed_equation_10_is_what_is_still_to_rise(part: float) -> None:
    time = part * forms.flight_time(0.1, 0.5, 1)
    height = 0.5 * sqrt(2.0 * G * 0.1) * time - forms.fall_distance(time)
    assert height + forms.remaining_rise(time, 0.1, 0.5, 1) == pytest.approx(forms.apex_height(0.1, 0.5, 1))


def test_sliding_stops_where_integrated_friction_stops_it() -> None:
    def stopped(_: float, state: np.ndarray) -> float:
        return float(state[1])

    stopped.terminal = True  # type: ignore[attr-defined]
    slide = solve_ivp(lambda _, y: [y[1], -0.38 * G], (0.0, 1.0), [0.0, 0.5], events=stopped, **TIGHT)
    assert forms.sliding_stop_time(0.5, 0.38) == pytest.approx(float(slide.t_events[0][0]), rel=1e-9)
    assert forms.sliding_stop_distance(0.5, 0.38) == pytest.approx(float(slide.y_events[0][0][0]), rel=1e-9)
    assert forms.sliding_stop_distance(0.5, 0.38) == pytest.approx(33.5e-3, abs=5e-5)


def test_a_stopped_block_does_not_slide_back() -> None:
    stop = forms.sliding_stop_time(0.5, 0.38)
    assert forms.sliding_speed(0.0, 0.5, 0.38) == 0.5
    assert forms.sliding_speed(0.5 * stop, 0.5, 0.38) == pytest.approx(0.25)
    assert forms.sliding_speed(2.0 * stop, 0.5, 0.38) == 0.0


def test_incline_acceleration_at_its_limits() -> None:
    assert forms.incline_acceleration(radians(30), 0.31) == pytest.approx(2.271, abs=5e-4)
    assert forms.incline_acceleration(pi / 2, 0.31) == pytest.approx(G)
    assert forms.incline_acceleration(forms.sliding_slope(0.31) - 1e-9, 0.31) == 0.0
    assert 0.0 < forms.incline_acceleration(forms.sliding_slope(0.31) + 1e-6, 0.31) < 1e-4


def test_slopes_of_sliding_and_toppling_of_the_paper_s_block() -> None:
    assert np.degrees(forms.sliding_slope(0.31)) == pytest.approx(17.22, abs=5e-3)
    assert np.degrees(forms.sliding_slope(0.38)) == pytest.approx(20.81, abs=5e-3)
    for width, height in ((32.0, 25.0), (25.0, 32.0)):
        slope = forms.toppling_slope(width, height)
        centre_over_edge = -width / 2 * cos(slope) + height / 2 * sin(slope)
        assert centre_over_edge == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("width", "height", "slope"), [(0.025, 0.032, radians(60)), (0.032, 0.025, radians(55))])
def test_friction_needed_to_topple_is_that_of_newton_and_euler(width: float, height: float, slope: float) -> None:
    # unknowns: acceleration along (down the slope) and away from it, spin rate, friction (up the slope), normal force;
    # the lower edge lies at (width/2, -height/2) from the centre and does not move
    x, y, inertia = width / 2, -height / 2, (width**2 + height**2) / 12
    rows = [[1, 0, 0, 1, 0], [0, 1, 0, 0, -1], [0, 0, inertia, -y, -x], [1, 0, -y, 0, 0], [0, 1, x, 0, 0]]
    weight = np.array([G * sin(slope), -G * cos(slope), 0.0, 0.0, 0.0])
    *_, friction, normal = np.linalg.solve(np.array(rows), weight)
    assert forms.rolling_friction_limit(width, height, slope) == pytest.approx(friction / normal)
    assert width / height < friction / normal < np.tan(slope)
    limit = forms.toppling_slope(width, height)
    assert forms.rolling_friction_limit(width, height, limit) == pytest.approx(np.tan(limit))


def test_ladder_is_in_balance_with_the_friction_it_needs() -> None:
    slope, length, thickness = radians(60), 1.0, 0.01
    # corners of the ladder's under side touch ground and wall; coordinates from the foot, the wall to the left
    axis, across = np.array([-cos(slope), sin(slope)]), np.array([sin(slope), cos(slope)])
    head, centre = length * axis, 0.5 * (length * axis + thickness * across)
    wall = -centre[0] * G / head[1]  # moments about the foot, per mass
    assert forms.ladder_friction(slope, thickness / length) == pytest.approx(wall / G)
    assert forms.ladder_friction(slope, 0.0) == pytest.approx(0.2887, abs=5e-5)


def test_resting_overlaps_balance_the_weight() -> None:
    linear = brentq(lambda overlap: 1.9e9 * overlap - MASS * G, 0.0, 1e-6, xtol=1e-18)
    assert forms.static_overlap(MASS, 1.9e9) == pytest.approx(linear, rel=1e-6)
    modulus, radius = 3.8e10, 1e-3

    def surplus(overlap: float) -> float:
        return 8.0 / 3.0 * modulus * sqrt(radius) * float(overlap**1.5) - MASS * G

    stiffness = 2.0 * modulus * LAWS["hertz-mindlin"].size(0.05, radius)
    assert forms.static_overlap(MASS, stiffness, 1.5) == pytest.approx(brentq(surplus, 0.0, 1e-4, xtol=1e-18), rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_harmonic_stack_is_on_the_verge_at_every_level(count: int) -> None:
    offsets = forms.harmonic_offsets(count, 0.032)
    edges = np.cumsum((0.0, *offsets[::-1]))  # right edges, the table's first
    centres = edges[1:] - 0.016
    for level in range(count):
        assert float(np.mean(centres[level:])) == pytest.approx(edges[level], abs=1e-15)


def test_lowest_corner_is_the_lowest_of_four() -> None:
    assert forms.lowest_corner(0.032, 0.025, radians(30)) == pytest.approx((-7.6064e-3, -18.8253e-3), abs=1e-7)
    x, y = forms.lowest_corner(0.032, 0.025, radians(-120))
    assert hypot(x, y) == pytest.approx(hypot(0.032, 0.025) / 2)
    assert y < 0.0


Impact = Callable[[float, float, tuple[float, float], forms.Velocity, float], forms.Velocity]
FRICTIONLESS = partial(forms.corner_impact, sticks=False)
STICKING = partial(forms.corner_impact, sticks=True)
ARM = forms.lowest_corner(0.032, 0.025, radians(30))
FALLING = forms.Velocity(0.0, -1.0, 0.0)


def test_frictionless_impact_is_that_of_a_stiff_spring() -> None:
    def separating(_: float, state: np.ndarray) -> float:
        return float(state[0])

    separating.terminal, separating.direction = True, -1  # type: ignore[attr-defined]

    def spring(_: float, state: np.ndarray) -> list[float]:
        overlap, up, spin = state
        force = 1e8 * overlap
        return [-(up + spin * ARM[0]), force / MASS, force * ARM[0] / INERTIA]

    def deepest(_: float, state: np.ndarray) -> float:
        return float(state[1] + state[2] * ARM[0])

    contact = solve_ivp(spring, (0.0, 1.0), [1e-15, -1.0, 0.0], events=[separating, deepest], **TIGHT)
    elastic = FRICTIONLESS(MASS, INERTIA, ARM, FALLING, 1.0)
    assert list(contact.y_events[0][0][1:]) == pytest.approx([elastic.vy, elastic.spin], rel=1e-7)
    plastic = FRICTIONLESS(MASS, INERTIA, ARM, FALLING, 0.0)
    assert list(contact.y_events[1][0][1:]) == pytest.approx([plastic.vy, plastic.spin], rel=1e-7)


def test_sticking_impact_is_that_of_a_strong_dashpot_at_the_corner() -> None:
    before = forms.Velocity(0.4, -1.0, 20.0)

    def dashpot(_: float, state: np.ndarray) -> list[float]:
        along, up, spin = state
        fx, fy = -(along - spin * ARM[1]), -(up + spin * ARM[0])
        return [fx / MASS, fy / MASS, (ARM[0] * fy - ARM[1] * fx) / INERTIA]

    start = [before.vx, before.vy, before.spin]
    stopped = solve_ivp(dashpot, (0.0, 10.0), start, method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    after = STICKING(MASS, INERTIA, ARM, before, 0.0)
    assert [after.vx, after.vy, after.spin] == pytest.approx(list(stopped), rel=1e-6)


def kinetic_energy(motion: forms.Velocity) -> float:
    return 0.5 * MASS * (motion.vx**2 + motion.vy**2) + 0.5 * INERTIA * motion.spin**2


def angular_momentum_about_corner(motion: forms.Velocity) -> float:
    return INERTIA * motion.spin + MASS * (-ARM[0] * motion.vy + ARM[1] * motion.vx)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("impact", [FRICTIONLESS, STICKING])
def test_impacts_keep_angular_momentum_about_the_corner_and_obey_restitution(
    impact: Impact, restitution: float
) -> None:
    before = forms.Velocity(0.4, -1.0, 20.0)
    after = impact(MASS, INERTIA, ARM, before, restitution)
    assert angular_momentum_about_corner(after) == pytest.approx(angular_momentum_about_corner(before))
    assert after.vy + after.spin * ARM[0] == pytest.approx(-restitution * (before.vy + before.spin * ARM[0]))


@pytest.mark.parametrize(
    ("impact", "restitution"),
    [(FRICTIONLESS, 0.0), (FRICTIONLESS, 0.6), (STICKING, 0.0)],
)
def test_impacts_lose_energy_but_the_elastic_one(impact: Impact, restitution: float) -> None:
    before = forms.Velocity(0.4, -1.0, 20.0)
    assert kinetic_energy(impact(MASS, INERTIA, ARM, before, restitution)) < 0.99 * kinetic_energy(before)
    elastic = FRICTIONLESS(MASS, INERTIA, ARM, before, 1.0)
    assert kinetic_energy(elastic) == pytest.approx(kinetic_energy(before), rel=1e-14)


@pytest.mark.parametrize(("width", "height", "part"), [(0.010, 0.040, 0.5), (0.032, 0.050, 0.9), (0.01, 0.04, 0.01)])
def test_rocking_takes_as_long_as_integrated(width: float, height: float, part: float) -> None:
    alpha, radius = atan(width / height), hypot(width, height) / 2

    def flat(_: float, state: np.ndarray) -> float:
        return float(state[0])

    flat.terminal = True  # type: ignore[attr-defined]
    inertia = (width**2 + height**2) / 12 + radius**2  # about the corner, per unit mass
    spin_up = lambda _, y: [y[1], -G * radius * sin(alpha - y[0]) / inertia]  # noqa: E731
    motion = solve_ivp(spin_up, (0.0, 2.0), [part * alpha, 0.0], events=flat, **TIGHT)
    expected = float(motion.t_events[0][0])
    assert forms.rocking_quarter_time(width, height, part * alpha) == pytest.approx(expected, rel=1e-8)


def test_housner_ratio_keeps_angular_momentum_of_every_particle() -> None:
    part = (np.arange(200) + 0.5) / 200 - 0.5
    x, y = np.meshgrid(part * 0.010, part * 0.040)  # points of the rectangle's mass about its centre, all alike
    old_x, new_x, up = x - 0.005, x + 0.005, y + 0.020  # arms from the old pivot (right) and the new one (left)
    before = float(np.sum(new_x * old_x + up * up))  # arms from the new pivot, velocities about the old one
    after = float(np.sum(new_x**2 + up**2))
    assert forms.housner_ratio(0.010, 0.040) == pytest.approx(before / after, rel=1e-4)
    assert forms.housner_ratio(0.010, 0.040) == pytest.approx(0.9118, abs=5e-5)
