"""Velocity Verlet: exact where it must be, of second order elsewhere; what it keeps up to date and what it flags."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.kernels.common.arrays import BODY, CONTROLS, zeros
from blocksim.kernels.common.integrate import accelerate_and_kick, kick_and_drift

if TYPE_CHECKING:
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


def test_fixed_bodies_and_the_ground_stay_and_leave_their_forces_to_the_support() -> None:
    bodies = bodies_of(inverse_mass=0.0, inverse_inertia=0.0)
    bodies.fx = bodies.fy = bodies.torque = 1e6
    free_steps(bodies, 3)
    for name in ("x", "y", "angle", "vx", "vy", "spin", "ax", "ay", "spin_rate"):
        assert not bodies[name].any()
    for name in ("fx", "fy", "torque"):
        assert (bodies[name] == 1e6).all()


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
