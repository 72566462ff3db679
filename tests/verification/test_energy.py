"""The energy ledger gets better with a smaller step, and tallies losses only (V15 and V23 are cases)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.conftest import Start


def residual_of_an_impact(start: Start, safety: float) -> float:
    """Return the mean residual over some phases of the first step of a corner impact that sticks."""
    total = 0.0
    for phase in range(8):
        run = start(
            [{"y": 0.0194 + 1e-7 * phase, "angle": 0.6, "velocity": [0.3, -1.0]}],
            restitution=0.3,
            time={"safety": safety},
        )
        run.to_time(5e-4)
        assert run.contacts == 0
        total += run.residual()
    return total / 8


def test_ledger_of_an_impact_balances_better_with_half_the_step(start: Start) -> None:
    residuals = [residual_of_an_impact(start, safety) for safety in (0.1, 0.05, 0.025)]
    assert residuals[1] < 1e-3
    assert residuals[1] < 0.5 * residuals[0]
    assert residuals[2] < 0.5 * residuals[1]


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_losses_are_tallied_never_gained(start: Start, restitution: float) -> None:
    run = start([{"y": 0.03, "angle": 0.6, "velocity": [0.3, -1.0]}], restitution=restitution, ground_friction=0.2)
    before = run.world.ledger[0].copy()
    for _ in range(50):
        run.to_time(run.time + 5e-4)
        ledger = run.world.ledger[0]
        assert ledger.friction >= before.friction
        assert ledger.broken >= before.broken
        assert ledger.dashpot >= before.dashpot - 1e-6 * run.start_energy
        before = ledger.copy()
    has_dashpot = bool(before.dashpot > 1e-12 * run.start_energy)
    assert has_dashpot is (restitution < 1.0)
