"""Recorded accelerations of the supports, from the files of `blocksim.scenario.record_file`."""

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table
from blocksim.scenario.models.motion import path_of, table_from
from blocksim.scenario.models.pulse import Acceleration
from blocksim.scenario.record_file import UNITS, RecordTable, Unit, read_record

Baseline = Literal["rest", "parabolic", "none"]


def _record(value: object, info: ValidationInfo) -> RecordTable:
    return table_from(value, info, RecordTable, read_record, "record.AT2")


class Record(Table):
    """A recorded accelerogram, corrected, scaled, joined by straight lines and integrated from rest.

    The order is: unit, baseline, then `scale`, or the factor that makes the largest acceleration `pga`. After the last
    sample the velocity is constant.
    """

    kind: Literal["record"] = Field(description="kind of motion")
    table: Annotated[
        RecordTable,
        PlainValidator(_record),
        PlainSerializer(path_of),
        WithJsonSchema({"type": "string", "minLength": 1}),
    ] = Field(description="accelerogram, relative to the scenario file: PEER AT2, or text or CSV of time and value")
    unit: Annotated[Unit, OneOf(get_args(Unit))] | None = Field(
        default=None, description="unit of the accelerations, g, m/s^2 or cm/s^2, where the file does not say it"
    )
    scale: q.Number = Field(default=1.0, description="factor on the accelerations; give this or pga")
    pga: Acceleration | None = Field(default=None, description="largest acceleration that the record is scaled to")
    baseline: Annotated[Baseline, OneOf(get_args(Baseline))] = Field(
        default="rest",
        description="correction of the accelerations: rest subtracts the straight line with which the supports end at "
        "rest where they began, parabolic the parabola that makes the velocities least in the mean square, none",
    )
    direction: q.Angle = Field(default=0.0, description="direction of the motion, counter-clockwise from +x")
    start: q.NonNegativeTime = Field(
        default=0.0, description="time at which the record's time is zero; the supports rest before"
    )

    @property
    def factor(self) -> float:
        """Factor from the table's values to m/s²."""
        return UNITS[self.unit] if self.table.unit is None and self.unit is not None else 1.0

    @model_validator(mode="after")
    def _has_one_unit_and_scale(self) -> Self:
        name, said = self.table.path.name, self.table.unit
        if said is None and self.unit is None:
            raise q.invalid(f'{name} does not say its unit; write unit = "g", "m/s^2" or "cm/s^2"', "table")
        if said is not None and self.unit not in (None, said):
            raise q.invalid(f"{q.shown(self.unit)}: {name} says {said}", "unit")
        if self.pga is not None and self.scale != 1.0:
            raise q.invalid("scale and pga are both given; one of them decides the accelerations", "pga")
        if self.pga is not None and not any(self.table.values):
            raise q.invalid(f"{self.table.path.name} is zero throughout; it cannot be scaled", "pga")
        return self
