"""Units: the table that spares pint, what pint adds, and what never reaches it."""

import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from blocksim.scenario import units
from blocksim.scenario.units import COMMON, UnitError, parse_unit, unit_by_pint


@pytest.mark.parametrize("text", COMMON)
def test_the_table_of_common_units_says_what_pint_says(text: str) -> None:
    assert parse_unit(text) == unit_by_pint(text)


def test_a_degree_is_exact_to_the_last_bit() -> None:
    assert float(180 * parse_unit("deg").factor) == math.pi
    assert float(90 * parse_unit("degree").factor) == math.pi / 2


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        ("in", Fraction(254, 10_000), units.LENGTH),
        ("µm", Fraction(1, 10**6), units.LENGTH),
        ("kN / m³", Fraction(1000), units.UNIT_WEIGHT),
        ("kN*m^-3", Fraction(1000), units.UNIT_WEIGHT),
        ("m/s**2", Fraction(1), units.ACCELERATION),
        ("m·kg/m", Fraction(1), units.MASS),
        ("kg m^2", Fraction(1), (2, 1, 0, 0)),
        ("t/m^3", Fraction(1000), units.DENSITY),
        ("g0", Fraction(980_665, 100_000), units.ACCELERATION),
    ],
)
def test_other_units_are_read_by_pint(text: str, factor: Fraction, dimension: units.Dimension) -> None:
    assert parse_unit(text) == units.Unit(factor, dimension)


@pytest.mark.parametrize("text", ["m**9**9", "m^999", "m;m", "m+m", "(m)", "m//s", "/s", "m" * 50, "2 m", "f(m)"])
def test_expressions_never_reach_pint(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(units, "unit_by_pint", lambda _: pytest.fail("pint was asked"))
    with pytest.raises(UnitError):
        parse_unit(text)


def test_an_unknown_unit_is_named() -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit("kg/furlong^3")
    assert caught.value.unknown == "furlong"


def test_a_scenario_in_common_units_is_loaded_without_pint() -> None:
    code = "import sys, blocksim.scenario as s; s.load_scenario(sys.argv[1]); assert 'pint' not in sys.modules"
    path = Path(__file__).parents[2] / "scenarios" / "three_blocks.toml"
    subprocess.run([sys.executable, "-c", code, path], check=True)


@pytest.mark.parametrize("text", ["nan", "NaN", "NAN", "nan*m", "m/nan", "inf", "Infinity", "nan^2"])
def test_words_that_pint_takes_for_numbers_are_unknown_units(text: str) -> None:
    with pytest.raises(units.UnitError):
        units.parse_unit(text)
