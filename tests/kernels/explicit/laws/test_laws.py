"""Every law: the force is the slope of the stored energy, the stiffness the slope of the force."""

from typing import Any, get_args

import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.explicit.laws import LAW_CODES, elastic_force, stored_energy, tangent_stiffness
from blocksim.scenario.models.contact import Contact

K = 9.5e8
DEPTHS = st.floats(1e-10, 1e-3)


def test_every_law_a_scenario_may_name_has_a_code() -> None:
    law: Any = Contact.model_fields["law"].annotation
    assert set(get_args(law)) == set(LAW_CODES)
    assert len(set(LAW_CODES.values())) == len(LAW_CODES)


@pytest.mark.parametrize("law", LAW_CODES)
@given(depth=DEPTHS)
def test_force_is_the_slope_of_the_stored_energy(law: str, depth: float) -> None:
    code, h = LAW_CODES[law], 1e-3 * depth
    slope = (stored_energy(code, K, depth + h) - stored_energy(code, K, depth - h)) / (2.0 * h)
    assert elastic_force(code, K, depth) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("law", LAW_CODES)
@given(depth=DEPTHS)
def test_stiffness_is_the_slope_of_the_force(law: str, depth: float) -> None:
    code, h = LAW_CODES[law], 1e-3 * depth
    slope = (elastic_force(code, K, depth + h) - elastic_force(code, K, depth - h)) / (2.0 * h)
    assert tangent_stiffness(code, K, depth) == pytest.approx(slope, rel=1e-6)


def test_linear_force_is_stiffness_times_overlap() -> None:
    assert elastic_force(LAW_CODES["linear"], 2e6, 3e-6) == pytest.approx(6.0)


@pytest.mark.parametrize("law", LAW_CODES)
def test_contact_without_overlap_holds_nothing(law: str) -> None:
    assert elastic_force(LAW_CODES[law], K, 0.0) == 0.0
    assert stored_energy(LAW_CODES[law], K, 0.0) == 0.0
