"""Events and probes of a scenario: their order and names, joints between bodies, and what cannot be."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.scenario import overrides, spelling
from blocksim.scenario.geometry import Corner, dot, edges_of
from blocksim.scenario.mistakes import Mistake, repetitions, unknown
from blocksim.scenario.models.loads import AnyLoad, Gravity
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.timeline import ActuatorProbe, AnyProbe, Event, ForceProbe, JointProbe, PointProbe
from blocksim.scenario.placement import TOLERANCE, PlacedBody
from blocksim.scenario.units import toml

if TYPE_CHECKING:
    from blocksim.scenario.models.actuators import Actuator

MAX_EVENTS = 1000
GROUPS = ("remove", "fix", "free")
FREE, FIXED, DRIVEN, GONE = "free", "fixed", "driven", "removed"
RESULTS = {"remove": GONE, "fix": FIXED, "free": FREE}
LISTED = 6  # names of bodies that a line about an event has; of more it has the number
RATES = {"vx": "m/s", "vy": "m/s", "spin": "rad/s"}
MANY = 50  # names of bodies beyond which a message does not list them all


def wall_names(scenario: Scenario) -> list[str]:
    """Return the names of the walls, in the order of the file."""
    return [f"wall {number}" for number, _ in enumerate(scenario.walls, start=1)]


def in_order(events: Sequence[Event]) -> list[int]:
    """Return the numbers of events: those with a time by it, then those that wait for rest; else as in the file."""
    return sorted(range(len(events)), key=lambda number: (events[number].at is None, events[number].at or 0.0))


def describe_event(event: Event) -> str:
    """Return what an event does."""
    parts = [
        f"{', '.join(names) if len(names) <= LISTED else f'{len(names)} bodies'} {done}"
        for names, done in ((event.remove, "removed"), (event.fix, "fixed"), (event.free, "freed"))
        if names
    ]
    if event.unload:
        parts.append(f"{'load' if len(event.unload) == 1 else 'loads'} {', '.join(event.unload)} ended")
    if event.velocity is not None:
        rates = ((name, getattr(event.velocity, name), unit) for name, unit in RATES.items())
        values = ", ".join(f"{name} {value:g} {unit}" for name, value, unit in rates if value is not None)
        parts.append(f"{event.velocity.body} gets {values}")
    return "; ".join(parts)


def impossible_events(scenario: Scenario, bodies: Sequence[PlacedBody]) -> Iterator[Mistake]:
    """Find events that cannot happen: in themselves, or after others."""
    if len(scenario.events) > MAX_EVENTS:
        yield Mistake(("events",), f"{len(scenario.events)} events are too many; at most {MAX_EVENTS} are allowed")
        return
    if scenario.events and scenario.systems:
        yield Mistake(("events",), f"events are not available beside {', '.join(scenario.systems)}", at="key")
    found = [*_wrong_moments_and_names(scenario, [body.name for body in bodies]), *_wrong_unloads(scenario)]
    yield from found
    if not found:
        yield from _in_turn(scenario, bodies)


def _wrong_moments_and_names(scenario: Scenario, known: Sequence[str]) -> Iterator[Mistake]:
    """Find what is wrong with single events by themselves."""
    walls = wall_names(scenario)
    for number, event in enumerate(scenario.events):
        path = ("events", number)
        if event.at is not None and event.at > scenario.time.end:
            message = f"{event.at:g} s is after the end of the run, time.end = {scenario.time.end:g} s"
            yield Mistake((*path, "at"), message, relation=True)
        if event.when is not None and not scenario.time.stop_at_rest:
            yield Mistake((*path, "when"), "rest is looked for only with time.stop_at_rest = true", relation=True)
        for place, name in _names(event, path):
            is_removed = place[2] == "remove"
            allowed = [*known, *walls] if is_removed else known
            if name in walls and not is_removed:
                yield Mistake(place, f"{toml(name)} is a wall, which can only be removed")
            elif name not in set(allowed):
                hint = f", {spelling.did_you_mean_or_list(name, allowed)}" if len(allowed) <= MANY else ""
                yield Mistake(place, f"there is no {'body or wall' if is_removed else 'body'} {toml(name)}{hint}")


def _wrong_unloads(scenario: Scenario) -> Iterator[Mistake]:
    """Find loads to end that do not exist, cannot end, or end twice."""
    loads: dict[str, AnyLoad | Actuator] = {load.name: load for load in scenario.loads if load.name is not None}
    loads |= dict(zip(actuator_names(scenario), scenario.actuators, strict=True))
    ends: dict[str, int] = {}
    for number in in_order(scenario.events):
        for place, name in enumerate(scenario.events[number].unload):
            path = ("events", number, "unload", place)
            if name not in loads:
                yield Mistake(path, f"there is no load {toml(name)}, {spelling.did_you_mean_or_list(name, loads)}")
            elif isinstance(loads[name], Gravity):
                yield Mistake(path, f"{toml(name)} is gravity, which does not end; a table of tilts turns it back")
            elif name in ends:
                yield Mistake(path, f"{toml(name)} has ended already, by events.{ends[name]}")
            ends.setdefault(name, number)


def _names(event: Event, path: overrides.KeyPath) -> Iterator[tuple[overrides.KeyPath, str]]:
    """Yield all names in an event with their places."""
    for group in GROUPS:
        yield from (((*path, group, place), name) for place, name in enumerate(getattr(event, group)))
    if event.velocity is not None:
        yield (*path, "velocity", "body"), event.velocity.body


def _in_turn(scenario: Scenario, bodies: Sequence[PlacedBody]) -> Iterator[Mistake]:
    """Find what events before make impossible.

    Nobody knows whether a rest comes before or after a time: of what events of both kinds name, only that it goes once
    is checked.
    """
    states: dict[str, tuple[str, int | None]]
    states = {body.name: (DRIVEN if body.driven else FIXED if body.fixed else FREE, None) for body in bodies}
    states |= dict.fromkeys(wall_names(scenario), (FIXED, None))
    moments = [f"rest ({i})" if one.at is None else f"{one.at:g} s" for i, one in enumerate(scenario.events)]
    timed, untimed = (
        {name for event in scenario.events if (event.at is not None) == is_timed for _, name in _names(event, ())}
        for is_timed in (True, False)
    )
    for number in in_order(scenario.events):
        for place, name in _names(scenario.events[number], ("events", number)):
            action, (state, cause), is_sure = place[2], states[name], name not in timed & untimed
            since = "" if cause is None else f" since {moments[cause]}, by events.{cause}"
            message = ""
            if cause is not None and moments[cause] == moments[number] and (action, state) != ("velocity", FREE):
                message = f"{toml(name)} is {state} at the same moment, by events.{cause}"
            elif state == GONE:
                message = f"{toml(name)} is removed{since}" if is_sure or action == "remove" else ""
            elif is_sure and RESULTS.get(str(action)) == state:
                message = f"{toml(name)} is {state} already{since}"
            elif is_sure and action == "velocity" and state != FREE:
                message = f"{toml(name)} is {state}{since}: free it first"
            if message:
                yield Mistake(place, message)
            states[name] = (RESULTS.get(str(action), state), number)


GROUND, WALL, WALLS, SUPPORTS = "ground", "wall", "walls", "supports"
LEAST_ANGLE = 1.0
PARALLEL = math.sin(math.radians(LEAST_ANGLE))
"""Sine of the angle between two faces up to which they make a joint: corners of drawings are rounded."""
LEAST_SHARE = 1e-6
"""Of the smallest width of both: what faces share at least, and by how much they may overlap across."""


def actuator_names(scenario: Scenario) -> list[str]:
    """Return the names of all actuators; one without a name is called by its number from 1."""
    return [one.name or f"actuator{number}" for number, one in enumerate(scenario.actuators, start=1)]


def _probe_names(scenario: Scenario) -> list[str]:
    """Return the names of the probes of the file; one without a name is called by its kind and its number from 1."""
    return [probe.name or f"{probe.kind}{number}" for number, probe in enumerate(scenario.probes, start=1)]


def probes_of(scenario: Scenario) -> dict[str, AnyProbe]:
    """Return all probes by name: those of the file, and one of every actuator by its name, unless the file has that."""
    actuators = {name: ActuatorProbe(kind="actuator", actuator=name) for name in actuator_names(scenario)}
    own = dict(zip(_probe_names(scenario), scenario.probes, strict=True))
    return own | {name: probe for name, probe in actuators.items() if name not in own}


def unfit_probes(scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[Mistake]:
    """Find names given twice, bodies and supports that do not exist, and bodies without a joint."""
    names = _probe_names(scenario)
    for number in repetitions(names):
        yield Mistake(("probes", number, "name"), f"two probes are named {toml(names[number])}")
    jacks = actuator_names(scenario)
    bodies = {body.name: body for body in placed}
    others = [str(name) for tables in scenario.systems.values() for one in tables if (name := getattr(one, "name", ""))]
    known = [*bodies, GROUND, SUPPORTS, *([WALLS] if scenario.walls else []), *wall_names(scenario), *others]
    for number, probe in enumerate(scenario.probes):
        path = ("probes", number)
        if names[number] in jacks and getattr(probe, "actuator", None) != names[number]:
            yield Mistake((*path, "name"), f"{toml(names[number])} is the name of an actuator, whose record has it")
        match probe:
            case ForceProbe():
                for key in ("on", "by"):
                    yield from unknown((*path, key), "body", known, getattr(probe, key))
                if probe.by == probe.on:
                    yield Mistake((*path, "by"), f"{toml(probe.by)} exerts no force on itself")
            case PointProbe():
                yield from unknown((*path, "body"), "body", bodies, probe.body)
            case ActuatorProbe():
                yield from unknown((*path, "actuator"), "actuator", jacks, probe.actuator)
            case JointProbe():
                for place, name in enumerate(probe.bodies):
                    yield from unknown((*path, "bodies", place), "body", bodies, name)
                if bodies.keys() >= {*probe.bodies} and joint_between(*(bodies[name] for name in probe.bodies)) is None:
                    faces = f"faces that lie opposite each other at the start, parallel within {LEAST_ANGLE:g} deg"
                    yield Mistake((*path, "bodies"), f"bodies {probe.bodies[0]} and {probe.bodies[1]} have no {faces}")


class Joint(NamedTuple):
    """A joint between bodies a and b at the start, in the own axes of each (m).

    Its two ends as points of a and of b, straight across the gap that there is at each of them, the outward normal of
    a's face, and the tangent along it, which is the normal turned by -90 degrees: towards +x where b lies on a. The
    first end is the one farther back along the tangent.
    """

    ends_of_a: tuple[Corner, Corner]
    ends_of_b: tuple[Corner, Corner]
    normal: Corner
    tangent: Corner


def joint_between(a: PlacedBody, b: PlacedBody) -> Joint | None:
    """Return the joint between the faces of two bodies that lie opposite each other, None where none do.

    The faces are parallel but for `PARALLEL`, and overlap along each other. Of several such pairs that with the widest
    gap is the joint.
    """
    joints = (_facing(a, b, *edge) for edge in edges_of(a.corners))
    return max((one for one in joints if one is not None), key=lambda one: one[0], default=(0.0, None))[1]


def _facing(a: PlacedBody, b: PlacedBody, begin: Corner, end: Corner, normal: Corner) -> tuple[float, Joint] | None:
    """Return the least gap (m) and the joint between a face of a and the face of b opposite it."""
    faces = edges_of([a.own_point(*b.ground_point(*corner)) for corner in b.corners])
    *opposite, (nx, ny) = min(faces, key=lambda edge: dot(edge[2], normal))
    if abs(nx * normal[1] - ny * normal[0]) > PARALLEL:
        return None
    tangent = (normal[1], -normal[0])
    across, along = np.array(opposite) @ np.array(normal), np.array(opposite) @ np.array(tangent)
    half = dot(begin, normal)
    first, last = max(float(along.min()), dot(end, tangent)), min(float(along.max()), dot(begin, tangent))
    smallest = min(a.least_width, b.least_width)
    order = np.argsort(along)
    gaps = (np.interp((first, last), along[order], across[order]) - half).tolist()
    if min(gaps) < -max(TOLERANCE, LEAST_SHARE * smallest) or last - first < LEAST_SHARE * smallest:
        return None
    ends = [(half * normal[0] + s * tangent[0], half * normal[1] + s * tangent[1]) for s in (first, last)]
    places = [(x + gap * normal[0], y + gap * normal[1]) for (x, y), gap in zip(ends, gaps, strict=True)]
    of_b = [b.own_point(*a.ground_point(*point)) for point in places]
    return min(gaps), Joint((ends[0], ends[1]), (of_b[0], of_b[1]), normal, tangent)
