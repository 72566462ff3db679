"""Actuators, [[actuators]]: jacks that move a point of a body along a line, by a displacement over time.

An actuator is a spring and a dashpot between the point and a head that moves as prescribed, along a direction that
stays in space: force = stiffness (head - point) + damping (rate of the head - rate of the point). All other freedoms
of the body are its own. Its displacement is that of the point since time zero, after the blocks have settled. A table
of displacements is CSV:

    # test 3, head of the wall
    time_s,displacement_mm
    0.0,0
    60.0,30
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, get_args

from pydantic import ConfigDict, Field

from blocksim.scenario import units as q
from blocksim.scenario.models import base, geometry, loads
from blocksim.scenario.models.base import setting

Sense = Literal["both", "push", "pull"]


class RampPath(base.Table):
    """A displacement that grows evenly and stays."""

    model_config = ConfigDict(title="Ramp of displacement")

    kind: Literal["ramp"] = setting("kind of displacement over time")
    to: q.Length = setting("displacement at which the head stops; negative against the direction")
    rate: q.PositiveSpeed = setting("full speed of the head")
    start: q.NonNegativeTime = setting("time at which it begins to move", 0.0)

    def _check(self) -> None:
        if self.to == 0.0:
            raise q.invalid("an actuator that goes to 0 does not move", "to")


class Cycles(base.Table):
    """There, as far to the other side and back to zero, at one speed, with each amplitude in turn."""

    kind: Literal["cycles"] = setting("kind of displacement over time")
    amplitudes: tuple[q.PositiveLength, ...] = setting("amplitudes in their order")
    rate: q.PositiveSpeed = setting("full speed of the head")
    repeats: Annotated[int, base.Whole(1, 1000)] = setting("cycles of each amplitude", 1)
    start: q.NonNegativeTime = setting("time at which it begins to move", 0.0)

    def _check(self) -> None:
        if not self.amplitudes:
            raise q.invalid("the list of amplitudes is empty", "amplitudes")
        if 2 * self.repeats * len(self.amplitudes) > loads.MAX_ROWS:
            raise q.invalid(f"more than {loads.MAX_ROWS} turns of the head are too many", "amplitudes")


class PathTable(loads.Sampled):
    """Displacements at some times, joined by straight lines with rounded corners: of a CSV table, or as lists."""

    model_config = ConfigDict(title="Table of displacements")
    column, key = "displacement_mm", "displacements"
    kind: Literal["table"] = setting("kind of displacement over time")
    table: str | None = setting(
        "CSV table with the columns time_s and displacement_mm, relative to the scenario file", None
    )
    times: loads.Times = setting("times of the displacements, instead of a table", ())
    displacements: tuple[q.Length, ...] = setting("displacements at these times, instead of a table", ())


AnyPath = Annotated[RampPath | Cycles | PathTable, Field(discriminator="kind")]
"""Any displacement over time, distinguished by its `kind`."""
PATHS: dict[str, type[base.Table]] = base.by_kind(AnyPath)  # class by kind, as written in a scenario


class Actuator(base.Table):
    """One actuator."""

    name: base.Identifier | None = setting(
        "name of its record and in `--vary actuators.NAME.stiffness=…` (default: actuator and its number)", None
    )
    body: str = loads.BODY
    point: geometry.Point = setting("[x, y] of its point, from the centre of the body along its own axes", (0.0, 0.0))
    direction: q.Angle = setting("direction of its line, counter-clockwise from +x, which stays in space", 0.0)
    sense: Annotated[Sense, base.OneOf(get_args(Sense))] = setting(
        "force that it can exert: push, along the direction; pull, against it; or both", "both"
    )
    stiffness: q.Stiffness | None = setting(
        "spring between head and point (default: as stiff as the time step resolves well, see `blocksim check`)", None
    )
    displacement: AnyPath = setting("displacement of the head over time")


SPEEDING_UP = 0.2
"""Of the time that a way would take at full speed: as long the head speeds up, and slows down at its end."""


def stretches_of(path: AnyPath) -> tuple[loads.Stretch, ...]:
    """Return the displacement (m) of a head over time.

    Its speed rises and falls smoothly at both ends of every way, so that the masses that it moves are not struck.
    """
    match path:
        case RampPath():
            turns = [path.to]
        case Cycles():
            turns = [way for one in path.amplitudes for _ in range(path.repeats) for way in (one, -one)] + [0.0]
        case _:
            return _rounded(path.times, path.displacements)
    at, place = path.start, 0.0
    pieces = [loads.Stretch(0.0, 0.0, 0.0)] if at > 0.0 else []
    for turn in turns:
        way = turn - place
        even, rate = abs(way) / path.rate, math.copysign(path.rate, way)
        short = SPEEDING_UP * even
        pieces += _change(at, short, place, 0.0, rate)
        pieces.append(loads.Stretch(at + short, place + 0.5 * rate * short, rate))
        pieces += _change(at + even, short, turn - 0.5 * rate * short, rate, 0.0)
        at, place = at + even + short, turn
    return (*pieces, loads.Stretch(at, place, 0.0))


def _change(start: float, length: float, value: float, before: float, after: float) -> tuple[loads.Stretch, ...]:
    """Return the change of a rate (m/s) within a time (s): its acceleration grows evenly from zero and back to it."""
    half, gain = 0.5 * length, after - before
    middle = value + half * (before + gain / 6.0)
    return (
        loads.Stretch(start, value, before, 0.0, gain / half**2),
        loads.Stretch(start + half, middle, before + 0.5 * gain, gain / half, -gain / half**2),
    )


CORNER = 0.05
"""Of the shorter interval beside a time of a table: as long before it and after it the rate of the head changes."""


def _rounded(times: Sequence[float], values: Sequence[float]) -> tuple[loads.Stretch, ...]:
    """Return straight lines between values (m) at times (s) with curves in place of corners, at rest at both ends.

    The ways of the first and of the last interval are gone in a little less than their time.
    """
    first, last = (CORNER * (times[k] - times[k - 1]) for k in (1, -1))
    ends = [times[0], times[0] + first, *times[1:-1], times[-1] - last, times[-1]]
    turns = [values[0], values[0], *values[1:-1], values[-1], values[-1]]
    lines = [*pairwise(zip(ends, turns, strict=True))]
    pieces = [] if times[0] == 0.0 else [loads.Stretch(0.0, values[0], 0.0)]
    for ((begin, was), (at, value)), (_, (end, to)) in pairwise(lines):
        half = CORNER * min(at - begin, end - at) if times[0] < begin and end < times[-1] else min(at - begin, end - at)
        before, after = (value - was) / (at - begin), (to - value) / (end - at)
        pieces += _change(at - half, 2.0 * half, value - half * before, before, after)
        pieces.append(loads.Stretch(at + half, value + half * after, after))
    return (*pieces[:-1], loads.Stretch(times[-1], values[-1], 0.0))
