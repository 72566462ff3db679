"""The path of one particle (case S8): what fails, where, and what a turn does."""

import math
from typing import Any

import pytest

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.soil.arrays import STATE
from blocksim.kernels.soil.stress import invariants, strain
from blocksim.scenario.models.soil import SoilTable
from blocksim.world.systems.soil_arrays import kind_records
from tests.soils import column, scene

STEP = 1e-5  # s
PRESSURE = 1e3  # Pa


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


def strained(kept: dict[str, float], kind: Any, sideways: float, upright: float) -> Any:
    """Return a particle that was in a state after a step of strain rates (1/s) along both axes."""
    state = zeros(1, STATE)[0]
    for name, value in kept.items():
        state[name] = value
    strain(state, kind, sideways, 0.0, 0.0, upright, STEP)
    return state


def test_compression_beside_a_constant_pressure_fails_as_mohr_and_coulomb_say() -> None:
    kind, state = kind_of(), state_under(PRESSURE)
    names = ("sxx", "syy", "szz", "sxy", "plastic")
    sideways = 0.0
    for _ in range(3000):
        kept = {name: float(state[name]) for name in names}
        for _ in range(2):  # the stress sideways is all but linear in the strain of one step
            one, other = (strained(kept, kind, rate, -1.0).sxx for rate in (sideways, sideways + 0.01))
            sideways -= 0.01 * (one + PRESSURE) / (other - one)
        state = strained(kept, kind, sideways, -1.0)
    sine = math.sin(math.radians(21.9))
    assert state.sxx == pytest.approx(-PRESSURE, rel=1e-6)
    assert state.sxx / state.syy == pytest.approx((1.0 - sine) / (1.0 + sine), rel=1e-4)
    assert state.szz == pytest.approx(0.5 * (state.sxx + state.syy), rel=1e-3)  # what the derivation rests on


@pytest.mark.parametrize("material", ["rods", "clay"])
def test_shear_ends_on_the_yield_surface(material: str) -> None:
    kind, state = kind_of(material), state_under(PRESSURE)
    lost = sum(strain(state, kind, 0.0, 1.0, 0.0, 0.0, STEP) for _ in range(3000))
    total, deviator = deviator_of(state)
    assert deviator == pytest.approx(kind.cohesion - kind.slope * total, rel=1e-4)
    assert total == pytest.approx(-3.0 * PRESSURE, rel=1e-9)  # no dilation
    assert state.plastic == pytest.approx(3000 * STEP, rel=0.1)
    assert lost == pytest.approx(kind.volume * deviator * state.plastic, rel=0.05)


def test_a_rigid_turn_turns_the_stress_and_nothing_else() -> None:
    kind, state = kind_of("clay"), state_under(0.0)
    state.sxx, state.sxy, state.szz = -600.0, 100.0, -200.0
    before = deviator_of(state)
    steps = round(0.5 * math.pi / (100.0 * STEP))
    spin = 0.5 * math.pi / (steps * STEP)
    lost = sum(strain(state, kind, 0.0, -spin, spin, 0.0, STEP) for _ in range(steps))
    assert deviator_of(state) == pytest.approx(before, rel=1e-9)
    assert [state.sxx, state.syy, state.sxy] == pytest.approx([0.0, -600.0, -100.0], abs=0.005 * 600.0)
    assert lost == 0.0


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


def test_an_elastic_step_loses_nothing_and_stores_its_work() -> None:
    kind, state = kind_of("clay"), state_under(PRESSURE)
    assert strain(state, kind, -1.0, 0.3, 0.1, -0.5, STEP) == 0.0
    assert state.plastic == 0.0
