"""Ledger and limits of the non-smooth scheme."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import NOT_FINITE, OVERLAP_LIMIT
from blocksim.kernels.nonsmooth.energy import NONSMOOTH_LEDGER
from blocksim.verification.scene import HEIGHT, Simulation

if TYPE_CHECKING:
    from collections.abc import Callable

G = 9.81
ON_GROUND = HEIGHT / 2


def entries(run: Simulation) -> dict[str, float]:
    return dict(zip((*NONSMOOTH_LEDGER, "contacts", "overlap"), run.ledger_row().tolist(), strict=True))


def test_impact_takes_what_newton_says_and_friction_what_coulomb_says(single: Callable[..., Simulation]) -> None:
    fall = single([{"y": ON_GROUND + 0.05}], restitution=0.5, step=1e-4).to_time(0.15)
    drop = float(fall.bodies.mass[0]) * G * 0.05
    assert entries(fall)["impacts"] == pytest.approx(0.75 * drop, rel=2e-3)
    assert entries(fall)["friction"] < 1e-20
    slide = single([{"y": ON_GROUND, "velocity": [1.0, 0.0]}], restitution=0.0).to_time(0.5)
    assert entries(slide)["friction"] == pytest.approx(0.5 * float(slide.bodies.mass[0]), rel=1e-3)
    assert abs(entries(slide)["impacts"]) < 1e-4 * entries(slide)["friction"]


def test_flight_is_a_parabola_in_position_and_velocity(single: Callable[..., Simulation]) -> None:
    run = single([{"y": 2.0, "velocity": [1.5, 2.5], "spin": 30.0, "angle": 0.4}]).to_time(0.2)
    body = run.bodies[0]
    found = [body.x, body.y, body.vx, body.vy, body.angle, body.spin]
    expected = [0.3, 2.5 - 0.5 * G * 0.04, 1.5, 2.5 - G * 0.2, 6.4, 30.0]
    assert found == pytest.approx(expected, abs=1e-12)
    assert run.residual() < 1e-13


@pytest.mark.usefixtures("compiler")
def test_correction_is_small_and_goes_with_the_step(single: Callable[..., Simulation]) -> None:
    def worst(step: float) -> float:
        blocks = [{"y": (i + 0.5) * HEIGHT + 0.01, "x": 0.002 * i} for i in range(4)]
        run = single(blocks, restitution=0.0, step=step)
        return max(abs(entries(run.to_time(0.02 * k))["correction"]) for k in range(1, 10))

    coarse, fine = worst(1e-3), worst(2.5e-4)
    assert coarse < 0.05 * 4.0 * 0.11 * G * 0.01
    assert fine < 0.5 * coarse


@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.9])
def test_ledger_of_a_crowd_adds_up_to_round_off(begin: Callable[..., Simulation], restitution: float) -> None:
    wall = pushed_wall(8, 6, contact={"restitution": restitution})
    assert begin(wall, velocity_tolerance=0.03).to_step(300).residual() < 1e-11


def test_ledger_holds_on_a_slope(single: Callable[..., Simulation]) -> None:
    run = single([{"y": ON_GROUND + 0.01, "angle": 0.2}], tilt=radians(35.0)).to_time(0.5)
    assert run.residual() < 1e-12


def test_resting_block_shows_its_contacts_and_its_sag(single: Callable[..., Simulation]) -> None:
    run = single([{"y": ON_GROUND}], restitution=0.0).to_time(0.5)
    assert entries(run)["contacts"] == 2
    assert entries(run)["overlap"] == pytest.approx(1.42e-6, rel=0.01)
    assert entries(run)["kinetic"] < 1e-20


def test_overlap_beyond_the_limit_stops_the_run(single: Callable[..., Simulation]) -> None:
    values: Any = {"restitution": 0.0, "contact": {"max_overlap": 1e-6}}
    assert single([{"y": ON_GROUND}], **values).to_time(0.5).status == OVERLAP_LIMIT
    values["contact"] = {"max_overlap": 2e-6}
    assert single([{"y": ON_GROUND}], **values).to_time(0.5).status == 0


@pytest.mark.parametrize("name", ["y", "vy", "spin"])
def test_state_that_is_not_finite_stops_the_run(single: Callable[..., Simulation], name: str) -> None:
    run = single([{"y": 0.1}]).to_step(3)
    run.world.bodies[name][0] = np.nan
    run.scene.contacts.states.vy[0] = np.nan
    assert run.to_step(10).status == NOT_FINITE
