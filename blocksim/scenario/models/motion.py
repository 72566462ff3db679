"""Prescribed motion of the supports: the ground, walls and fixed bodies move together along one direction."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Table
from blocksim.scenario.motion_table import MotionTable, MotionTableError, read_motion_table
from blocksim.scenario.path_policy import OutOfReachError, table_in

PIECES_PER_CYCLE = 200
"""The cubic pieces are then off by less than (2 pi/200)^4/384 = 3e-9 of the amplitude."""


class Harmonic(Table):
    """u(t) = amplitude r(t) sin(2 pi frequency (t - start) + phase) from `start` on, for `duration`.

    r rises smoothly from 0 to 1 within `ramp` and falls as smoothly at the end of a duration.
    """

    kind: Literal["harmonic"] = Field(description="kind of motion")
    amplitude: q.PositiveLength = Field(description="largest displacement")
    frequency: q.PositiveFrequency = Field(description="cycles per second")
    phase: q.Angle = Field(default=0.0, description="phase at the start")
    direction: q.Angle = Field(default=0.0, description="direction of the motion, counter-clockwise from +x")
    start: q.NonNegativeTime = Field(default=0.0, description="start of the motion; the supports rest before")
    duration: q.PositiveTime | None = Field(default=None, description="duration of the motion (default: to the end)")
    ramp: q.PositiveTime | None = Field(
        default=None, description="time of the smooth rise, and of the fall after a duration (default: one cycle)"
    )

    @property
    def resolved_ramp(self) -> float:
        """Time (s) of the rise, as given or by default."""
        return 1.0 / self.frequency if self.ramp is None else self.ramp

    def sections(self, end: float) -> Iterator[tuple[float, float, int]]:
        """Yield start and end (s) of rise, steady part and fall, up to `end`, and the number of pieces of each."""
        ramp, cycle = self.resolved_ramp, 1.0 / self.frequency
        stop = math.inf if self.duration is None else self.start + self.duration
        breaks = [(self.start, min(cycle, ramp)), (self.start + ramp, cycle), (stop - ramp, min(cycle, ramp))]
        lasts = [begin for begin, _ in breaks[1:]] + [stop]
        for (begin, length), last in zip(breaks, lasts, strict=True):
            until = min(last, end)
            if until > begin:
                yield begin, until, math.ceil((until - begin) / length * PIECES_PER_CYCLE)

    @model_validator(mode="after")
    def _room_for_ramps(self) -> Self:
        if self.duration is not None and self.duration < 2.0 * self.resolved_ramp:
            message = f"{self.duration:g} s is too short for two ramps of {self.resolved_ramp:g} s"
            raise q.invalid(message, "duration")
        return self


def _table(value: object, info: ValidationInfo) -> MotionTable:
    """Read the table; its path is relative to the scenario's folder, which is the validation context."""
    if isinstance(value, MotionTable):
        return value
    if not isinstance(value, str) or not value or "\0" in value:
        message = f'{q.shown(value)} is not the path of a table, such as "shaking.csv"'
        raise q.invalid(message)
    try:
        path = table_in((info.context or {}).get("folder", ""), value)
    except OutOfReachError as error:
        raise q.invalid(str(error)) from None
    try:
        return read_motion_table(path)
    except MotionTableError as error:
        message = f"{path.name}: {error}"
        raise q.invalid(message) from None


def _path(table: MotionTable) -> str:
    return table.path.as_posix()


class FromTable(Table):
    """Samples of a CSV table; see `blocksim.scenario.motion_table`.

    Displacements count from the first and are joined by a cubic spline that begins and ends at rest.
    Accelerations are joined by straight lines and integrated from rest; after the last one the velocity is constant.
    """

    kind: Literal["table"] = Field(description="kind of motion")
    table: Annotated[
        MotionTable, PlainValidator(_table), PlainSerializer(_path), WithJsonSchema({"type": "string", "minLength": 1})
    ] = Field(
        description="CSV table, relative to the scenario file: time_s and displacement_m, _mm or acceleration_g, _m_s2"
    )
    scale: q.Number = Field(default=1.0, description="factor on the table's values")
    direction: q.Angle = Field(default=0.0, description="direction of the motion, counter-clockwise from +x")
    start: q.NonNegativeTime = Field(
        default=0.0, description="time at which the table's time is zero; the supports rest before"
    )


AnyMotion = Annotated[Harmonic | FromTable, Field(discriminator="kind")]
"""Any prescribed motion, distinguished by its `kind`."""
MOTIONS: dict[str, type[Table]] = {"harmonic": Harmonic, "table": FromTable}
"""Class by kind, as written in a scenario."""
