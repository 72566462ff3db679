"""Lines of `blocksim check` about what happens in a run and what it records: driven bodies, events, loads, probes."""

import math
import textwrap
from collections.abc import Iterator, Sequence

from blocksim.cli.output import number, width_of_screen
from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.drives import drives_of, greatest_rate
from blocksim.scenario.events import in_order
from blocksim.scenario.models.history import Constant, Ramp
from blocksim.scenario.models.loads import AnyLoad, Force, Gravity, Horizontal, Moment, Pressure, VaryingLoad
from blocksim.scenario.models.probe import STEP, AnyProbe, EnergyProbe, ForceProbe, PointProbe
from blocksim.scenario.motion import settles
from blocksim.scenario.probes import probe_names
from blocksim.simulation.happened import in_words

MOST = 8  # lines of a kind
HEAD = 11  # columns: width of the names on the left
MILLI = 1e3
PREFIXES = ((1e6, "M"), (1e3, "k"))


def lines_of(scenario: Scenario) -> Iterator[str]:
    """Yield lines about everything in a scenario that acts, happens or is recorded; nothing where there is none."""
    yield from _driven(scenario)
    yield from _some("event", [*_events(scenario)])
    yield from _some("load", [f"{_name(load, number)}{_load(load)}" for number, load in enumerate(scenario.loads)])
    if settles(scenario):
        held = f"; held: {', '.join(scenario.start.hold)}" if scenario.start.hold else ""
        yield from _wrapped("start", f"settles before time zero{held}")
    names = probe_names(scenario)
    yield from _some("probe", [f"{name}: {_probe(one)}" for name, one in zip(names, scenario.probes, strict=True)])


def _some(head: str, lines: Sequence[str]) -> Iterator[str]:
    """Yield the first lines of a kind and how many more there are."""
    for line in lines[:MOST]:
        yield from _wrapped(head, line)
    if len(lines) > MOST:
        yield f"{'':<{HEAD}}and {len(lines) - MOST} more {head}s"


def _wrapped(head: str, text: str) -> list[str]:
    after = " " * HEAD
    return textwrap.wrap(text, width_of_screen(), initial_indent=f"{head:<{HEAD}}", subsequent_indent=f"{after}  ")


def _driven(scenario: Scenario) -> Iterator[str]:
    """Yield a line for every body with a motion of its own."""
    for drive in drives_of(scenario):
        spec = scenario.bodies[drive.body - sum(structure.size for structure in scenario.structures)]
        name = place_bodies(scenario)[drive.body].name
        kind = "" if spec.motion is None else f" ({spec.motion.kind})"
        speed, spin = greatest_rate(drive.shift), math.degrees(greatest_rate(drive.turn))
        rates = [f"{number(MILLI * speed)} mm/s"] * (speed > 0.0) + [f"{number(spin)} °/s"] * (spin > 0.0)
        rests = f", at rest from {drive.rest_time:.3f} s on" if math.isfinite(drive.rest_time) else ""
        yield f"driven     {name}{kind}, at most {' and '.join(rates)}{rests}"


def _events(scenario: Scenario) -> Iterator[str]:
    """Yield what happens, in its order."""
    for event in (scenario.events[k] for k in in_order(scenario.events)):
        yield f"{'at rest' if event.at is None else f'{event.at:.3f} s'}: {in_words(event)}"


def _name(load: AnyLoad, number: int) -> str:
    return f"{load.name or f'loads.{number}'}: "


def _load(load: AnyLoad) -> str:
    """Return what a load is, in words."""
    match load:
        case Gravity():
            return _tilting(load)
        case Force():
            axes = " of its axes" if load.axes == "body" else ""
            way = f"at {math.degrees(load.direction):g}°{axes}"
            text = f"force of {_in_unit(load.magnitude, 'N')} on {load.body}, {way}"
        case Moment():
            text = f"moment of {_in_unit(load.magnitude, 'N m')} on {load.body}"
        case Horizontal():
            text = f"{load.magnitude:g} g on all free blocks, horizontally"
        case Pressure(magnitude=None):
            text = f"water to {load.water_level or 0.0:g} m on {load.body}, {load.face} face"
        case _:
            text = f"{_in_unit(load.magnitude or 0.0, 'Pa')} on {load.body}, {load.face} face"
    return text + _history(load)


def _tilting(load: Gravity) -> str:
    if load.times:
        return f"gravity turns by {len(load.times)} samples until {load.times[-1]:g} s"
    begin = "" if load.first is None else f" from {math.degrees(load.first):g}°"
    rate = f"{math.degrees(load.rate or 0.0):g} °/s"
    return f"gravity turns{begin} to a tilt of {math.degrees(load.last or 0.0):g}° at {rate}"


def _history(load: VaryingLoad) -> str:
    match load.history:
        case Constant():
            return ""
        case Ramp() as ramp:
            return f"; factor {ramp.first:g} to {ramp.last:g} from {ramp.start:g} to {ramp.end:g} s"
        case other:
            return f"; {other.kind} of {len(other.times)} factors until {other.times[-1]:g} s"


def _in_unit(value: float, unit: str) -> str:
    factor, prefix = next(((size, name) for size, name in PREFIXES if abs(value) >= size), (1.0, ""))
    return f"{value / factor:.4g} {prefix}{unit}"


def _probe(probe: AnyProbe) -> str:
    """Return what a probe records and how often, in words."""
    match probe:
        case ForceProbe():
            text = f"force on {probe.on}" + ("" if probe.by is None else f" by {probe.by}")
        case PointProbe():
            text = f"point of {probe.body}"
        case EnergyProbe():
            text = "energies"
        case _:
            text = f"joint of {' and '.join(probe.bodies)}"
    if probe.every is None:
        return f"{text}, at every output time"
    return f"{text}, at every step" if probe.every == STEP else f"{text}, every {MILLI * float(probe.every):g} ms"
