"""Prescribed motion of single bodies: as that of the supports, or once from start to end along a line or about a point.

A driven body has friction and restitution at its faces as any other; forces do not move it, and [motion] does not
either. Two bodies neither of which is free do not touch.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table, require_one
from blocksim.scenario.models.motion import FromTable, Harmonic

Course = Literal["constant", "smooth"]
COURSES: tuple[Course, ...] = ("constant", "smooth")
MOST_BODY_TABLES = 16
"""Different tables of motion of bodies, which are copied into the folder of a run."""
STEEPEST = 15.0 / 8.0
"""Greatest speed of a smooth course over its mean."""
POSITIVE_SPIN = q.Quantity(q.SPIN, above=0.0)


class Ramp(Table):
    """Once over a distance: at constant speed, or smoothly, u = distance (10 s^3 - 15 s^4 + 6 s^5)."""

    kind: Literal["ramp"] = Field(description="kind of motion")
    distance: q.PositiveLength = Field(description="way from start to end")
    direction: q.Angle = Field(default=0.0, description="direction of the motion, counter-clockwise from +x")
    duration: q.PositiveTime | None = Field(default=None, description="time from start to end; give this or speed")
    speed: q.PositiveSpeed | None = Field(default=None, description="greatest speed; give this or duration")
    course: Annotated[Course, OneOf(COURSES)] = Field(
        default="constant", description="constant (at once at full speed) or smooth (starts and ends without a jerk)"
    )
    start: q.NonNegativeTime = Field(default=0.0, description="start of the motion; the body rests before")

    @model_validator(mode="after")
    def _duration_or_speed(self) -> Self:
        require_one("give duration or speed", duration=self.duration, speed=self.speed)
        return self

    @property
    def resolved_duration(self) -> float:
        """Time (s) from start to end."""
        return _duration(self.duration, self.distance, self.speed, self.course)


class Rotation(Table):
    """Once by an angle about a point, at constant spin or smoothly as a ramp."""

    kind: Literal["rotation"] = Field(description="kind of motion")
    angle: q.Angle = Field(description="turn from start to end, counter-clockwise positive")
    about: tuple[q.Length, q.Length] | None = Field(
        default=None, description="[x, y] of the point that it turns about (default: the centre of the body)"
    )
    duration: q.PositiveTime | None = Field(default=None, description="time from start to end; give this or spin")
    spin: Annotated[float, POSITIVE_SPIN] | None = Field(
        default=None, description="greatest angular velocity; give this or duration"
    )
    course: Annotated[Course, OneOf(COURSES)] = Field(
        default="constant", description="constant (at once at full spin) or smooth (starts and ends without a jerk)"
    )
    start: q.NonNegativeTime = Field(default=0.0, description="start of the motion; the body rests before")

    @model_validator(mode="after")
    def _duration_or_spin(self) -> Self:
        require_one("give duration or spin", duration=self.duration, spin=self.spin)
        if self.angle == 0.0:
            raise q.invalid("a turn by 0 is none", "angle")
        return self

    @property
    def resolved_duration(self) -> float:
        """Time (s) from start to end."""
        return _duration(self.duration, abs(self.angle), self.spin, self.course)


def _duration(duration: float | None, way: float, speed: float | None, course: Course) -> float:
    if duration is not None:
        return duration
    return way / (speed or math.nan) * (STEEPEST if course == "smooth" else 1.0)


AnyDrive = Annotated[Harmonic | FromTable | Ramp | Rotation, Field(discriminator="kind")]
"""Any prescribed motion of a body, distinguished by its `kind`."""
OWN_DRIVES: dict[str, type[Table]] = {"ramp": Ramp, "rotation": Rotation}
DRIVES: dict[str, type[Table]] = {"harmonic": Harmonic, "table": FromTable, **OWN_DRIVES}
"""Class by kind, as written in a scenario."""
