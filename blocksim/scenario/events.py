"""Events of a scenario: their order, and those that cannot happen."""

from collections.abc import Iterator, Sequence

from blocksim.scenario import keys
from blocksim.scenario.findings import Finding
from blocksim.scenario.models.events import Event
from blocksim.scenario.models.loads import Gravity
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.quantities import shown
from blocksim.scenario.spelling import did_you_mean_or_list

MAX_EVENTS = 1000
GROUPS = ("remove", "fix", "free")
FREE, FIXED, DRIVEN, GONE = "free", "fixed", "driven", "removed"
RESULTS = {"remove": GONE, "fix": FIXED, "free": FREE}
MANY = 50
"""Names of bodies beyond which a message does not list them all."""


def wall_names(scenario: Scenario) -> list[str]:
    """Return the names of the walls, in the order of the file."""
    return [f"wall {number}" for number, _ in enumerate(scenario.walls, start=1)]


def in_order(events: Sequence[Event]) -> list[int]:
    """Return the numbers of events: those with a time by it, then those that wait for rest; else as in the file."""
    return sorted(range(len(events)), key=lambda number: (events[number].at is None, events[number].at or 0.0))


def impossible_events(scenario: Scenario, bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find events that cannot happen: in themselves, or after others."""
    if not scenario.events:
        return
    if len(scenario.events) > MAX_EVENTS:
        yield Finding(("events",), f"{len(scenario.events)} events are too many; at most {MAX_EVENTS} are allowed")
        return
    if scenario.systems:
        yield Finding(("events",), f"events are not available beside {', '.join(scenario.systems)}", at="key")
    found = [*_wrong_moments_and_names(scenario, [body.name for body in bodies]), *_wrong_unloads(scenario)]
    yield from found
    if not found:
        yield from _in_turn(scenario, bodies)


def _wrong_moments_and_names(scenario: Scenario, known: Sequence[str]) -> Iterator[Finding]:
    """Find what is wrong with single events by themselves."""
    walls = wall_names(scenario)
    for number, event in enumerate(scenario.events):
        path = ("events", number)
        if event.at is not None and event.at > scenario.time.end:
            message = f"{event.at:g} s is after the end of the run, time.end = {scenario.time.end:g} s"
            yield Finding((*path, "at"), message, relation=True)
        if event.when is not None and not scenario.time.stop_at_rest:
            yield Finding((*path, "when"), "rest is looked for only with time.stop_at_rest = true", relation=True)
        for place, name in _names(event, path):
            is_removed = place[2] == "remove"
            allowed = [*known, *walls] if is_removed else known
            if name in walls and not is_removed:
                yield Finding(place, f"{shown(name)} is a wall, which can only be removed")
            elif name not in set(allowed):
                hint = f", {did_you_mean_or_list(name, allowed)}" if len(allowed) <= MANY else ""
                yield Finding(place, f"there is no {'body or wall' if is_removed else 'body'} {shown(name)}{hint}")


def _wrong_unloads(scenario: Scenario) -> Iterator[Finding]:
    """Find loads to end that do not exist, cannot end, or end twice."""
    loads = {load.name: load for load in scenario.loads if load.name is not None}
    ends: dict[str, int] = {}
    for number in in_order(scenario.events):
        for place, name in enumerate(scenario.events[number].unload):
            path = ("events", number, "unload", place)
            if name not in loads:
                yield Finding(path, f"there is no load {shown(name)}, {did_you_mean_or_list(name, loads)}")
            elif isinstance(loads[name], Gravity):
                yield Finding(path, f"{shown(name)} is gravity, which does not end; a table of tilts turns it back")
            elif name in ends:
                yield Finding(path, f"{shown(name)} has ended already, by events.{ends[name]}")
            ends.setdefault(name, number)


def _names(event: Event, path: keys.KeyPath) -> Iterator[tuple[keys.KeyPath, str]]:
    """Yield all names in an event with their places."""
    for group in GROUPS:
        yield from (((*path, group, place), name) for place, name in enumerate(getattr(event, group)))
    if event.velocity is not None:
        yield (*path, "velocity", "body"), event.velocity.body


def _in_turn(scenario: Scenario, bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find what events before make impossible.

    Nobody knows whether a rest comes before or after a time: of what events of both kinds name, only that it goes once
    is checked.
    """
    start = {body.name: DRIVEN if body.driven else FIXED if body.fixed else FREE for body in bodies}
    start |= dict.fromkeys(wall_names(scenario), FIXED)
    timed, untimed = (
        {name for event in scenario.events if (event.at is not None) == is_timed for _, name in _names(event, ())}
        for is_timed in (True, False)
    )
    states: dict[str, tuple[str, int | None]] = {name: (state, None) for name, state in start.items()}
    for number in in_order(scenario.events):
        for place, name in _names(scenario.events[number], ("events", number)):
            message = _conflict(
                scenario, str(place[2]), name, states[name], number, is_sure=name not in timed & untimed
            )
            if message:
                yield Finding(place, message)
            states[name] = (RESULTS.get(str(place[2]), states[name][0]), number)


def _conflict(
    scenario: Scenario, action: str, name: str, present: tuple[str, int | None], number: int, *, is_sure: bool
) -> str:
    """Return why an event cannot do something to a body in a state, which another (None: the start) brought about."""
    state, cause = present
    is_new_velocity = action == "velocity" and state == FREE
    if cause is not None and _moment(scenario, cause) == _moment(scenario, number) and not is_new_velocity:
        return f"{shown(name)} is {state} at the same moment, by events.{cause}"
    since = "" if cause is None else f" since {_moment(scenario, cause)}, by events.{cause}"
    if state == GONE:
        return f"{shown(name)} is removed{since}" if is_sure or action == "remove" else ""
    if is_sure and RESULTS.get(action) == state:
        return f"{shown(name)} is {state} already{since}"
    if is_sure and action == "velocity" and state != FREE:
        return f"{shown(name)} is {state}{since}: free it first"
    return ""


def _moment(scenario: Scenario, number: int) -> str:
    event = scenario.events[number]
    return f"rest ({number})" if event.at is None else f"{event.at:g} s"
