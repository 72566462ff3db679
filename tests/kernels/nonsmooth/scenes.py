"""Scenarios with rigid contacts, from those with springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blocksim.scenario.models.stepping import Nonsmooth

if TYPE_CHECKING:
    from blocksim.scenario import Scenario

STEP = 1e-3  # s, unless a test says otherwise
ENDLESS = 1e3  # s: tests step as far as they want


def rigid(scenario: Scenario, **stepping: Any) -> Scenario:
    """Return a scenario with rigid contacts; keywords are keys of [time]."""
    kept = {"stop_at_rest": scenario.time.stop_at_rest, "end": scenario.time.end}
    time = Nonsmooth(**{"scheme": "nonsmooth", "step": STEP, "force_step": True, **kept, **stepping})
    return scenario.model_copy(update={"time": time})
