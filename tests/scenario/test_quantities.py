"""Quantities: numbers and texts to SI floats, exactly."""

import math
import re
from typing import Any

import pytest
from hypothesis import given, strategies as st
from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from blocksim.scenario import units as q
from blocksim.scenario.units import LENGTH, STIFFNESS, TIME, UNIT_WEIGHT, Kind, Quantity, parse_quantity, toml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("35 mm", 0.035),
        ("35mm", 0.035),
        (" 35  mm ", 0.035),
        ("+3.5e1 mm", 0.035),
        (".5 m", 0.5),
        ("5. m", 5.0),
        ("1_000 mm", 1.0),
        ("-10 cm", -0.1),
        ("1e-999999999 m", 0.0),
        ("1e999999999 m", math.inf),
        ("-1e308 km", -math.inf),
    ],
)
def test_a_text_becomes_the_nearest_float(text: str, value: float) -> None:
    assert parse_quantity(text, LENGTH)[0] == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float_written_with_its_si_unit_comes_back_bit_equal(value: float) -> None:
    assert parse_quantity(f"{value!r} m", LENGTH)[0].hex() == value.hex()


@given(st.integers(1, 10**6))
def test_millimetres_are_divided_not_multiplied_by_a_rounded_factor(number: int) -> None:
    assert parse_quantity(f"{number} mm", LENGTH)[0] == number / 1000


@pytest.mark.parametrize(
    ("annotation", "text", "value"),
    [
        (q.Angle, "90 deg", math.pi / 2),
        (q.Speed, "5 mm/s", 0.005),
        (q.Spin, "180 deg/s", math.pi),
        (q.Spin, "60 rpm", 2 * math.pi),
        (q.Pressure, "69 GPa", 69e9),
        (q.Density, "2.7 g/cm^3", 2700.0),
        (q.UnitWeight, "26.7 kN/m^3", 26700.0),
        (q.Time, "1 ms", 0.001),
        (q.Stiffness, "1 N/mm", 1000.0),
        (q.NonNegativeAcceleration, "9.81 m/s²", 9.81),
        (q.Friction, "45 deg", math.tan(math.pi / 4)),
    ],
)
def test_every_kind_reads_its_unit(annotation: Any, text: str, value: float) -> None:
    assert TypeAdapter(annotation).validate_python(text) == value


@pytest.mark.parametrize("value", [1, -0.5, "1", True, None, math.nan, math.inf, "3 m", "1 /s", 10**400])
def test_what_is_no_angle(value: object) -> None:
    with pytest.raises(ValidationError):
        TypeAdapter(q.Angle).validate_python(value)


@pytest.mark.parametrize(
    ("annotation", "inside", "outside"),
    [
        (q.PositiveLength, "1 nm", 0),
        (q.NonNegativeTime, 0, "-1 ns"),
        (q.Share, 1, 1.0000001),
        (q.Safety, 0.1, 0.2),
        (q.PoissonRatio, -0.999, -1),
        (q.TiltAngle, "89.9 deg", "-90 deg"),
        (q.Friction, "89 deg", "-1 deg"),
    ],
)
def test_bounds(annotation: Any, inside: object, outside: object) -> None:
    adapter = TypeAdapter(annotation)
    adapter.validate_python(inside)
    with pytest.raises(ValidationError):
        adapter.validate_python(outside)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        ("a\tb", '"a\\tb"'),
        ('say "no"', '"say \\"no\\""'),
        ("\x1b[31m", '"\\x1b[31m"'),
        ([1], "a list"),
        ({"a": 1}, "a table"),
        (10**60, "a huge whole number"),
        ("x" * 50, '"' + "x" * 40 + '…"'),
    ],
)
def test_values_are_shown_as_in_toml_and_short(value: object, text: str) -> None:
    assert toml(value) == text


@pytest.mark.parametrize("kind", [LENGTH, TIME, UNIT_WEIGHT, STIFFNESS])
@pytest.mark.parametrize(
    ("value", "told"),
    [
        (1e-19, "small to compute with; at least 1e-18"),
        (5e-324, "small to compute with; at least 1e-18"),
        (1e31, "large to compute with; at most 1e.30"),
        (1e308, "large to compute with; at most 1e.30"),
    ],
)
def test_numbers_whose_products_no_double_holds_are_refused(kind: Kind, value: float, told: str) -> None:
    quantity = Quantity(kind, above=0.0)
    assert quantity.read(1.1e-18) == 1.1e-18
    assert quantity.read(0.9e30) == 0.9e30
    with pytest.raises(PydanticCustomError, match=rf"is too {told} \(SI\) is allowed"):
        quantity.read(value)


def test_places_may_be_round_off() -> None:
    for value in (0.0, -0.0, 5e-324, -1e-300, 0.1 * 3 - 0.3):
        assert Quantity(LENGTH).read(value) == value
        assert Quantity(LENGTH, at_least=0.0).read(abs(value)) == abs(value)
    with pytest.raises(PydanticCustomError, match="is too large to compute with"):
        Quantity(LENGTH).read(-1e31)


@pytest.mark.parametrize(("text", "wanted"), [("0,5 s", '"0.5 s"'), ("-1,25mm", '"-1.25mm"')])
def test_a_decimal_comma_is_answered_with_the_decimal_point(text: str, wanted: str) -> None:
    with pytest.raises(ValueError, match="write a decimal point: " + re.escape(wanted)):
        parse_quantity(text)
