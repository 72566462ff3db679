"""Driven bodies carry, drop, lift and tip what lies on them as closed forms say, in both schemes."""

from __future__ import annotations

from math import atan, cos, degrees, pi, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario.motion import drives_of
from blocksim.simulation import run_ensemble, simulate, simulate_into
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import HEIGHT, Simulation
from tests.simulation.driven import FRICTION, SCHEMES, THICK, G, block, on_plate, plate
from tests.simulation.sliding import assert_same, interrupted_at

if TYPE_CHECKING:
    from pathlib import Path

PEAK = 10.0 / 3.0**0.5  # greatest acceleration of a smooth ramp, over distance / duration^2
both = pytest.mark.parametrize("scheme", SCHEMES)


def smooth(acceleration: float, duration: float = 0.08, **keys: Any) -> dict[str, Any]:
    """Return a smooth ramp with this greatest acceleration (m/s2), after a rest in which springs settle."""
    distance = acceleration * duration**2 / PEAK
    return {"kind": "ramp", "distance": distance, "duration": duration, "course": "smooth", "start": 0.02, **keys}


@both
def test_plate_takes_a_block_along_below_the_friction_limit(scheme: str) -> None:
    motion = smooth(0.9 * FRICTION * G)
    run = simulate(on_plate(scheme, [block(), plate(motion)], 0.12))
    assert run.final["x_mm"].tolist() == pytest.approx([1e3 * motion["distance"]] * 2, rel=0.01)
    assert run.summary.energy_J.relative_residual < 1e-3


@both
def test_block_slips_on_its_plate_at_exactly_the_friction_limit(scheme: str) -> None:
    run = Simulation(build_scene(on_plate(scheme, [block(), plate(smooth(4.0 * FRICTION * G))], 0.12)))
    run.to_time(0.03)
    rates = []
    while run.time < 0.05:  # the plate is ahead of the block all this time
        before, since = float(run.bodies.vx[0]), run.time
        run.to_step(run.steps + 20)
        rates.append((float(run.bodies.vx[0]) - before) / (run.time - since))
    assert rates == pytest.approx([FRICTION * G] * len(rates), rel=0.02 if scheme == "explicit" else 1e-3)
    assert run.residual() < 1e-3


@both
def test_lift_presses_with_the_mass_times_gravity_and_acceleration(scheme: str) -> None:
    motion = smooth(6.0, direction="90 deg")
    scenario = on_plate(scheme, [block(), plate(motion)], 0.2, output={"contacts": True, "every": 0.0005})
    run = simulate(scenario)
    contacts, mass = run.frames.contacts, scenario_mass(scenario)
    assert contacts is not None
    for share in (0.25, 0.75):
        frame = int(np.argmin(np.abs(run.frames.time - (0.02 + 0.08 * share))))
        pressed = sum(contacts.at(frame)["normal_force"])
        pull = 6.0 / PEAK * (60.0 * share - 180.0 * share**2 + 120.0 * share**3)
        assert pressed == pytest.approx(mass * (G + pull), rel=0.02)
    gained = mass * G * motion["distance"]
    assert run.summary.energy_J.to_support == pytest.approx(-gained, rel=0.01)
    assert run.summary.energy_J.relative_residual < 1e-3


def scenario_mass(scenario: Any) -> float:
    """Return the mass (kg) of the free block."""
    return float(build_scene(scenario).world.bodies.mass[0])


def turning(scheme: str, slope: float, friction: float, **keys: Any) -> Simulation:
    """Start a block on a plate whose slope (degrees) is two less than this, and grows by 10 degrees in a second."""
    angle, half = radians(slope - 2.0), keys.get("height", HEIGHT) / 2
    c, s = cos(angle), sin(angle)
    motion = {"kind": "rotation", "angle": "10 deg", "duration": 1.0, "about": [0.0, 0.2]}
    below = plate(motion, x=s * THICK / 2, y=0.2 - c * THICK / 2, angle=angle)
    above = {"x": -s * half, "y": 0.2 + c * half, "angle": angle, **keys}
    return Simulation(build_scene(on_plate(scheme, [above, below], 1.0, friction=friction)))


def slope_of(run: Simulation) -> float:
    """Return the slope of the plate (degrees)."""
    return degrees(float(run.bodies.angle[1]))


@both
def test_slender_block_tips_from_a_turning_plate_at_its_own_slope(scheme: str) -> None:
    slope = degrees(atan(0.25))
    run = turning(scheme, slope, 2.0, width=0.01, height=0.04)
    while run.time < 0.4 and float(run.bodies.angle[0] - run.bodies.angle[1]) < radians(0.5):
        run.to_step(run.steps + 20)
    assert slope - 0.1 < slope_of(run) < slope + 1.5  # until it has tipped so far


@both
def test_driven_plate_does_to_a_block_what_a_fixed_one_on_a_moving_support_does(scheme: str) -> None:
    motion = {"kind": "harmonic", "amplitude": "4 mm", "frequency": 8, "direction": "20 deg"}
    time = {"step": 1e-4} if scheme == "nonsmooth" else {}  # the usual one follows from how fast bodies are
    own = simulate(on_plate(scheme, [block(), plate(motion)], 0.1, time=time))
    shared = simulate(on_plate(scheme, [block(), plate()], 0.1, motion=motion, time=time))
    assert own.final.iloc[0, 1:].tolist() == pytest.approx(shared.final.iloc[0, 1:].tolist(), abs=1e-9)
    assert own.summary.energy_J.to_support == pytest.approx(shared.summary.energy_J.to_support, abs=1e-12)


@both
def test_bodies_come_back_to_the_last_bit_and_the_run_rests_only_then(scheme: str) -> None:
    motion = {"kind": "harmonic", "amplitude": "1 mm", "frequency": 50, "duration": 0.06, "ramp": 0.02}
    rest = {"stop_at_rest": True, "rest_hold": 0.002, "rest_speed": 0.01}
    run = simulate(on_plate(scheme, [block(), plate(motion)], 0.2, time=rest))
    assert run.reason == "at rest"
    assert 0.06 < run.summary.simulated_time_s < 0.15
    assert run.frames.y[-1, 1] == run.frames.y[0, 1]
    assert run.frames.x[-1, 1] == pytest.approx(run.frames.x[0, 1], abs=1e-12)


@both
def test_wheel_of_a_far_point_moves_on_its_circle(scheme: str) -> None:
    turn = {"kind": "rotation", "angle": "90 deg", "duration": "50 ms", "about": [0.2, 0.1]}
    run = simulate(on_plate(scheme, [block(x=1.0, y=HEIGHT / 2), plate(turn, width=0.1)], 0.06))
    frame, plate_y = run.frames, 0.1 - THICK / 2
    radius = np.hypot(frame.x[:, 1] - 0.2, frame.y[:, 1] - 0.1)
    assert radius == pytest.approx(np.hypot(0.2, plate_y - 0.1), abs=1e-12)
    assert (frame.x[-1, 1], frame.y[-1, 1]) == pytest.approx((0.2 + THICK / 2, -0.1), abs=1e-12)
    assert frame.angle[-1, 1] == pytest.approx(pi / 2)


@both
def test_block_struck_by_a_driven_body_leaves_as_restitution_says(scheme: str) -> None:
    """At 1.8 times the speed, with energy that the driven body brings in: no gain that had to be prevented."""
    ramp = {"kind": "ramp", "distance": 0.05, "speed": 1.0}
    pusher = {"x": -0.04, "y": HEIGHT / 2, "width": 0.02, "height": 0.02, "name": "pusher", "motion": ramp}
    scenario = on_plate(scheme, [{"x": 0.0, "y": HEIGHT / 2}, pusher], 0.09, friction=0.0, gravity=0.0, restitution=0.8)
    run = simulate(scenario)
    assert run.final.loc[0, "vx_mm_s"] == pytest.approx(1800.0, rel=0.01)
    assert run.summary.energy_J.relative_residual < 1e-3


@both
def test_run_of_a_driven_body_continues_and_runs_in_an_ensemble_with_the_same_bits(tmp_path: Path, scheme: str) -> None:
    scenario = on_plate(scheme, [block(), plate(smooth(4.0 * FRICTION * G))], 0.06, output={"every": 0.002})
    whole = simulate_into(scenario, tmp_path / "whole")
    steps = [whole.summary.steps // 3, whole.summary.steps // 2]
    interrupted_at(scenario, tmp_path / "parts", steps)
    assert_same(simulate_into(scenario, tmp_path / "parts", resume=True), whole)
    assert [one.columns for one in run_ensemble([scenario, scenario])] == [whole.columns] * 2


def test_speed_of_a_ramp_is_the_greatest_of_its_course() -> None:
    for course, mean in (("constant", 2.0), ("smooth", 2.0 * 8.0 / 15.0)):
        motion = {"kind": "ramp", "distance": 0.3, "speed": 2.0, "course": course}
        (drive,) = drives_of(on_plate("explicit", [block(), plate(motion)], 1.0))
        assert drive.rest_time == pytest.approx(0.3 / mean)
