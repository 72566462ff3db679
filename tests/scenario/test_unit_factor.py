"""Units of measured values."""

import pytest

from blocksim.scenario.units import unit_factor


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("mm", "mm", 1.0),
        ("µm", "mm", 1e-3),
        ("inch", "mm", 25.4),
        ("°", "deg", 1.0),
        ("turn", "deg", 360.0),
        ("kN/m^3", "N/m^3", 1e3),
        ("N*mm^-3", "N/m^3", 1e9),
        ("GPa", "Pa", 1e9),
        ("1", "1", 1.0),
    ],
)
def test_a_unit_of_the_right_kind_gives_its_factor(unit: str, target: str, factor: float) -> None:
    assert unit_factor(unit, target) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "target"),
    [
        ("deg", "mm"),
        ("mm", "deg"),
        ("1", "deg"),
        ("%", "deg"),
        ("rad", "1"),
        ("degC", "mm"),
        ("mm/mm", "mm"),
        ("mm^0", "mm"),
        ("mm^0*m", "mm"),
        ("2*mm", "mm"),
        ("", "mm"),
        ("__import__", "mm"),
        ("m" * 1000, "mm"),
    ],
)
def test_anything_else_is_no_unit(unit: str, target: str) -> None:
    assert unit_factor(unit, target) is None
