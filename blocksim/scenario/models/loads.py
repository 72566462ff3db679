"""Loads, [[loads]]: forces, moments and pressures on bodies, and accelerations of all free bodies, over time.

Coordinates and angles are those of the ground: a tilted ground is tilted gravity. What a load does at a time is its
magnitude times the factor of its history at that time: constant, a ramp, steps, or samples that straight lines join,
given or from a table. A table is CSV with the columns `time_s` and that of the number, `factor` for loads:

    # test 3, jack
    time_s,factor
    0.0,0
    2.5,1

Lines that begin with `#` are notes. Times increase and are not negative. The number is that of the first line before it
and that of the last line after it. The resolved scenario holds the samples, so that it needs no copy of the table.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, NamedTuple, get_args

from pydantic import ConfigDict, Field, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue

from blocksim.scenario import spelling, units as q
from blocksim.scenario.models import base, geometry, motion
from blocksim.scenario.models.base import setting

MAX_BYTES = 1_000_000
MAX_ROWS = 10_000
Times = tuple[q.NonNegativeTime, ...]


class Stretch(NamedTuple):
    """From `start` (s) on, until the next one: value, its rate, acceleration, and the rate of that, all at `start`."""

    start: float
    value: float
    rate: float
    acceleration: float = 0.0
    jerk: float = 0.0


class Constant(base.Table):
    """The whole load from the beginning to the end."""

    kind: Literal["constant"] = setting("kind of history")


class RampHistory(base.Table):
    """A factor that changes evenly from one time to another, and stays."""

    model_config = ConfigDict(title="Ramp")

    kind: Literal["ramp"] = setting("kind of history")
    start: q.NonNegativeTime = setting("begin of the ramp", 0.0)
    end: q.PositiveTime = setting("end of the ramp")
    first: q.Number = setting("factor until the ramp begins", 0.0, alias="from")
    last: q.Number = setting("factor once it has ended", 1.0, alias="to")

    def _check(self) -> None:
        if not self.end > self.start:
            message = f"a ramp that begins at {self.start:g} s cannot end at {self.end:g} s; use steps for a jump"
            raise q.invalid(message, "end")


class Sampled(base.Table):
    """Numbers under a key at `times` that increase: in the scenario, or those of a CSV table that it names."""

    column: ClassVar[str] = ""  # of the table; without one no table can be named
    key: ClassVar[str] = "factors"
    least: ClassVar[int] = 2

    @model_validator(mode="before")
    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> object:
        if not cls.column or not isinstance(value, Mapping) or value.get("table") is None:
            return value
        for other in ("times", cls.key):
            if other in value:
                raise q.invalid(f"table and {other} are both given; keep one of them", other)
        path = base.table_path(value["table"], (info.context or {}).get("folder", ""), "load.csv", "table")
        needed = f"{motion.TIME},{cls.column}"
        try:
            content = motion.content_of(path, MAX_BYTES)
            _, times, values = motion.read_series(content, (cls.column,), needed, MAX_ROWS)
        except motion.MotionTableError as error:
            raise q.invalid(f"{path.name}: {error}", "table") from None
        kept = {name: entry for name, entry in value.items() if name != "table"}
        unit = cls.column.rpartition("_")[2]
        samples = tuple(f"{one!r} {unit}" for one in values) if unit in ("deg", "mm") else values
        return {**kept, "times": times, cls.key: samples}

    def _check(self) -> None:
        times, values = (getattr(self, name) for name in ("times", self.key))
        if len(times) < self.least:
            least = f"at least {self.least} {'is' if self.least == 1 else 'are'} needed"
            raise q.invalid(f"{len(times)} times are too few; {least}", "times")
        if len(times) != len(values):
            raise q.invalid(f"{len(values)} {self.key} for {len(times)} times; every time needs one", self.key)
        for number, (one, other) in enumerate(pairwise(times), start=1):
            if other <= one:
                raise q.invalid(f"{other:g} s comes after {one:g} s; times must increase", "times", number)


class Steps(Sampled):
    """Factors that hold from their time on; none before the first."""

    least = 1
    kind: Literal["steps"] = setting("kind of history")
    times: Times = setting("times at which the factor changes")
    factors: tuple[q.Number, ...] = setting("factor from each of these times on; 0 before")


class Samples(Sampled):
    """Factors at some times, joined by straight lines: of a CSV table, or `times` and `factors`."""

    column = "factor"
    kind: Literal["table"] = setting("kind of history")
    table: str | None = setting("CSV table with the columns time_s and factor, relative to the scenario file", None)
    times: Times = setting("times of the factors, instead of a table", ())
    factors: tuple[q.Number, ...] = setting("factors at these times, instead of a table", ())


AnyHistory = Annotated[Constant | RampHistory | Steps | Samples, Field(discriminator="kind")]
"""Any history, distinguished by its `kind`."""
HISTORIES: dict[str, type[base.Table]] = base.by_kind(AnyHistory)
"""Class by kind, as written in a scenario."""


Axes = Annotated[Literal["world", "body"], base.OneOf(("world", "body"))]
Line = Literal["body", "space"]
NORMALS = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "top": (0.0, 1.0), "bottom": (0.0, -1.0)}
"""Outward normals of the sides of a body, along its axes."""
BACK, FRONT = "back", "front"
SIDES = ("left", "right", BACK, FRONT)
"""What a pressure may act on of a structure."""


class FaceChoice(q.FieldReader):
    """Annotation of a face of a body: a side, the direction of its normal, or its number."""

    def read(self, value: object) -> object:
        """Pass what may name a face; raises a pydantic error."""
        if isinstance(value, str) and any(letter.isdigit() for letter in value):
            q.Quantity(q.ANGLE).read(value)
        elif value not in [*NORMALS, *SIDES] and not (type(value) is int and 0 < value <= geometry.COUNTS["maxItems"]):
            similar = spelling.nearest(value, [*NORMALS, BACK, FRONT], most=2) if isinstance(value, str) else None
            hint = f"did you mean {q.toml(similar)}? " if similar else ""
            wanted = 'the direction of its normal such as "150 deg", or its number from 1 on'
            raise q.invalid(f"{q.toml(value)} is no face; {hint}use {' or '.join(map(q.toml, NORMALS))}, {wanted}")
        return value

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema of all three."""
        number = {"type": "integer", "minimum": 1, "maximum": geometry.COUNTS["maxItems"]}
        return {
            **usual,
            "anyOf": [{"enum": [*NORMALS, BACK, FRONT]}, number, {"type": "string", "examples": ["150 deg"]}],
        }


Face = Annotated[int | str, FaceChoice()]
WATER = 9810.0  # N/m³; unit weight of water
BODY = setting("the name of the body that it acts on (without a name, its number)")


class Load(base.Table):
    """One load; every kind adds its own keys."""

    name: base.Identifier | None = setting("name, as in `--vary loads.NAME.magnitude=1N:9N`", None)


class VaryingLoad(Load):
    """A load that goes with a factor."""

    history: AnyHistory = setting("factor over time", Constant(kind="constant"))


class Force(VaryingLoad):
    """A force on a point of a body, along fixed axes or along those of the body."""

    kind: Literal["force"] = setting("kind of load")
    body: str = BODY
    magnitude: q.Force = setting("size of the force; negative against its direction")
    direction: q.Angle = setting("direction, counter-clockwise from +x of the axes", 0.0)
    axes: Axes = setting("axes of the direction: world, or body, with which it turns", "world")
    point: geometry.Point = setting("[x, y] of its point in the body, from the centre", (0.0, 0.0))
    line: Annotated[Line, base.OneOf(get_args(Line))] = setting(
        'what its line of action follows: "body", with whose point it travels; or "space", where it stays as it is at '
        "the start, as that of a jack that rolls",
        "body",
    )

    def _check(self) -> None:
        if self.line == "space" and self.axes == "body":
            raise q.invalid("a line that stays in space cannot turn with the body", "line")


class Moment(VaryingLoad):
    """A moment on a body."""

    kind: Literal["moment"] = setting("kind of load")
    body: str = BODY
    magnitude: q.Moment = setting("size of the moment, counter-clockwise positive")


class Pressure(VaryingLoad):
    """Pressure on a face of a body or on a side of a structure, uniform or of water below a level; it moves with faces.

    On a structure it acts on all that is open on that side at the start: see open_faces.py. The factor of a
    history goes with the pressure, and for water with the level: the water rises and falls.
    """

    kind: Literal["pressure"] = setting("kind of load")
    body: str | None = setting("the name of the body that it acts on; give this or structure", None)
    structure: Annotated[int, base.Whole(1, MAX_ROWS)] | None = setting(
        "the number of the structure that it acts on, 1 for the first; give this or body", None
    )
    face: Face = setting(
        "face of the body before it is turned by its angle: left, right, top, bottom, the direction of its normal "
        '("150 deg" from +x), each the nearest there is, or its number (1 begins at the first corner); of a structure '
        "left, right, back (where soil is; left without) or front"
    )
    magnitude: q.AnyPressure | None = setting("uniform pressure, negative for suction; give this or water_level", None)
    water_level: q.NonNegativeLength | None = setting(
        "level of the water above the origin; give this or magnitude", None
    )
    unit_weight: q.UnitWeight = setting("weight per volume of the water", WATER)

    def _check(self) -> None:
        base.require_one("what it acts on is missing: give body or structure", body=self.body, structure=self.structure)
        if self.structure is not None and self.face not in SIDES:
            raise q.invalid(f"a structure has the sides {', '.join(SIDES)}", "face")
        if self.body is not None and self.face in (BACK, FRONT):
            raise q.invalid(f"{self.face} is a side of a structure; a body has left, right, top, bottom", "face")
        missing = 'the pressure is missing: give magnitude (such as "10 kPa") or water_level'
        base.require_one(missing, magnitude=self.magnitude, water_level=self.water_level)
        if self.magnitude is not None and "unit_weight" in self.model_fields_set and self.unit_weight != WATER:
            raise q.invalid("a uniform pressure has no unit weight, which belongs to water_level", "unit_weight")


class Horizontal(VaryingLoad):
    """The same horizontal acceleration of all free bodies, in units of gravity (seismic coefficient)."""

    kind: Literal["horizontal"] = setting("kind of load")
    magnitude: q.Number = setting("acceleration over that of gravity, towards +x where positive")


class Gravity(Load, Sampled):
    """Gravity that turns, as on a tilting table: from one tilt of the ground to another at a rate, or as samples say.

    Tilts are those of `ground.tilt`, which it takes the place of.
    """

    needs: ClassVar = ("to", "rate")
    column, key = "tilt_deg", "tilts"
    kind: Literal["gravity"] = setting("kind of load")
    first: q.TiltAngle | None = setting("tilt until it begins to turn (default: ground.tilt)", None, alias="from")
    last: q.TiltAngle | None = setting("tilt at which it stops", None, alias="to")
    rate: q.PositiveSpin | None = setting("rate of the tilt", None)
    start: q.NonNegativeTime = setting("time at which it begins to turn", 0.0)
    table: str | None = setting(
        "CSV table with the columns time_s and tilt_deg, relative to the scenario file, for to and rate", None
    )
    times: Times = setting("times of the tilts, instead of a table", ())
    tilts: tuple[q.TiltAngle, ...] = setting("tilts at these times, instead of a table", ())

    def _check(self) -> None:
        turns = {"to": self.last, "rate": self.rate}
        given = [key for key, value in {**turns, "from": self.first}.items() if value is not None]
        if self.times or self.tilts:
            if given:
                raise q.invalid(f"{given[0]} and samples of the tilt are both given; keep one of them", given[0])
            super()._check()
            return
        for key, value in turns.items():
            if value is None:
                raise q.invalid(f'{key} is missing: give to and rate (such as "0.1 deg/s"), or a table')


AnyLoad = Annotated[Force | Moment | Pressure | Horizontal | Gravity, Field(discriminator="kind")]
"""Any load, distinguished by its `kind`."""
LOADS: dict[str, type[Load]] = base.by_kind(AnyLoad)  # class by kind, as written in a scenario
OnBody = Force | Moment | Pressure  # those that act on one body


def stretches_of(load: AnyLoad, tilt: float) -> tuple[Stretch, ...]:
    """Return the factor of a load over time; of gravity the tilt (rad), given that of the ground."""
    history = load if isinstance(load, Gravity) else load.history
    times: Times
    values: tuple[float, ...]
    match history:
        case Constant():
            return (Stretch(0.0, 1.0, 0.0),)
        case RampHistory():
            times, values = (history.start, history.end), (history.first, history.last)
        case Gravity(times=()):
            first, last = tilt if history.first is None else history.first, history.last or 0.0
            if last == first:
                return (Stretch(0.0, first, 0.0),)
            end = history.start + abs(last - first) / (history.rate or math.nan)
            times, values = (history.start, end), (first, last)
        case Gravity():
            times, values = history.times, history.tilts
        case _:
            times, values = history.times, history.factors
    return joined(times, values, is_stepped=isinstance(history, Steps))


def joined(times: Sequence[float], values: Sequence[float], *, is_stepped: bool = False) -> tuple[Stretch, ...]:
    """Return values at times (s) that increase, joined by straight lines, or stepped: each until the next, 0 before."""
    rows = [Stretch(0.0, 0.0 if is_stepped else values[0], 0.0)] if times[0] > 0.0 else []
    for (begin, one), (until, other) in pairwise(zip(times, values, strict=True)):
        rows.append(Stretch(begin, one, 0.0 if is_stepped else (other - one) / (until - begin)))
    return (*rows, Stretch(times[-1], values[-1], 0.0))
