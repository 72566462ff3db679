"""Acceleration pulses of the supports: sine, half-sine, rectangular, cosine."""

import math
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table

MOST_CYCLES = 1000.0
Shape = Literal["sine", "half-sine", "rectangular", "cosine"]
SINGLE = ("half-sine", "rectangular")
"""Shapes of half a cycle, which do not repeat."""
ABRUPT = ("rectangular", "cosine")
"""Shapes that begin at their largest acceleration."""
_SHAPES = OneOf(get_args(Shape))
_Cycles = Annotated[float, q.Quantity(q.NUMBER, above=0.0, at_most=MOST_CYCLES)]
Acceleration = Annotated[float, q.Quantity(q.ACCELERATION, above=0.0)]


class Pulse(Table):
    """Acceleration a(t) of the supports, which rest at t = `start` and before; a = 0 after the pulse.

    With the amplitude A, w = 2 pi frequency, t from the start: sine A sin wt and cosine A cos wt over `cycles`,
    half-sine A sin wt over half a cycle, rectangular A over half a cycle. The velocity that a half-sine (2 A/w), a
    rectangle (A duration) or an incomplete cycle leaves stays; a full sine leaves no velocity but the displacement
    2 pi A cycles/w^2, a full cosine neither.

    A cosine or rectangle at time zero finds blocks that have settled into it, as with `start.settle`, as far as
    friction carries its inertial force: see simulation/settling.py. One that begins later finds springs that carry
    none of it; run.json warns where that makes a slip too large.
    """

    kind: Literal["pulse"] = Field(description="kind of motion")
    shape: Annotated[Shape, _SHAPES] = Field(description="course of the acceleration")
    amplitude: Acceleration = Field(description="largest acceleration; 0.5 g is written as such")
    frequency: q.PositiveFrequency | None = Field(
        default=None, description="cycles per second; give this or duration (a half-sine, a rectangle: half a cycle)"
    )
    duration: q.PositiveTime | None = Field(default=None, description="duration of the whole pulse")
    cycles: _Cycles = Field(default=1.0, description="number of cycles of a sine or cosine, at most 1000")
    direction: q.Angle = Field(default=0.0, description="direction of positive acceleration, counter-clockwise from +x")
    start: q.NonNegativeTime = Field(default=0.0, description="start of the pulse; the supports rest before")

    @property
    def is_abrupt(self) -> bool:
        """Return True for a pulse that begins at its largest acceleration."""
        return self.shape in ABRUPT

    @property
    def resolved_cycles(self) -> float:
        """Number of cycles, one half of a half-sine or a rectangle."""
        return 0.5 if self.shape in SINGLE else self.cycles

    @property
    def resolved_duration(self) -> float:
        """Duration (s) of the whole pulse."""
        if self.duration is not None:
            return self.duration
        assert self.frequency is not None  # noqa: S101 - one of the two is there
        return self.resolved_cycles / self.frequency

    @property
    def cycle(self) -> float:
        """Time (s) of one cycle, whole or not."""
        return self.resolved_duration / self.resolved_cycles

    @property
    def angular_frequency(self) -> float:
        """Angular frequency w (rad/s)."""
        return 2.0 * math.pi * self.resolved_cycles / self.resolved_duration

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.frequency is None) == (self.duration is None):
            found = "neither is" if self.frequency is None else "both are"
            raise q.invalid(f"frequency or duration is needed; {found} given", "duration")
        if self.shape in SINGLE and self.cycles != 1.0:
            message = f'shape {q.shown(self.shape)} is a single half cycle; cycles belongs to "sine" and "cosine"'
            raise q.invalid(message, "cycles")
        return self
