"""Steps of few blocks that are cut at impacts: these happen at their time, and nothing else notices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.nonsmooth.cuts import set_length
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, Simulation, scenario_of

if TYPE_CHECKING:
    from collections.abc import Callable

G = 9.81
ON_GROUND = HEIGHT / 2
SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}
HOPPING = {"x": 1.0, "y": ON_GROUND + 2e-3, "velocity": [0.0, -0.3]}  # at most every 30 ms


def cut_steps(run: Simulation, count: int) -> int:
    """Go on for some steps; return how many of them were cut."""
    stepping = run.scene.contacts.stepping[0]
    return sum(int(run.to_step(run.steps + 1) is run and stepping.cuts > 0) for _ in range(count))


@pytest.mark.parametrize("start", [0.5e-4, 1.0e-4, 1.7e-4, 2.9e-4])
def test_impact_happens_at_its_time_to_a_64th_of_a_step(single: Callable[..., Simulation], start: float) -> None:
    run = single([{"y": ON_GROUND + start, "velocity": [0.0, -1.0]}], restitution=0.8, gravity=0.0, **SMOOTH)
    run.to_time(3e-3)
    assert run.bodies.y[0] == pytest.approx(ON_GROUND + 0.8 * (run.time - start), abs=run.step / 64.0)


@pytest.mark.usefixtures("compiler")
def test_blocks_that_stand_do_not_notice_that_steps_are_cut(single: Callable[..., Simulation]) -> None:
    standing = [{"y": ON_GROUND + k * HEIGHT} for k in range(4)]
    run = single([*standing, HOPPING], restitution=0.9).to_time(0.2)
    settled = run.bodies.y[:4].copy()
    assert cut_steps(run, 600) > 2
    assert np.abs(run.bodies.y[:4] - settled).max() < 1e-4 * (ON_GROUND - settled[0])  # of what it sags
    assert np.abs(run.state()[:4, 3:]).max() < 1e-6
    assert run.residual() < 1e-12


def test_flight_is_a_parabola_though_steps_are_cut(single: Callable[..., Simulation]) -> None:
    run = single([{"y": 1.0, "velocity": [1.0, 2.0], "spin": 3.0}, HOPPING], restitution=0.9)
    assert cut_steps(run, 200) > 2
    t = run.time
    exact = [t, 1.0 + 2.0 * t - 0.5 * G * t * t, 3.0 * t, 1.0, 2.0 - G * t, 3.0]
    assert run.state()[0] == pytest.approx(exact, abs=1e-9)


def test_block_rides_along_on_a_table_though_steps_are_cut(begin: Callable[..., Simulation]) -> None:
    motion = {"kind": "harmonic", "amplitude": 0.02, "frequency": 2.0, "ramp": 0.5, "direction": "0 deg"}
    tables: dict[str, Any] = {"friction": {"block_block": 0.3, "block_ground": 0.9}, "contact": {"restitution": 0.9}}
    scenario = scenario_of([{"y": ON_GROUND}, HOPPING], motion=motion, **tables)
    run = begin(scenario, velocity_tolerance=1e-9, stop_at_rest=False).to_time(0.2)
    assert cut_steps(run, 800) > 2
    assert abs(float(run.world.bodies.vx[-1])) > 0.01
    assert run.bodies.x[0] == pytest.approx(float(run.world.bodies.x[-1]), abs=1e-7)
    assert run.residual() < 1e-12


def test_velocity_of_a_block_that_rolls_does_not_depend_on_lengths_that_are_not_taken() -> None:
    found = []
    for lengths in ((0.3,), (0.7, 0.3), (0.1, 0.9, 0.3)):
        tilted = {"y": 0.5 * (np.sin(0.1) * WIDTH + np.cos(0.1) * HEIGHT), "angle": 0.1}
        run = CaseScene(
            [tilted], restitution=0.0, ground_friction=5.0, time={"scheme": "nonsmooth", "end": 1.0}
        ).start()
        run.to_step(30)
        assert isinstance(run.scene, Nonsmooth)
        for share in lengths:
            set_length(run.scene, share * run.step)
        state = run.scene.contacts.states[0]
        found.append((float(state.vx), float(state.vy), float(state.spin)))
    assert abs(found[0][2]) > 0.1
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    assert found[2] == pytest.approx(found[0], rel=1e-12)


def test_steps_of_crowds_and_of_weak_rebounds_of_more_than_two_are_not_cut(single: Callable[..., Simulation]) -> None:
    crowd = [{**HOPPING, "x": 0.1 * k} for k in range(13)]
    assert cut_steps(single(crowd, restitution=0.9), 40) == 0
    assert cut_steps(single(crowd[:3], restitution=0.5), 400) == 0
    assert cut_steps(single(crowd[:2], restitution=0.5), 400) > 0
    assert cut_steps(single(crowd[:1], restitution=0.9), 400) > 0
