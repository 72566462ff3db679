"""Velocity Verlet: exact where it must be, of second order elsewhere; what it books and what it flags."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.arrays import BODY, CONTROLS, LEDGER, zeros
from blocksim.kernels.integrate import PAIR_SHARE, accelerate_and_kick, kick_and_drift, kinetic_energy, renew_rotations

if TYPE_CHECKING:
    from blocksim.kernels.arrays import Record, Records, World
    from tests.conftest import PaperBlock, Start

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


def controls_with(skin: float = 1.0) -> Record:
    controls = zeros(1, CONTROLS)[0]
    controls.step, controls.gravity_x, controls.gravity_y, controls.skin = STEP, 0.3, -9.81, skin
    return controls


def free_steps(bodies: Records, count: int) -> Record:
    controls, ledger = controls_with(), zeros(1, LEDGER)[0]
    accelerate_and_kick(bodies, controls, 0.0)
    for _ in range(count):
        kick_and_drift(bodies, controls, STEP, ledger)
        accelerate_and_kick(bodies, controls, STEP)
    return ledger


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
    accelerate_and_kick(bodies, controls_with(), STEP)
    body = bodies[0]
    assert [body.ax, body.ay, body.spin_rate] == pytest.approx([0.3 + 2.0, -9.81 + 3.0, 3.0])
    assert [body.vx, body.vy, body.spin] == pytest.approx([2.3 * STEP / 2, -6.81 * STEP / 2, 3.0 * STEP / 2])
    assert (body.fx, body.fy, body.torque) == (0.0, 0.0, 0.0)


def test_fixed_bodies_and_the_ground_stay_and_use_up_their_forces() -> None:
    bodies = bodies_of(inverse_mass=0.0, inverse_inertia=0.0)
    bodies.fx = 1e6
    free_steps(bodies, 3)
    for name in ("x", "y", "angle", "vx", "vy", "spin", "fx"):
        assert not bodies[name].any()


def test_weights_travel_is_booked_both_up_and_down() -> None:
    bodies = bodies_of(vy=9.81 * 0.1)
    ledger = free_steps(bodies, 200)  # up and down again
    height = (9.81 * 0.1) ** 2 / (2 * 9.81)
    sideways = 2.0 * 0.3 * 0.15 * 0.2**2
    assert ledger.travel_work == pytest.approx(2.0 * 9.81 * 2 * height + sideways, rel=0.02)


@pytest.mark.parametrize("motion", [{"vx": 1.0}, {"vy": -1.0}, {"spin": 10.0}])
@pytest.mark.parametrize(("share", "due"), [(0.99, False), (1.01, True)])
def test_pair_list_is_due_once_a_corner_has_used_its_share_of_the_skin(
    motion: dict[str, float], share: float, due: bool
) -> None:
    moved = STEP * abs(next(iter(motion.values()))) * (0.1 if "spin" in motion else 1.0)
    controls = controls_with(skin=moved / (PAIR_SHARE * share))
    assert bool(kick_and_drift(bodies_of(**motion), controls, STEP, zeros(1, LEDGER)[0])) is due


def test_renewed_rotations_are_those_of_the_angles() -> None:
    bodies = bodies_of(angle=100.0)
    renew_rotations(bodies)
    assert [bodies[0].cos, bodies[0].sin] == [cos(100.0), sin(100.0)]


def test_kinetic_energy_is_that_of_translation_and_spin(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"y": 1.0, "velocity": [3.0, 4.0], "spin": 7.0}, {"x": 1.0, "y": 1.0}])
    expected = 0.5 * paper_block.mass * 25.0 + 0.5 * paper_block.inertia * 49.0
    assert kinetic_energy(scene.world) == pytest.approx(expected, rel=1e-12)


def oscillation_error(start: Start, block: PaperBlock, safety: float) -> float:
    """Return the largest error, in static overlaps, of a block that oscillates undamped without lifting off."""
    frequency = sqrt(2.0 * block.point_stiffness / block.mass)
    sag = 9.81 / frequency**2

    def press(world: World) -> None:
        world.bodies[0].y = block.height / 2 - 1.5 * sag

    scene = start([{"y": block.height / 2}], restitution=1.0, time={"safety": safety}, change=press)
    worst = 0.0
    while scene.time * frequency < 20.0:
        scene.to_step(scene.steps + 1)
        expected = block.height / 2 - sag - 0.5 * sag * np.cos(frequency * scene.time)
        worst = max(worst, abs(float(scene.bodies[0].y) - expected) / sag)
    return worst


def test_oscillation_on_contact_springs_converges_with_second_order(start: Start, paper_block: PaperBlock) -> None:
    errors = [oscillation_error(start, paper_block, safety) for safety in (0.1, 0.05, 0.025)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)
