"""Units and quantities: expressions such as "kN/m^3", and numbers with a unit as SI floats."""

import functools
import math
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from fractions import Fraction
from typing import Annotated, Any, Literal

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

Dimension = tuple[int, int, int, int]
"""Exponents of length, mass, time and angle; an angle counts, so that "1/s" is not a spin and "3" not an angle."""

USUAL_GRAVITY = 9.81
"""m/s²; the default of scenarios; turns a unit weight into a density, as in the paper, whatever gravity there is."""
STANDARD_GRAVITY = 9.80665  # m/s²; the g of accelerograms, and the unit g0
DEGREE = Fraction(math.pi) / 180
"""One degree in radians; built on the float pi, so that "180 deg" is `math.pi` to the last bit."""


class UnitError(ValueError):
    """The text is not a unit; that of the error is the unknown name in it, or empty if the form is wrong."""


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
_SUGGESTED = "m cm mm um km s ms us min rad deg Hz Pa kPa MPa GPa kN N kg g"

_FACTOR = r"[A-Za-zµμ°_]+[0-9]?(?:\^-?[1-9][0-9]?)?"
_EXPRESSION = re.compile(rf"{_FACTOR}(?:[ ]?[*/·][ ]?{_FACTOR}|[ ]{_FACTOR})*")
_POWER = re.compile(r"([A-Za-zµμ°])([2-9])\b")
_PART = re.compile(r"([*/·]?)[ ]?([A-Za-zµμ°_]+[0-9]?)(?:\^(-?[0-9]+))?")
_SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3"})
LEAST_SHARE = 0.5  # of letters that a unit has in common with one that is suggested for it


def parse_unit(text: str) -> Unit:
    """Read a product or quotient of units with whole exponents ("kN/m^3", "m/s²"); raises UnitError."""
    plain = text.translate(_SUPERSCRIPTS).replace("**", "^")
    if len(plain) > 40 or not _EXPRESSION.fullmatch(plain):
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
    for other in _SUGGESTED.split():
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


_NUMBER = r"[+-]?(?:[0-9]+(?:_[0-9]+)*\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*(\S.*?)?\s*", re.DOTALL)
_TEXT_SCHEMA = {"type": "string", "pattern": rf"^\s*{_NUMBER}\s*[A-Za-zµμ°]"}
_DECIMAL_COMMA = re.compile(r"\s*([+-]?[0-9]+),([0-9]+)(?![0-9]*,)(.*)", re.DOTALL)
_MAX_LENGTH_QUANTITIES = 80
MAX_SHOWN = 40
PERCENT = ("%", "percent", "pct")
LEAST, MOST = 1e-18, 1e30
"""Bounds (SI) of positive numbers and of all numbers: products of many such numbers stay finite doubles."""


def toml(value: object) -> str:
    """Write a value as in a TOML file, shortened, for a message."""
    match value:
        case bool():
            text = str(value).lower()
        case str():
            short = value if len(value) <= MAX_SHOWN else value[:MAX_SHOWN] + "…"
            escaped = short.replace("\\", "\\\\").replace('"', '\\"')
            text = f'"{"".join(c if c.isprintable() else repr(c)[1:-1] for c in escaped)}"'
        case int() if abs(value) > 10**MAX_SHOWN:
            text = "a huge whole number"
        case list() | tuple():
            text = "a list"
        case dict():
            text = "a table"
        case _:
            text = str(value)[:MAX_SHOWN]
    return text


def invalid(message: str, *key: str | int, at: Literal["key", "value"] = "value") -> PydanticCustomError:
    """Build the error that carries a finished message through pydantic; `key` is the path of the key concerned."""
    return PydanticCustomError("blocksim", "{message}", {"message": message, "key": key, "at": at})


@dataclass(frozen=True, slots=True)
class Kind:
    """Kind of quantity: its name with the article, its dimension, its SI unit, and an example for messages."""

    name: str
    dimension: Dimension
    unit: str
    example: str

    def in_words(self, value: float) -> str:
        """Write a bound for a message: 0 without a unit, angles in degrees."""
        if value == 0 or not self.unit:
            return f"{value:g}"
        return f"{math.degrees(value):g} deg" if self.unit == "rad" else f"{value:g} {self.unit}"


NUMBER = Kind("a plain number", (0, 0, 0, 0), "", "")
LENGTH = Kind("a length", (1, 0, 0, 0), "m", "32 mm")
AREA = Kind("an area", (2, 0, 0, 0), "m^2", "2 m^2")
MASS = Kind("a mass", (0, 1, 0, 0), "kg", "2 kg")
TIME = Kind("a time", (0, 0, 1, 0), "s", "2 s")
ANGLE = Kind("an angle", (0, 0, 0, 1), "rad", "20 deg")
SPEED = Kind("a speed", (1, 0, -1, 0), "m/s", "5 mm/s")
FREQUENCY = Kind("a frequency", (0, 0, -1, 0), "Hz", "2 Hz")
SPIN = Kind("a spin", (0, 0, -1, 1), "rad/s", "90 deg/s")
ACCELERATION = Kind("an acceleration", (1, 0, -2, 0), "m/s^2", "9.81 m/s^2")
PRESSURE = Kind("a pressure", (-1, 1, -2, 0), "Pa", "69 GPa")
DENSITY = Kind("a density", (-3, 1, 0, 0), "kg/m^3", "2700 kg/m^3")
UNIT_WEIGHT = Kind("a unit weight", (-2, 1, -2, 0), "N/m^3", "26.7 kN/m^3")
STIFFNESS = Kind("a stiffness", (0, 1, -2, 0), "N/m", "1e6 N/m")
FORCE = Kind("a force", (1, 1, -2, 0), "N", "2 kN")
MOMENT = Kind("a moment", (2, 1, -2, 0), "N m", "5 N m")
_KINDS = (NUMBER, LENGTH, AREA, MASS, TIME, ANGLE, SPEED, FREQUENCY, SPIN, ACCELERATION, PRESSURE, DENSITY)
_NAMES = {kind.dimension: kind.name for kind in (*_KINDS, UNIT_WEIGHT, STIFFNESS, FORCE, MOMENT)}


class FieldReader:
    """What annotations of a field have in common: they read the value of the file before pydantic does."""

    def read(self, value: object) -> object:
        """Return the value as the model has it, in SI; the pydantic error has what is allowed."""
        raise NotImplementedError

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema of the value in the file, from the usual one of its type."""
        return usual

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read the value first, then let pydantic see it."""
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe to editors what may stand in the file."""
        return self.json_schema(handler(schema))


@dataclass(frozen=True)
class Quantity(FieldReader):
    """Annotation of a float field: kind of quantity and allowed values (SI)."""

    kind: Kind
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    negative: str = ""  # what to write in place of a negative value

    @property
    def wanted(self) -> str:
        """Return what is allowed: 'a length above 0 such as "32 mm"'."""
        bounds = {"above": self.above, "of at least": self.at_least, "below": self.below, "at most": self.at_most}
        given = [f"{word} {self.kind.in_words(bound)}" for word, bound in bounds.items() if bound is not None]
        example = [f'such as "{self.kind.example}"'] if self.kind.example else []
        return " ".join([self.kind.name, *[" and ".join(given)][: len(given)], *example])

    def read(self, value: object) -> float:
        """Turn the value of the file into an SI float; the pydantic error has what is allowed."""
        if isinstance(value, str):
            number = self._text(value)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise invalid(f"{toml(value)} is not a number; {self.wanted} is needed")
        else:
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
            if self.kind is ANGLE and number != 0 and math.isfinite(number):
                raise invalid(f'{toml(value)} has no unit; write "{number:g} deg" (or "{number:g} rad")')
        if not math.isfinite(number):
            raise invalid(f"{toml(value)} is not a finite number; {self.wanted} is needed")
        low, least, high, most = self.above, self.at_least, self.below, self.at_most
        if (low is not None and number <= low) or (least is not None and number < least):
            instead = f"; {self.negative}" if self.negative and number < 0.0 else ""
            raise invalid(f"{toml(value)} is too small; {self.wanted} is needed{instead}")
        if (high is not None and number >= high) or (most is not None and number > most):
            raise invalid(f"{toml(value)} is too large; {self.wanted} is needed")
        if abs(number) > MOST:
            raise invalid(f"{toml(value)} is too large to compute with; at most {MOST:g} (SI) is allowed")
        if self.above == 0.0 and number < LEAST:
            raise invalid(f"{toml(value)} is too small to compute with; at least {LEAST:g} (SI) is allowed")
        return number

    def _text(self, text: str) -> float:
        try:
            number, dimension = parse_quantity(text, self.kind)
        except ValueError as error:
            raise invalid(f"{toml(text)} is not {self.kind.name}: {error}") from None
        if dimension != self.kind.dimension:
            name = _NAMES.get(dimension, f"not {self.kind.name}")
            raise invalid(f"{toml(text)} is {name}; {self.wanted} is needed")
        return number

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema of a number in SI or a string with a unit."""
        bounds = {
            "exclusiveMinimum": self.above,
            "minimum": self.at_least,
            "exclusiveMaximum": self.below,
            "maximum": self.at_most,
        }
        number = {**usual, **{name: bound for name, bound in bounds.items() if bound is not None}}
        if self.kind is NUMBER:
            return number
        if self.kind is ANGLE:
            number = {"const": 0}
        return {"anyOf": [number, {**_TEXT_SCHEMA, "examples": [self.kind.example]}]}


NO_SLIP = 1e6
"""Greatest coefficient of friction: beside numbers a thousand times greater the solver of statics loses others."""


@dataclass(frozen=True)
class FrictionCoefficient(FieldReader):
    """Annotation of a float field: a coefficient, or a friction angle ("21 deg") whose tangent it is."""

    wanted = 'a number of at least 0 such as 0.31, or a friction angle below 90 deg such as "21 deg",'

    def read(self, value: object) -> float:
        """Turn a coefficient or a friction angle into a coefficient."""
        if isinstance(value, str):
            bare = _TEXT.fullmatch(value.replace(",", "."))
            if bare and (not bare[2] or bare[2] in PERCENT):
                return Quantity(NUMBER).read(value)
            coefficient = math.tan(Quantity(ANGLE, at_least=0.0, below=math.pi / 2).read(value))
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise invalid(f"{toml(value)} is not a number; {self.wanted} is needed")
        else:
            coefficient = Quantity(NUMBER, at_least=0.0).read(value)
        if coefficient > NO_SLIP:
            raise invalid(f"{toml(value)} is too much to compute with; {NO_SLIP:g} is no slip")
        return coefficient

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema of a number or an angle with its unit."""
        return {"anyOf": [{**usual, "minimum": 0, "maximum": NO_SLIP}, {**_TEXT_SCHEMA, "examples": ["21 deg"]}]}


@functools.lru_cache(maxsize=1024)
def parse_quantity(text: str, wanted: Kind = NUMBER) -> tuple[float, Dimension]:
    """Read "number unit" into an SI float and its dimension; raises ValueError with the reason.

    `wanted` decides which unit is suggested for a misspelt one, and that g is the standard gravity, not a gram, where
    an acceleration is meant.
    """
    found = _TEXT.fullmatch(text) if len(text) <= _MAX_LENGTH_QUANTITIES else None
    comma = _DECIMAL_COMMA.fullmatch(text) if len(text) <= _MAX_LENGTH_QUANTITIES else None
    if comma:
        text = f"{comma[1]}.{comma[2]}{comma[3]}"
        raise ValueError(f"write {text}, without quotes" if wanted is NUMBER else f'write a decimal point: "{text}"')
    number, unit = (None, None) if found is None else found.groups()
    if number is not None and unit in PERCENT:
        raise ValueError(f"write {float(number) / 100.0:g}, without quotes")
    if wanted is NUMBER and unit is None:
        raise ValueError("write a number without quotes" if number is None else f"write {number}, without quotes")
    if number is None:
        raise ValueError(f'write a number and a unit, such as "{wanted.example}"')
    if unit is None:
        raise ValueError(f'the unit is missing, write it as in "{wanted.example}"')
    try:
        worth = parse_unit("g0" if wanted is ACCELERATION and unit == "g" else unit)
    except UnitError as error:
        unknown = str(error)
        if not unknown:
            raise ValueError(f"{toml(unit)[1:-1]!r} is not a unit") from None
        powers, meant = _POWER.sub(r"\1^\2", unit), None
        with suppress(UnitError):
            meant = parse_unit(powers).dimension
        if meant is not None and powers != unit:
            kind = "" if meant == wanted.dimension else f", {_NAMES.get(meant, 'another quantity')}"
            raise ValueError(f"write the unit as {powers!r}{kind}") from None
        similar = similar_unit(unknown, unit, wanted.dimension)
        hint = f"did you mean {similar!r}?" if similar else f'write it as in "{wanted.example}"'
        raise ValueError(f"unknown unit {unknown!r}, {hint}") from None
    rough = float(number)
    if rough == 0 or math.isinf(rough):  # before "1e999999999" becomes a whole number of a billion digits
        return rough, worth.dimension
    try:
        return float(Fraction(number) * worth.factor), worth.dimension  # the float nearest to the exact product
    except OverflowError:
        return math.copysign(math.inf, rough), worth.dimension


def unit_in(text: str) -> str:
    """Return the unit in a text such as "9.5 mm"; empty if it is not a number with a known unit."""
    found = _TEXT.fullmatch(text) if len(text) <= _MAX_LENGTH_QUANTITIES else None
    try:
        parse_unit((found and found[2]) or "")
    except UnitError:
        return ""
    return found[2].strip() if found else ""


Number = Annotated[float, Quantity(NUMBER)]
PositiveNumber = Annotated[float, Quantity(NUMBER, above=0.0)]
NonNegativeNumber = Annotated[float, Quantity(NUMBER, at_least=0.0)]
Share = Annotated[float, Quantity(NUMBER, at_least=0.0, at_most=1.0)]
Ratio = Annotated[float, Quantity(NUMBER, above=0.0, at_most=1.0)]
Safety = Annotated[float, Quantity(NUMBER, above=0.0, at_most=0.1)]
PoissonRatio = Annotated[float, Quantity(NUMBER, above=-1.0, below=0.5)]
Friction = Annotated[float, FrictionCoefficient()]
Length = Annotated[float, Quantity(LENGTH)]
PositiveLength = Annotated[float, Quantity(LENGTH, above=0.0)]
NonNegativeLength = Annotated[float, Quantity(LENGTH, at_least=0.0)]
Time = Annotated[float, Quantity(TIME)]
PositiveTime = Annotated[float, Quantity(TIME, above=0.0)]
NonNegativeTime = Annotated[float, Quantity(TIME, at_least=0.0)]
Angle = Annotated[float, Quantity(ANGLE)]
HalfTurn = Annotated[float, Quantity(ANGLE, at_least=0.0, at_most=math.pi)]
Embrace = Annotated[float, Quantity(ANGLE, above=0.0, below=2.0 * math.pi)]
SlopeAngle = Annotated[float, Quantity(ANGLE, above=0.0, below=math.pi)]
TiltAngle = Annotated[float, Quantity(ANGLE, above=-math.pi / 2, below=math.pi / 2)]
Speed = Annotated[float, Quantity(SPEED)]
NonNegativeSpeed = Annotated[float, Quantity(SPEED, at_least=0.0)]
PositiveSpeed = Annotated[float, Quantity(SPEED, above=0.0)]
PositiveFrequency = Annotated[float, Quantity(FREQUENCY, above=0.0)]
Spin = Annotated[float, Quantity(SPIN)]
PositiveSpin = Annotated[float, Quantity(SPIN, above=0.0)]
NonNegativeAcceleration = Annotated[float, Quantity(ACCELERATION, at_least=0.0)]
FrictionAngle = Annotated[float, Quantity(ANGLE, at_least=0.0, below=math.pi / 2)]
Cohesion = Annotated[float, Quantity(PRESSURE, at_least=0.0)]
Pressure = Annotated[float, Quantity(PRESSURE, above=0.0)]
AnyPressure = Annotated[float, Quantity(replace(PRESSURE, example="10 kPa"))]
Force = Annotated[float, Quantity(FORCE)]
Moment = Annotated[float, Quantity(MOMENT)]
Density = Annotated[float, Quantity(DENSITY, above=0.0)]
UnitWeight = Annotated[float, Quantity(UNIT_WEIGHT, above=0.0)]
Stiffness = Annotated[float, Quantity(STIFFNESS, above=0.0)]
