"""Loads, [[loads]]: forces, moments and pressures on bodies, and accelerations of all free bodies, over time.

Coordinates and angles are those of the ground: a tilted ground is tilted gravity. What a load does at a time is its
magnitude times the factor of its history at that time.
"""

import math
from typing import Annotated, ClassVar, Literal, Self, get_args

from pydantic import Field, ValidationInfo, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Identifier, OneOf, Table, by_kind, require_one
from blocksim.scenario.models.geometry import Point
from blocksim.scenario.models.history import AnyHistory, Constant, Stretch, Times, joined, refuse_unfit, with_samples

Axes = Literal["world", "body"]
Face = Literal["left", "right", "top", "bottom"]
FACES: tuple[Face, ...] = get_args(Face)
WATER = 9810.0
"""N/m³; unit weight of water."""
BODY = Field(description="the name of the body that it acts on (without a name, its number)")


class Load(Table):
    """One load; every kind adds its own keys."""

    name: Identifier | None = Field(default=None, description="name, as in `--vary loads.NAME.magnitude=1N:9N`")


class VaryingLoad(Load):
    """A load that goes with a factor."""

    history: AnyHistory = Field(default=Constant(kind="constant"), description="factor over time")

    def stretches(self) -> tuple[Stretch, ...]:
        """Return the factor over time."""
        return self.history.stretches()


class Force(VaryingLoad):
    """A force on a point of a body, along fixed axes or along those of the body."""

    kind: Literal["force"] = Field(description="kind of load")
    body: str = BODY
    magnitude: q.Force = Field(description="size of the force; negative against its direction")
    direction: q.Angle = Field(default=0.0, description="direction, counter-clockwise from +x of the axes")
    axes: Annotated[Axes, OneOf(get_args(Axes))] = Field(
        default="world", description="axes of the direction: world, or body, with which it turns"
    )
    point: Point = Field(default=(0.0, 0.0), description="[x, y] of its point in the body, from the centre")


class Moment(VaryingLoad):
    """A moment on a body."""

    kind: Literal["moment"] = Field(description="kind of load")
    body: str = BODY
    magnitude: q.Moment = Field(description="size of the moment, counter-clockwise positive")


class Pressure(VaryingLoad):
    """Pressure on a face of a body, uniform or of water below a level; it moves with the face.

    The factor of a history goes with the pressure, and for water with the level: the water rises and falls.
    """

    kind: Literal["pressure"] = Field(description="kind of load")
    body: str = BODY
    face: Annotated[Face, OneOf(FACES)] = Field(
        description="face of the body before it is turned by its angle: left, right, top or bottom"
    )
    magnitude: q.AnyPressure | None = Field(
        default=None, description="uniform pressure, negative for suction; give this or water_level"
    )
    water_level: q.NonNegativeLength | None = Field(
        default=None, description="level of the water above the origin; give this or magnitude"
    )
    unit_weight: q.UnitWeight = Field(default=WATER, description="weight per volume of the water")

    @model_validator(mode="after")
    def _one_pressure(self) -> Self:
        missing = 'the pressure is missing: give magnitude (such as "10 kPa") or water_level'
        require_one(missing, magnitude=self.magnitude, water_level=self.water_level)
        if self.magnitude is not None and "unit_weight" in self.model_fields_set and self.unit_weight != WATER:
            raise q.invalid("a uniform pressure has no unit weight, which belongs to water_level", "unit_weight")
        return self


class Horizontal(VaryingLoad):
    """The same horizontal acceleration of all free bodies, in units of gravity (seismic coefficient)."""

    kind: Literal["horizontal"] = Field(description="kind of load")
    magnitude: q.Number = Field(description="acceleration over that of gravity, towards +x where positive")


class Gravity(Load):
    """Gravity that turns, as on a tilting table: from one tilt of the ground to another at a rate, or as samples say.

    Tilts are those of `ground.tilt`, which it takes the place of.
    """

    needs: ClassVar = ("to", "rate")
    kind: Literal["gravity"] = Field(description="kind of load")
    first: q.TiltAngle | None = Field(
        default=None, alias="from", description="tilt until it begins to turn (default: ground.tilt)"
    )
    last: q.TiltAngle | None = Field(default=None, alias="to", description="tilt at which it stops")
    rate: q.PositiveSpin | None = Field(default=None, description="rate of the tilt")
    start: q.NonNegativeTime = Field(default=0.0, description="time at which it begins to turn")
    table: str | None = Field(
        default=None,
        description="CSV table with the columns time_s and tilt_deg, relative to the scenario file, for to and rate",
    )
    times: Times = Field(default=(), description="times of the tilts, instead of a table")
    tilts: tuple[q.TiltAngle, ...] = Field(default=(), description="tilts at these times, instead of a table")

    @model_validator(mode="before")
    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> object:
        read = with_samples(value, info, "tilt_deg", "tilts")
        if read is value or not isinstance(read, dict):
            return value
        return {**read, "tilts": tuple(f"{degrees!r} deg" for degrees in read["tilts"])}

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        turns = {"to": self.last, "rate": self.rate}
        given = [key for key, value in {**turns, "from": self.first}.items() if value is not None]
        if self.times or self.tilts:
            if given:
                raise q.invalid(f"{given[0]} and samples of the tilt are both given; keep one of them", given[0])
            refuse_unfit(self.times, self.tilts, "tilts", least=2)
            return self
        for key, value in turns.items():
            if value is None:
                raise q.invalid(f'{key} is missing: give to and rate (such as "0.1 deg/s"), or a table')
        return self

    def stretches_from(self, tilt: float) -> tuple[Stretch, ...]:
        """Return the tilt (rad) over time, given that of the ground."""
        if self.times:
            return joined(self.times, self.tilts)
        first = tilt if self.first is None else self.first
        last, rate = self.last or 0.0, self.rate or math.nan
        if last == first:
            return (Stretch(0.0, first, 0.0),)
        return joined((self.start, self.start + abs(last - first) / rate), (first, last))


AnyLoad = Annotated[Force | Moment | Pressure | Horizontal | Gravity, Field(discriminator="kind")]
"""Any load, distinguished by its `kind`."""
LOADS: dict[str, type[Load]] = by_kind(AnyLoad)
"""Class by kind, as written in a scenario."""
OnBody = Force | Moment | Pressure
"""Those that act on one body."""
