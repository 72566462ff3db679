"""Runs with soil keep their bits, however often they are interrupted and whatever of them is recorded."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Scenario
from blocksim.simulation import simulate, simulate_into
from tests.simulation.sliding import assert_same, interrupted_at
from tests.sizes import in_all
from tests.soils import DEPTH, LEFT, Soil, column, scene

BLOCKS = {"any": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}
CARRIED = [{"block": "any", "x": 0.07, "y": 0.02}, {"block": "any", "x": 0.02, "y": 0.121}]
PROBE = {"kind": "force", "on": "1", "by": "column", "every": "step"}


def collapse(end: float, every: float, *, material: str = "rods", contacts: bool = False, **keys: Any) -> Scenario:
    """Return a column that pushes one block aside and carries another one down."""
    table = column(0.05, 0.1, 0.005, material=material)
    output = {"every": every, "contacts": contacts}
    return scene(table, blocks=BLOCKS, bodies=CARRIED, walls=[LEFT], end=end, output=output, **keys)


@pytest.mark.long
@pytest.mark.parametrize("material", ["rods", "clay"])
def test_twenty_interruptions_of_a_run_with_soil_change_no_bit(tmp_path: Path, material: str) -> None:
    scenario = collapse(0.05, 0.001, material=material)
    whole = simulate_into(scenario, tmp_path / "whole")
    steps = np.random.default_rng(20).choice(np.arange(1, whole.summary.steps), in_all(20), replace=False)
    stopped = interrupted_at(scenario, tmp_path / "parts", sorted(steps.tolist()))
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert resumed.summary.resumed_from == tuple(stopped) == tuple(sorted(steps.tolist()))
    assert_same(resumed, whole)
    (soils,), (expected,) = resumed.frames.others, whole.frames.others
    for name in ("x", "y", "vx", "vy", "sxx", "syy", "szz", "sxy", "plastic"):
        np.testing.assert_array_equal(soils[name], expected[name])


@pytest.mark.parametrize(
    ("every", "contacts", "probes"),
    [(0.0005, False, []), (0.002, True, []), (0.01, False, [PROBE])],
    ids=["often", "contacts", "probed"],
)
def test_recording_stresses_contacts_and_forces_changes_no_bit(
    every: float, contacts: bool, probes: list[dict[str, object]]
) -> None:
    unrecorded = Soil(collapse(0.01, 0.01))
    last = simulate(collapse(0.01, every, contacts=contacts, probes=probes))
    unrecorded.to_step(last.summary.steps)
    (soils,) = last.frames.others
    assert np.abs(soils["sxx"]).max() > 100.0  # Pa
    order = np.argsort(unrecorded.soils.states["number"])
    for name, array in (("x", "points"), ("vy", "points"), ("sxx", "states"), ("sxy", "states"), ("plastic", "states")):
        now = getattr(unrecorded.soils, array)[name][order]
        assert np.array_equal(soils[name][-1], now.astype(soils[name].dtype)), name
    assert last.summary.final_state_sha256 == simulate(collapse(0.01, 0.01)).summary.final_state_sha256
