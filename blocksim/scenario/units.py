"""Unit expressions such as "kN/m^3": their value in SI, and their dimension.

pint decides, from a small registry of the units that scenarios use. Importing pint costs a third of a second,
so common expressions are also listed here with their values (a test compares them with
pint).
Factors are exact fractions: "35 mm" is the float nearest to 0.035, not 35 times a rounded 0.001.
"""

import functools
import math
import re
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from blocksim.scenario.spelling import nearest, slips

if TYPE_CHECKING:
    import pint

Dimension = tuple[int, int, int, int]
"""Exponents of length, mass, time and angle; an angle counts, so that "1/s" is not a spin and "3" not an angle."""

NUMBER: Dimension = (0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0)
TIME: Dimension = (0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 1)
AREA: Dimension = (2, 0, 0, 0)
SPEED: Dimension = (1, 0, -1, 0)
FREQUENCY: Dimension = (0, 0, -1, 0)
SPIN: Dimension = (0, 0, -1, 1)
ACCELERATION: Dimension = (1, 0, -2, 0)
FORCE: Dimension = (1, 1, -2, 0)
MOMENT: Dimension = (2, 1, -2, 0)
PRESSURE: Dimension = (-1, 1, -2, 0)
DENSITY: Dimension = (-3, 1, 0, 0)
UNIT_WEIGHT: Dimension = (-2, 1, -2, 0)
STIFFNESS: Dimension = (0, 1, -2, 0)

NAMES: dict[Dimension, str] = {
    NUMBER: "a plain number",
    LENGTH: "a length",
    MASS: "a mass",
    TIME: "a time",
    ANGLE: "an angle",
    AREA: "an area",
    SPEED: "a speed",
    FREQUENCY: "a frequency",
    SPIN: "a spin",
    ACCELERATION: "an acceleration",
    FORCE: "a force",
    MOMENT: "a moment",
    PRESSURE: "a pressure",
    DENSITY: "a density",
    UNIT_WEIGHT: "a unit weight",
    STIFFNESS: "a stiffness",
}

DEGREE = Fraction(math.pi) / 180
"""One degree in radians; built on the float pi, so that "180 deg" is `math.pi` to the last bit."""

DEFINITIONS = f"""
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
tera- = 1e12 = T-
meter = [length] = m = metre
kilogram = [mass] = kg
second = [time] = s = sec
radian = [angle] = rad
gram = 1e-3 * kilogram = g
tonne = 1e3 * kilogram = t
minute = 60 * second = min
hour = 3600 * second = h
degree = {Decimal(math.pi)} / 180 * radian = deg = °
turn = {Decimal(math.pi)} * 2 * radian = turn
rpm = turn / minute = rpm
hertz = 1 / second = Hz
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal = bar
inch = 0.0254 * meter = in
foot = 0.3048 * meter = ft
pound = 0.45359237 * kilogram = lb
standard_gravity = 9.80665 * meter / second ** 2 = g0
"""
"""The units that pint knows here; a small registry loads in 10 ms, not 300, and keeps radians apart."""

USUAL_GRAVITY = 9.81
"""m/s²; the default of scenarios; turns a unit weight into a density, as in the paper, whatever gravity there is."""
STANDARD_GRAVITY = 9.80665
"""m/s²; the g of accelerograms, and g0 above."""

COMMON: dict[str, tuple[Fraction, Dimension]] = {
    "m": (Fraction(1), LENGTH),
    "cm": (Fraction(1, 100), LENGTH),
    "mm": (Fraction(1, 1000), LENGTH),
    "um": (Fraction(1, 10**6), LENGTH),
    "km": (Fraction(1000), LENGTH),
    "s": (Fraction(1), TIME),
    "ms": (Fraction(1, 1000), TIME),
    "us": (Fraction(1, 10**6), TIME),
    "min": (Fraction(60), TIME),
    "rad": (Fraction(1), ANGLE),
    "deg": (DEGREE, ANGLE),
    "Hz": (Fraction(1), FREQUENCY),
    "m/s": (Fraction(1), SPEED),
    "mm/s": (Fraction(1, 1000), SPEED),
    "rad/s": (Fraction(1), SPIN),
    "deg/s": (DEGREE, SPIN),
    "m/s^2": (Fraction(1), ACCELERATION),
    "Pa": (Fraction(1), PRESSURE),
    "kPa": (Fraction(1000), PRESSURE),
    "MPa": (Fraction(10**6), PRESSURE),
    "GPa": (Fraction(10**9), PRESSURE),
    "kg/m^3": (Fraction(1), DENSITY),
    "g/cm^3": (Fraction(1000), DENSITY),
    "N/m^3": (Fraction(1), UNIT_WEIGHT),
    "kN/m^3": (Fraction(1000), UNIT_WEIGHT),
    "N/m": (Fraction(1), STIFFNESS),
    "N/mm": (Fraction(1000), STIFFNESS),
    "kN/m": (Fraction(1000), STIFFNESS),
    "MN/m": (Fraction(10**6), STIFFNESS),
    "kN": (Fraction(1000), FORCE),
    "N": (Fraction(1), FORCE),
    "N m": (Fraction(1), MOMENT),
    "kN m": (Fraction(1000), MOMENT),
    "kg": (Fraction(1), MASS),
    "g": (Fraction(1, 1000), MASS),
}
"""Expressions that need no pint, and the suggestions for a misspelt unit."""

_FACTOR = r"[A-Za-zµμ°_]+[0-9]?(?:\^-?[1-9][0-9]?)?"
_EXPRESSION = re.compile(rf"{_FACTOR}(?:[ ]?[*/·][ ]?{_FACTOR}|[ ]{_FACTOR})*")
_OPERATOR = re.compile(r" ?([*/·]) ?")
_SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3"})
_MAX_LENGTH = 40
_NO_NUMBER = re.compile(r"\bnan(?![A-Za-z_])", re.IGNORECASE)
"""Numbers for pint, which does not take fractions."""


class UnitError(ValueError):
    """The text is not a unit; `unknown` is the unknown name in it, or empty if the form is wrong."""

    def __init__(self, unknown: str = "") -> None:
        """Keep the unknown name."""
        self.unknown = unknown
        super().__init__(unknown)


@dataclass(frozen=True, slots=True)
class Unit:
    """Exact value of a unit in SI, and its dimension."""

    factor: Fraction
    dimension: Dimension


def parse_unit(text: str) -> Unit:
    """Read a product or quotient of units with whole exponents ("kN/m^3", "m/s²"); raises UnitError."""
    plain = text.translate(_SUPERSCRIPTS).replace("**", "^")
    if plain in COMMON:
        return Unit(*COMMON[plain])
    # Only what matches this small grammar reaches pint, whose parser would also evaluate "m**9**9**9".
    if len(plain) > _MAX_LENGTH or not _EXPRESSION.fullmatch(plain):
        raise UnitError
    return unit_by_pint(plain)


@functools.lru_cache(maxsize=256)
def unit_by_pint(text: str) -> Unit:
    """Let pint read a unit expression; raises UnitError."""
    import pint

    registry: Any = _registry()  # pint's own hints do not follow `non_int_type`
    numbers = _NO_NUMBER.search(text)
    if numbers is not None:
        raise UnitError(numbers[0])
    try:
        unit = registry.parse_units(_for_pint(text))
        factor, _ = registry.get_base_units(unit)
    except pint.UndefinedUnitError as error:
        unknown: Any = error.unit_names
        raise UnitError(unknown if isinstance(unknown, str) else next(iter(unknown))) from None
    powers = unit.dimensionality
    length, mass, time, angle = (int(powers.get(f"[{name}]", 0)) for name in ("length", "mass", "time", "angle"))
    return Unit(Fraction(factor), (length, mass, time, angle))


def _for_pint(text: str) -> str:
    return _OPERATOR.sub(r"\1", text).replace("^", "**").replace("·", "*").replace(" ", "*")


@functools.cache
def _registry() -> "pint.UnitRegistry[Fraction]":
    import pint

    registry: pint.UnitRegistry[Fraction] = pint.UnitRegistry(None, non_int_type=Fraction)
    registry.load_definitions(DEFINITIONS.strip().splitlines())
    return registry


def similar_unit(name: str, expression: str, dimension: Dimension) -> str | None:
    """Name the unit one typing error away from `name` with which the whole expression gets the dimension."""
    simple = (unit for unit in COMMON if "/" not in unit)
    return nearest(name, [unit for unit in simple if _fits(name, unit, expression, dimension)], most=1)


def _fits(name: str, other: str, expression: str, dimension: Dimension) -> bool:
    if slips(name, other) > 1:
        return False
    try:
        return parse_unit(re.sub(rf"\b{re.escape(name)}\b", other, expression)).dimension == dimension
    except UnitError:
        return False


def unit_factor(unit: str, target: str) -> float | None:
    """Return how many `target` one `unit` is, or None when it is unknown or of another kind.

    `"1"` means a pure number. Angles are a separate kind: a pure number is not an angle.
    """
    if "1" in (unit, target):
        return 1.0 if unit == target else None
    try:
        one, other = parse_unit(unit), parse_unit(target)
    except UnitError:
        return None
    return float(one.factor / other.factor) if one.dimension == other.dimension else None
