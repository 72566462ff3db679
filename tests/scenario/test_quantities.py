"""Units and quantities: numbers and texts to SI floats, exactly; what is said of others is in golden/quantities.txt."""

import math
import re
import tomllib
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st
from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from blocksim.scenario import units as q
from blocksim.scenario.units import (
    LENGTH,
    STIFFNESS,
    TIME,
    UNIT_WEIGHT,
    Kind,
    Quantity,
    Unit,
    UnitError,
    parse_quantity,
    parse_unit,
    toml,
    unit_factor,
)
from tests.golden import Golden

UNITS = "cm|kilometers|min|lb|Mg/m^3|kg/m s^2|in|µm|kN / m³|kN*m^-3|m/s**2|m·kg/m|kg m^2|t/m^3|g0"
NO_PRODUCTS = "m**9**9|m^999|m;m|m+m|(m)|m//s|/s| m|m |m  s|2 m|f(m)||" + "m" * 50
UNKNOWN = "kg/furlong^3|nan|NaN|nan*m|m/nan|inf|Infinity|nan^2|kms|MM|m2"
FACTORS = "µm mm|inch mm|° deg|turn deg|1 1|deg mm|1 mm|rad mm|degC mm|mm/mm mm|mm^0*m mm|2*mm mm| mm|mm deg|rad 1"


def test_a_degree_is_exact_to_the_last_bit() -> None:
    assert float(180 * parse_unit("deg").factor) == math.pi
    assert float(90 * parse_unit("degree").factor) == math.pi / 2


def test_a_unit_has_its_exact_value_and_its_dimension(golden: Golden) -> None:
    def told(text: str) -> str:
        try:
            found = parse_unit(text)
        except UnitError as error:
            return f"no unit {error}"
        return f"{found.factor} {found.dimension}"

    golden("\n".join(f"{text!r}: {told(text)}" for text in f"{UNITS}|{NO_PRODUCTS}|{UNKNOWN}".split("|")), "values")
    factors = [(text, *text.rsplit(" ", 1)) for text in FACTORS.split("|")]
    golden("\n".join(f"{text}: {unit_factor(unit, target)!r}" for text, unit, target in factors), "factors")
    assert unit_factor("m" * 1000, "mm") is None
    assert parse_unit("kg/m s^2") == Unit(Fraction(1), (-1, 1, 2, 0))


TEXTS = "35 mm|35mm| 35  mm |+3.5e1 mm|.5 m|5. m|1_000 mm|-10 cm|1e-999999999 m|1e999999999 m|-1e308 km|0,5 s|-1,25mm"


def test_a_text_becomes_the_nearest_float_and_a_decimal_comma_is_answered(
    golden: Golden,
) -> None:
    def told(text: str) -> str:
        try:
            return repr(parse_quantity(text, LENGTH)[0])
        except ValueError as error:
            return str(error)

    golden("\n".join(f"{text!r}: {told(text)}" for text in TEXTS.split("|")))


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 10**6))
def test_floats_come_back_bit_equal_and_millimetres_are_divided_by_no_rounded_factor(value: float, number: int) -> None:
    assert parse_quantity(f"{value!r} m", LENGTH)[0].hex() == value.hex()
    assert parse_quantity(f"{number} mm", LENGTH)[0] == number / 1000


KINDS = """Angle 90 deg|Angle 1|Angle -0.5|Angle "1"|Angle true|Angle nan|Angle inf|Angle 3 m|Angle 1 /s|Speed 5 mm/s
Spin 180 deg/s|Spin 60 rpm|Pressure 69 GPa|Density 2.7 g/cm^3|UnitWeight 26.7 kN/m^3|Time 1 ms
Stiffness 1 N/mm|NonNegativeAcceleration 9.81 m/s²|Friction 45 deg|Friction 89 deg|Friction -1 deg
PositiveLength 1 nm|PositiveLength 0|NonNegativeTime 0|NonNegativeTime -1 ns|Share 1|Share 1.0000001
Safety 0.1|Safety 0.2|PoissonRatio -0.999|PoissonRatio -1|TiltAngle 89.9 deg|TiltAngle -90 deg"""


def test_every_kind_reads_its_unit_and_has_its_bounds(golden: Golden) -> None:
    """What is no number, and true, is a text or a value as in TOML."""

    def told(kind: str, text: str) -> str:
        value = tomllib.loads(f"v = {text}")["v"] if re.fullmatch(r'true|nan|inf|[-.\d]+|".*"', text) else text
        try:
            return repr(TypeAdapter(getattr(q, kind)).validate_python(value))
        except ValidationError as error:
            return error.errors()[0]["msg"]

    kinds = [line.split(" ", 1) for line in re.split(r"[|\n]", KINDS)]
    golden("\n".join(f"{kind} {text}: {told(kind, text)}" for kind, text in kinds), rules=["digits"])


def test_values_are_shown_as_in_toml_and_short(golden: Golden) -> None:
    shown = (True, "a\tb", 'say "no"', "\x1b[31m", [1], {"a": 1}, 10**60, "x" * 50)
    golden("\n".join(map(toml, shown)))


@pytest.mark.parametrize("kind", [LENGTH, TIME, UNIT_WEIGHT, STIFFNESS])
def test_numbers_whose_products_no_double_holds_are_refused_and_places_may_be_round_off(kind: Kind) -> None:
    small, large = "small to compute with; at least 1e-18", "large to compute with; at most 1e.30"
    quantity = Quantity(kind, above=0.0)
    assert (quantity.read(1.1e-18), quantity.read(0.9e30)) == (1.1e-18, 0.9e30)
    for value, told in ((1e-19, small), (5e-324, small), (1e31, large), (1e308, large)):
        with pytest.raises(PydanticCustomError, match=rf"is too {told} \(SI\) is allowed"):
            quantity.read(value)
    for value in (0.0, -0.0, 5e-324, -1e-300, 0.1 * 3 - 0.3):
        assert Quantity(kind).read(value) == value
        assert Quantity(kind, at_least=0.0).read(abs(value)) == abs(value)
    with pytest.raises(PydanticCustomError, match="is too large to compute with"):
        Quantity(kind).read(-1e31)
