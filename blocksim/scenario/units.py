"""Unit expressions such as "kN/m^3": their value in SI, and their dimension.

Factors are exact fractions: "35 mm" is the float nearest to 0.035, not 35 times a rounded 0.001.
"""

import math
import re
from dataclasses import dataclass
from difflib import SequenceMatcher
from fractions import Fraction

Dimension = tuple[int, int, int, int]
"""Exponents of length, mass, time and angle; an angle counts, so that "1/s" is not a spin and "3" not an angle."""

USUAL_GRAVITY = 9.81
"""m/s²; the default of scenarios; turns a unit weight into a density, as in the paper, whatever gravity there is."""
STANDARD_GRAVITY = 9.80665
"""m/s²; the g of accelerograms, and the unit g0."""
DEGREE = Fraction(math.pi) / 180
"""One degree in radians; built on the float pi, so that "180 deg" is `math.pi` to the last bit."""


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


_UNITS: dict[str, Unit] = {
    name: Unit(Fraction(str(factor)) if isinstance(factor, float) else Fraction(factor), dimension)
    for names, factor, dimension in (
        ("m meter metre", 1, (1, 0, 0, 0)),
        ("in inch", 0.0254, (1, 0, 0, 0)),
        ("ft foot", 0.3048, (1, 0, 0, 0)),
        ("kg kilogram", 1, (0, 1, 0, 0)),
        ("g gram", 0.001, (0, 1, 0, 0)),
        ("t tonne", 1000, (0, 1, 0, 0)),
        ("lb pound", 0.45359237, (0, 1, 0, 0)),
        ("s sec second", 1, (0, 0, 1, 0)),
        ("min minute", 60, (0, 0, 1, 0)),
        ("h hour", 3600, (0, 0, 1, 0)),
        ("rad radian", 1, (0, 0, 0, 1)),
        ("deg degree °", DEGREE, (0, 0, 0, 1)),
        ("turn", 360 * DEGREE, (0, 0, 0, 1)),
        ("rpm", 6 * DEGREE, (0, 0, -1, 1)),
        ("Hz hertz", 1, (0, 0, -1, 0)),
        ("N newton", 1, (1, 1, -2, 0)),
        ("Pa pascal", 1, (-1, 1, -2, 0)),
        ("bar", 100_000, (-1, 1, -2, 0)),
        ("g0 standard_gravity", STANDARD_GRAVITY, (1, 0, -2, 0)),
    )
    for name in names.split()
}
_PREFIXES: dict[str, Fraction] = {
    name: Fraction(10) ** power
    for names, power in (
        ("n nano", -9),
        ("u µ μ micro", -6),
        ("m milli", -3),
        ("c centi", -2),
        ("d deci", -1),
        ("k kilo", 3),
        ("M mega", 6),
        ("G giga", 9),
        ("T tera", 12),
    )
    for name in names.split()
}
_SUGGESTED: tuple[str, ...] = (
    "m",
    "cm",
    "mm",
    "um",
    "km",
    "s",
    "ms",
    "us",
    "min",
    "rad",
    "deg",
    "Hz",
    "Pa",
    "kPa",
    "MPa",
    "GPa",
    "kN",
    "N",
    "kg",
    "g",
)

_FACTOR = r"[A-Za-zµμ°_]+[0-9]?(?:\^-?[1-9][0-9]?)?"
_EXPRESSION = re.compile(rf"{_FACTOR}(?:[ ]?[*/·][ ]?{_FACTOR}|[ ]{_FACTOR})*")
_PART = re.compile(r"([*/·]?)[ ]?([A-Za-zµμ°_]+[0-9]?)(?:\^(-?[0-9]+))?")
_SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3"})
_MAX_LENGTH = 40
LEAST_SHARE = 0.5
"""Of letters that a unit has in common with one that is suggested for it."""


def parse_unit(text: str) -> Unit:
    """Read a product or quotient of units with whole exponents ("kN/m^3", "m/s²"); raises UnitError."""
    plain = text.translate(_SUPERSCRIPTS).replace("**", "^")
    if len(plain) > _MAX_LENGTH or not _EXPRESSION.fullmatch(plain):
        raise UnitError
    factor, dimension = Fraction(1), (0, 0, 0, 0)
    for operator, name, exponent in _PART.findall(plain):
        unit, power = _unit(name), int(exponent or 1) * (-1 if operator == "/" else 1)
        factor *= unit.factor**power
        length, mass, time, angle = (a + power * b for a, b in zip(dimension, unit.dimension, strict=True))
        dimension = length, mass, time, angle
    return Unit(factor, dimension)


def _unit(name: str) -> Unit:
    """Return the unit of a name or symbol, with a prefix or in the plural; raises UnitError."""
    for plural in ("", "s"):
        for prefix, scale in (("", Fraction(1)), *_PREFIXES.items()):
            word = name.removeprefix(prefix).removesuffix(plural)
            is_whole = prefix + word + plural == name and not (plural and len(word) == 1)
            if is_whole and (unit := _UNITS.get(word)) is not None:
                return Unit(scale * unit.factor, unit.dimension)
    raise UnitError(name)


def similar_unit(name: str, expression: str, dimension: Dimension) -> str | None:
    """Name the unit most like `name` with which the whole expression gets the dimension."""
    fitting = {}
    for other in _SUGGESTED:
        try:
            unit = parse_unit(re.sub(rf"\b{re.escape(name)}\b", other, expression))
        except UnitError:
            continue
        share = SequenceMatcher(None, name.lower(), other.lower()).ratio()
        if unit.dimension == dimension and (share >= LEAST_SHARE or len(name) == len(other) == 1):
            fitting[other] = (other[0] == name[0], len(other) == len(name), share)
    return max(fitting, key=fitting.__getitem__, default=None)


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
