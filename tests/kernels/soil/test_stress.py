"""The path of one particle (case S8): what fails, where, and what a turn does."""

from typing import Any

import pytest

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.soil.arrays import STATE
from blocksim.kernels.soil.stress import invariants, strain
from blocksim.scenario.models.soil import SoilTable
from blocksim.world.systems.soil_arrays import kind_records
from tests.soils import column, scene

STEP = 1e-5  # s


def kind_of(material: str = "rods") -> Any:
    scenario = scene(column(0.04, 0.04, 0.005, material=material))
    tables = [table for table in scenario.systems["soils"] if isinstance(table, SoilTable)]
    return kind_records(scenario, tables)[0]


def state_under(pressure: float) -> Any:
    state = zeros(1, STATE)[0]
    state.sxx = state.syy = state.szz = -pressure
    return state


def deviator_of(state: Any) -> tuple[float, float]:
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    return total, deviator


def test_soil_without_cohesion_takes_no_tension_and_clay_only_up_to_the_apex() -> None:
    for material in ("rods", "clay"):
        kind, state = kind_of(material), state_under(0.0)
        for _ in range(2000):
            strain(state, kind, 1.0, 0.0, 0.0, 1.0, STEP)
        total, deviator = deviator_of(state)
        assert total == pytest.approx(kind.cohesion / kind.slope, abs=1e-9)
        assert deviator == pytest.approx(0.0, abs=1e-9)


def test_opened_soil_closes_with_little_pressure_and_is_as_dense_as_before() -> None:
    kind, state = kind_of(), state_under(0.0)
    for rate in (1.0, -1.0):
        for _ in range(200):
            lost = strain(state, kind, rate, 0.0, 0.0, rate, STEP)
            assert lost >= 0.0
    closed, _ = deviator_of(state)
    assert 0.0 < -closed / 3.0 < 0.05 * kind.bulk * 0.004  # a strain of 0.004 away and back
    assert state.opening < 0.05 * 0.004
    for _ in range(50):
        strain(state, kind, -1.0, 0.0, 0.0, -1.0, STEP)
    assert state.opening == 0.0
    before, _ = deviator_of(state)
    strain(state, kind, -1.0, 0.0, 0.0, -1.0, STEP)
    after, _ = deviator_of(state)
    assert (before - after) / 3.0 == pytest.approx(kind.bulk * 2.0 * STEP, rel=1e-6)  # stiff again
