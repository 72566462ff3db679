"""The linear law in numbers."""

import pytest

from blocksim.kernels.laws import linear


def test_force_is_stiffness_times_overlap() -> None:
    assert linear.elastic_force(2e6, 3e-6) == pytest.approx(6.0)
    assert linear.tangent_stiffness(2e6, 3e-6) == 2e6


def test_energy_is_half_force_times_overlap() -> None:
    assert linear.stored_energy(2e6, 3e-6) == pytest.approx(9e-6)
