"""Free flight (V1) and bounces (V3, Eq 12)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.analysis import closed_forms as forms

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Simulation, Start

DROP, E = 0.1, 0.5  # m, -
POLL = 5e-5  # s


def dropped(start: Start, block: PaperBlock, spacing: float) -> Simulation:
    return start([{"y": block.height / 2 + DROP}], restitution=E, contact={"particle_spacing": spacing})


def test_free_flight_is_a_parabola_with_constant_spin(start: Start) -> None:
    flight = start([{"y": 2.0, "velocity": [1.5, 2.5], "spin": 30.0, "angle": 0.4}], time={"step": 2e-7})
    flight.to_step(1_000_000)
    t, body = flight.time, flight.bodies[0]
    round_off = flight.steps * np.finfo(float).eps  # of numbers up to 10
    assert t == pytest.approx(0.2)
    assert body.x == pytest.approx(1.5 * t, abs=10 * round_off)
    assert body.y == pytest.approx(2.0 + 2.5 * t - forms.fall_distance(t), abs=10 * round_off)
    assert body.vx == 1.5
    assert body.vy == pytest.approx(2.5 - 9.81 * t, abs=10 * round_off)
    assert body.spin == 30.0
    assert body.angle == pytest.approx(0.4 + 30.0 * t, abs=10 * round_off)
    assert [body.cos, body.sin] == pytest.approx([np.cos(body.angle), np.sin(body.angle)], abs=1e-12)


def bounces(fall: Simulation, block: PaperBlock, count: int) -> tuple[list[float], list[float]]:
    """Return the impact times (s) and the apexes (m) after them."""
    times: list[float] = []
    apexes = [0.0]
    falling = True
    while len(times) <= count:
        fall.to_time(fall.time + POLL)
        body = fall.bodies[0]
        if falling and body.vy > 0.0:
            times.append(fall.time - POLL / 2)
            apexes.append(0.0)
        falling = body.vy < 0.0
        apexes[-1] = max(apexes[-1], float(body.y) - block.height / 2)
    return times, apexes[1:-1]


def test_bounces_rise_and_last_as_equation_12_says(start: Start, paper_block: PaperBlock) -> None:
    times, apexes = bounces(dropped(start, paper_block, 1e-3), paper_block, 3)
    assert times[0] == pytest.approx(forms.fall_time(DROP), rel=1e-3)
    for apex, impact, tolerance in zip(apexes, (1, 2, 3), (0.01, 0.02, 0.04), strict=True):
        assert apex == pytest.approx(forms.apex_height(DROP, E, impact), rel=tolerance)
    assert times[1] - times[0] == pytest.approx(0.1428, rel=0.01)
    assert times[1] - times[0] == pytest.approx(forms.flight_time(DROP, E, 1), rel=0.01)


def test_particle_spacing_changes_no_bit_of_a_bounce(start: Start, paper_block: PaperBlock) -> None:
    falls = [dropped(start, paper_block, spacing).to_time(0.15) for spacing in (5e-4, 1e-3, 2e-3, 4e-3)]
    assert len({fall.bodies.tobytes() for fall in falls}) == 1
    assert falls[0].bodies[0].vy > 0.0
