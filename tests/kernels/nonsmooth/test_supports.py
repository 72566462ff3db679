"""Supports that move: blocks ride along, slide or tip as on a table that is shaken, and the work adds up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.verification.scene import HEIGHT, Simulation, scenario_of

if TYPE_CHECKING:
    from collections.abc import Callable

G = 9.81
FREQUENCY = 2.0  # 1/s
RAMP = 0.5  # s
ON_GROUND = {"y": HEIGHT / 2}


def shaken(acceleration: float, *bodies: dict[str, Any], direction: str = "0 deg", **tables: Any) -> Any:
    """Return blocks on a table with this greatest acceleration (m/s2)."""
    amplitude = acceleration / (2.0 * np.pi * FREQUENCY) ** 2
    motion = {"kind": "harmonic", "amplitude": amplitude, "frequency": FREQUENCY, "ramp": RAMP, "direction": direction}
    more = {"friction": {"block_block": 0.31, "block_ground": 0.38}, "contact": {"restitution": 0.0}}
    return scenario_of(bodies or [ON_GROUND], motion=motion, **{**more, "time": {"stop_at_rest": False}, **tables})


def table(run: Simulation) -> float:
    """Return how far (m) the support has gone along x."""
    return float(run.world.bodies.x[-1])


@pytest.mark.parametrize("substeps", [1, 4])
def test_block_rides_along_below_the_friction_limit(begin: Callable[..., Simulation], substeps: int, pace: int) -> None:
    run = begin(shaken(0.9 * 0.38 * G), substeps=substeps, velocity_tolerance=1e-9).to_time(1.3 / pace)
    assert abs(table(run)) > (0.005 if pace == 1 else 1e-5)
    # drifts know the friction of the substep before: they lag by acceleration times substep squared, and add up to that
    assert run.bodies.x[0] == pytest.approx(table(run), abs=0.38 * G * (1e-3 / substeps) ** 2)
    assert run.bodies.vx[0] == pytest.approx(float(run.world.bodies.vx[-1]), abs=1e-6)
    assert run.residual() < 1e-12


def test_block_slides_above_it_by_friction_alone(begin: Callable[..., Simulation]) -> None:
    run = begin(shaken(4.0 * 0.38 * G), substeps=1, step=2e-4, velocity_tolerance=1e-9)
    rates = np.diff([float(run.to_step(k).bodies.vx[0]) for k in range(4000, 5000)]) / 2e-4
    assert np.abs(rates).max() == pytest.approx(0.38 * G, rel=1e-6)
    assert np.mean(np.abs(rates) > 0.379 * G) > 0.8
    assert run.residual() < 1e-12


def test_work_on_the_support_is_that_of_the_friction(begin: Callable[..., Simulation]) -> None:
    run = begin(shaken(4.0 * 0.38 * G), substeps=1, velocity_tolerance=1e-9).to_time(1.0)
    work, mass = 0.0, float(run.bodies.mass[0])
    before = float(run.ledger_row()[5])
    for _ in range(200):
        speed, place = float(run.bodies.vx[0]), table(run)
        run.to_step(run.steps + 1)
        work -= mass * (float(run.bodies.vx[0]) - speed) / run.step * (table(run) - place)
    assert run.ledger_row()[5] - before == pytest.approx(work, rel=1e-2)
    assert abs(work) > 1e-3


def test_table_that_drops_faster_than_gravity_loses_its_block(begin: Callable[..., Simulation], pace: int) -> None:
    run = begin(shaken(2.0 * G, direction="90 deg"), substeps=4)
    apart = [float(run.to_step(k).bodies.y[0] - HEIGHT / 2 - run.world.bodies.y[-1]) for k in range(0, 1000 // pace, 5)]
    assert min(apart) > -1e-4
    assert max(apart) > (0.01 if pace == 1 else 0.0) - 1e-5
    assert run.residual() < 1e-10


def test_fixed_blocks_move_with_the_ground_and_are_where_the_motion_says(begin: Callable[..., Simulation]) -> None:
    fixed = {"x": 0.2, "y": HEIGHT / 2, "fixed": True}
    rider = {"x": 0.2, "y": 1.5 * HEIGHT}
    run = begin(shaken(1.0, ON_GROUND, fixed, rider), velocity_tolerance=1e-9).to_time(0.8)
    assert run.bodies.x[1] - 0.2 == pytest.approx(table(run), abs=1e-15)
    assert run.bodies.x[2] - 0.2 == pytest.approx(table(run), abs=1e-6)


def test_run_is_not_over_while_the_table_waits(begin: Callable[..., Simulation]) -> None:
    motion = {"kind": "harmonic", "amplitude": 0.001, "frequency": 5.0, "start": 0.4, "duration": 0.6}
    scenario = scenario_of([ON_GROUND], motion=motion, time={"stop_at_rest": True, "end": 2.0})
    run = begin(scenario).to_time(2.0)
    assert 1.0 < run.time < 1.2


def test_table_faster_than_the_reach_of_the_list_keeps_its_contacts(begin: Callable[..., Simulation]) -> None:
    shove = shaken(0.3 * G, ON_GROUND, {"x": 0.1, "y": HEIGHT / 2})
    run = begin(shove, velocity_tolerance=1e-9)
    stepping = run.scene.contacts.stepping[0]
    stepping.least_reach, stepping.most_reach = 5e-5, 1.5e-4
    run.to_time(1.2)
    assert run.bodies.x == pytest.approx([table(run), 0.1 + table(run)], abs=1e-5)
