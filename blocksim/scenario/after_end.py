"""What a scenario schedules after its end: it does not happen, or not all of it, and neither is a mistake by itself."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from blocksim.scenario import events, overrides, placement, spelling
from blocksim.scenario.models import actuators, loads, motion
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import RAMP_TIME

ROUND_OFF = 1e-9  # of the end: sums of times that are meant to be equal
MOST_NAMES = 8  # that a warning lists


def cut_off(scenario: Scenario) -> Iterator[str]:
    """Yield a warning for everything that begins at the end of the run or later, or is not complete by then."""
    end, found = scenario.time.end, dict[str, list[str]]()
    for key, begin, last in _spans(scenario):
        if begin >= end:
            found.setdefault(f"nothing changes before {begin:g} s", []).append(key)
        elif last > end * (1.0 + ROUND_OFF):
            found.setdefault(f"cut off, as complete only at {last:g} s", []).append(key)
    for what, keys in found.items():
        yield f"{spelling.list_names(keys, MOST_NAMES)}: {what}, but the run ends at time.end = {end:g} s"


def _spans(scenario: Scenario) -> Iterator[tuple[str, float, float]]:
    """Yield key, begin and end (s) of everything that changes over time, but what an event ends before."""
    ends: dict[str, float] = {}  # by the name of a load, an actuator or a body; at a rest that nobody knows, at once
    for event in scenario.events:
        for name in (*event.unload, *event.free, *event.remove):
            ends[name] = min(ends.get(name, math.inf), event.at or 0.0)
    if scenario.motion is not None:
        yield _of_motion("motion", scenario.motion)
    names = [load.name or "" for load in scenario.loads]
    courses = [loads.stretches_of(load, scenario.ground.tilt) for load in scenario.loads]
    named = [("loads", number, *one) for number, one in enumerate(zip(names, courses, strict=True))]
    paths = [actuators.stretches_of(one.displacement) for one in scenario.actuators]
    jacks = zip(events.actuator_names(scenario), paths, strict=True)
    named += [("actuators", number, *one) for number, one in enumerate(jacks)]
    for table, number, name, stretches in named:
        if moments := _moments(stretches):
            yield overrides.format_key((table, number)), moments[0], min(moments[-1], ends.get(name, math.inf))
    if any(body.motion for body in scenario.bodies):
        placed = placement.place_bodies(scenario)[-len(scenario.bodies) :]
        for number, (body, one) in enumerate(zip(scenario.bodies, placed, strict=True)):
            if body.motion is not None:
                key, begin, last = _of_motion(overrides.format_key(("bodies", number, "motion")), body.motion)
                yield key, begin, min(last, ends.get(one.name, math.inf))
    for number, soil in enumerate(placement.soil_tables(scenario)):
        if soil.start == "ramp":
            yield overrides.format_key(("soils", number, "start")), 0.0, RAMP_TIME


def _moments(stretches: Sequence[loads.Stretch]) -> list[float]:
    """Return the times (s) at which a value begins or ceases to change, or jumps; none where it is constant."""
    moments = []
    for one, after in pairwise(stretches):
        if one.rate or one.acceleration or one.jerk:
            moments += [one.start, after.start]
        elif one.value != after.value:
            moments.append(after.start)
    return moments


def _of_motion(key: str, moved: motion.AnyMotion | motion.AnyDrive) -> tuple[str, float, float]:
    """Return key, begin and end (s) of a motion; of one without an end those of its rise to the full amplitude."""
    match moved:
        case motion.Harmonic(duration=None):
            return f"{key}.ramp", moved.start, moved.start + moved.resolved_ramp
        case motion.FromTable() | motion.Record():
            return key, moved.start + moved.table.times[0], moved.start + moved.table.times[-1]
        case motion.Harmonic():
            return key, moved.start, moved.start + (moved.duration or 0.0)
        case _:
            return key, moved.start, moved.start + moved.resolved_duration
