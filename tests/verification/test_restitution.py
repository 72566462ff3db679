"""Measured restitution of flat (two points) and corner (one point) impacts is the asked one (V4)."""

from __future__ import annotations

from math import atan2, hypot
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Simulation, Start

SPEEDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # m/s
ASKED = tuple(tenth / 10 for tenth in range(11))
GOLDEN = 0.6180339887498949
PHASES = tuple((GOLDEN * k) % 1.0 for k in range(1, 14))  # of a step, at which the contact begins


def thrown(
    start: Start, block: PaperBlock, landing: str, *, e: float, speed: float, phase: float, spacing: float = 1e-3
) -> Simulation:
    """Throw a block at the ground, without gravity and friction; return it after the impact."""
    corner = landing == "corner"
    height = hypot(block.width, block.height) / 2 if corner else block.height / 2
    flight = start(
        [{"y": 1.0, "velocity": [0.0, -speed], "angle": atan2(block.width, block.height) if corner else 0.0}],
        restitution=e,
        ground_friction=0.0,
        gravity=0.0,
        contact={"particle_spacing": spacing},
        change=lambda world: world.bodies.__setattr__(
            "y", [height + speed * world.controls[0].step * (2.0 + phase), 0.0]
        ),
    )
    flight.to_step(3000)
    assert flight.contacts == 0
    return flight


@pytest.mark.parametrize("e", ASKED)
@pytest.mark.parametrize("landing", ["flat", "corner"])
def test_asked_restitution_is_measured_at_any_speed_and_phase(
    start: Start, paper_block: PaperBlock, landing: str, e: float
) -> None:
    for number, speed in enumerate(SPEEDS):
        phase = PHASES[(number + round(10 * e)) % len(PHASES)]
        flight = thrown(start, paper_block, landing, e=e, speed=speed, phase=phase)
        assert flight.bodies[0].vy / speed == pytest.approx(e, abs=0.01), f"at {speed} m/s"
        assert abs(flight.bodies[0].spin) * paper_block.width < 1e-9 * speed


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("landing", ["flat", "corner"])
def test_where_in_a_step_a_contact_begins_does_not_matter(
    start: Start, paper_block: PaperBlock, landing: str, e: float
) -> None:
    for phase in PHASES:
        flight = thrown(start, paper_block, landing, e=e, speed=1.0, phase=phase)
        assert flight.bodies[0].vy == pytest.approx(e, abs=0.01), f"at phase {phase}"


def test_no_restitution_asked_rebounds_with_at_most_one_percent(start: Start, paper_block: PaperBlock) -> None:
    for landing in ("flat", "corner"):
        assert 0.0 <= thrown(start, paper_block, landing, e=0.0, speed=1.0, phase=0.5).bodies[0].vy <= 0.01


@pytest.mark.parametrize("landing", ["flat", "corner"])
def test_particle_spacing_changes_no_bit_of_an_impact(start: Start, paper_block: PaperBlock, landing: str) -> None:
    states = {
        thrown(start, paper_block, landing, e=0.3, speed=1.0, phase=0.3, spacing=spacing).bodies.tobytes()
        for spacing in (5e-4, 1e-3, 2e-3, 4e-3)
    }
    assert len(states) == 1
