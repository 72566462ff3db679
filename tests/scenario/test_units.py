"""Units: the exact value and the dimension of an expression, and what is none."""

import math
from fractions import Fraction

import pytest

from blocksim.scenario import units as q
from blocksim.scenario.units import Dimension, Unit, UnitError, parse_unit, unit_factor


def test_a_degree_is_exact_to_the_last_bit() -> None:
    assert float(180 * parse_unit("deg").factor) == math.pi
    assert float(90 * parse_unit("degree").factor) == math.pi / 2


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        ("cm", Fraction(1, 100), q.LENGTH.dimension),
        ("kilometers", Fraction(1000), q.LENGTH.dimension),
        ("min", Fraction(60), q.TIME.dimension),
        ("lb", Fraction(45_359_237, 10**8), q.MASS.dimension),
        ("Mg/m^3", Fraction(1000), q.DENSITY.dimension),
        ("kg/m s^2", Fraction(1), (-1, 1, 2, 0)),
        ("in", Fraction(254, 10_000), q.LENGTH.dimension),
        ("µm", Fraction(1, 10**6), q.LENGTH.dimension),
        ("kN / m³", Fraction(1000), q.UNIT_WEIGHT.dimension),
        ("kN*m^-3", Fraction(1000), q.UNIT_WEIGHT.dimension),
        ("m/s**2", Fraction(1), q.ACCELERATION.dimension),
        ("m·kg/m", Fraction(1), q.MASS.dimension),
        ("kg m^2", Fraction(1), (2, 1, 0, 0)),
        ("t/m^3", Fraction(1000), q.DENSITY.dimension),
        ("g0", Fraction(980_665, 100_000), q.ACCELERATION.dimension),
    ],
)
def test_a_unit_has_its_exact_value_and_its_dimension(text: str, factor: Fraction, dimension: Dimension) -> None:
    assert parse_unit(text) == Unit(factor, dimension)


@pytest.mark.parametrize(
    "text", ["m**9**9", "m^999", "m;m", "m+m", "(m)", "m//s", "/s", " m", "m ", "m  s", "m" * 50, "2 m", "f(m)", ""]
)
def test_what_is_no_product_of_units_has_no_unknown_name(text: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(text)
    assert not str(caught.value)


def test_an_unknown_unit_is_named() -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit("kg/furlong^3")
    assert str(caught.value) == "furlong"


@pytest.mark.parametrize("text", ["nan", "NaN", "nan*m", "m/nan", "inf", "Infinity", "nan^2", "kms", "MM", "m2"])
def test_words_and_numbers_are_unknown_units(text: str) -> None:
    with pytest.raises(UnitError):
        parse_unit(text)


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [("µm", "mm", 1e-3), ("inch", "mm", 25.4), ("°", "deg", 1.0), ("turn", "deg", 360.0), ("1", "1", 1.0)],
)
def test_a_unit_of_the_right_kind_gives_its_factor(unit: str, target: str, factor: float) -> None:
    assert unit_factor(unit, target) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize("unit", ["deg", "1", "rad", "degC", "mm/mm", "mm^0*m", "2*mm", "", "m" * 1000])
def test_a_unit_of_another_kind_and_what_is_none_have_no_factor(unit: str) -> None:
    assert unit_factor(unit, "mm") is None
    assert unit_factor("mm", "deg") is unit_factor("rad", "1") is None
