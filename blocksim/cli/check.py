"""blocksim check: validate a scenario and summarise it: its cost, what happens in it, its blocks and contacts."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Annotated

from blocksim.cli import command_line, output, prepare
from blocksim.errors import InvalidInputError
from blocksim.options import Option
from blocksim.scenario import (
    Model,
    PlacedBody,
    Scenario,
    events,
    motion,
    placement,
    resolution,
    scenario_to_toml,
    units,
)
from blocksim.scenario.models import actuators, loads, timeline
from blocksim.simulation.instruments import bytes_of_series
from blocksim.statics.blockwork import MOST_BLOCKS, Blockwork
from blocksim.study.rows import check_experiment
from blocksim.world import describe, excitation, free_memory, memory

MOST_BODIES = 12
MOST_LINES = 8  # of events, loads or probes
SIDES = ("along x", "upright", "depth mm", "mass kg", "inertia kg m²")
PAIR_COLUMNS = {
    "μs": ("static_friction", ".3g"),
    "μk": ("kinetic_friction", ".3g"),
    "e": ("restitution", ".3g"),
    "ζ": ("normal_damping_ratio", ".3f"),
    "ζ shear": ("shear_damping_ratio", ".3f"),
    "K": ("normal_stiffness", ".2e"),
    "k/K": ("shear_stiffness_ratio", ".3f"),
}
IMPACTS = {
    "simultaneous": "those of one substep happen all at once",
    "sequential": "one after the other; steps are cut at impacts",
}
LEAST_ROOM = 24
HEAD = 11  # columns: width of the names on the left
FAR_APART = 10.0  # steps of blocks and of systems beside them that are told with a cure
HARD_SPACE = "\N{NO-BREAK SPACE}"
USUAL_SPEED = 0.6  # m/s, the root of gravity times a side of some centimetres, for which defaults are chosen
UNSCALED = ("step", "rest_speed", "rest_hold", "velocity_tolerance", "restitution_threshold", "transition_speed")
MILLI = 1e3
MICRO = 1e6
PREFIXES = ((1e6, "M"), (1e3, "k"))


def check_command(
    source: prepare.ScenarioInput,
    *,
    resolved: Annotated[bool, Option("Print the resolved scenario instead: every value, in SI.")] = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Validate a scenario and summarise it.

    Prints time step and cost, then masses, inertias, contact parameters and the keys that set them. Nothing is run;
    with --quiet only mistakes are printed. --resolved prints a scenario file with every value that a run will use.

    Example: blocksim check scenarios/three_blocks.toml
    """
    with source.built() as ready:
        description = describe.describe(ready)
    of_table = check_experiment(ready)
    if screen.as_json:
        bodies = [{**body._asdict(), "mass": body.mass, "inertia": body.inertia} for body in description.bodies]
        data = {**asdict(replace(description, bodies=())), "bodies": bodies}
        return command_line.Report(data={"scenario": ready.scenario.model_dump(mode="json", by_alias=True), **data})
    if resolved:
        return command_line.Report([scenario_to_toml(ready.scenario)])
    if screen.quiet:
        return command_line.Report()
    tables = [list(_summary(ready, description))]
    if description.bodies:
        tables += [_bodies(description.bodies), _pairs(ready.scenario, description.pairs), _rules(description.pairs)]
    lines = "\n\n".join("\n".join(table) for table in tables)
    warnings = [*ready.implausible_values, *description.warnings, *of_table]
    notes = [*(f"warning: {text}" for text in warnings), f"{ready.scenario.name}: valid"]
    return command_line.Report([lines], notes=notes)


def _summary(model: Model, description: describe.Description) -> Iterator[str]:
    """Yield time step, cost and size, and everything that acts, happens or is recorded."""
    scenario = model.scenario
    yield f"time step  {description.step:.3e} s, at most {description.steps} steps"
    yield from _limits(description.limits)
    rigid = description.rigid
    if rigid is not None:
        yield f"           {rigid.why}"
        yield f"           in {rigid.substeps} substeps; manual limit {rigid.longest_step:.1e} s"
        yield from (f"           {line}" for line in _solving(rigid))
        yield f"           defaults of these follow from {len(description.bodies)} blocks, {rigid.free} of them free"
        yield f"impacts    {rigid.impacts}: {IMPACTS[rigid.impacts]}"
        sag = f"{MICRO * rigid.sag:.3g} µm at rest, block {rigid.block}"
        yield f"sag        {sag}: numerical, proportional to step squared"
        if rigid.warning:
            yield f"warning: {rigid.warning}"
    if scenario.strength.factor != 1.0:
        yield f"strength   {' and '.join(scenario.strength.of)} divided by {scenario.strength.factor:g}"
    yield from _unscaled(scenario, description.bodies)
    yield from _statics(model)
    until_rest = ", less if it stops at rest" if scenario.time.stop_at_rest else ""
    yield f"solving    at most about {output.duration(description.seconds)} on one core{until_rest}"
    program = free_memory.readable(memory.PROCESS_BYTES)
    yield f"memory     about {free_memory.readable(description.memory)}, of which {program} for the program itself"
    size = description.bytes + bytes_of_series(model, description.steps, description.step, memory.FRAME_VALUES)
    yield f"results    at most {description.frames} frames, about {free_memory.readable(size)}"
    if description.frames_at_every_step:
        yield f"           output.every = {scenario.output.every:.3g} s is shorter than a step: a frame at every step"
    support = description.motion
    if support is not None:
        peaks = f"{output.number(MILLI * support.displacement)} mm, {output.number(MILLI * support.speed)} mm/s"
        greatest = f"at most {peaks} and {output.number(support.acceleration / units.STANDARD_GRAVITY)} g"
        yield f"supports   move {greatest}; {output.number(MILLI * support.final_speed)} mm/s at the end"
    yield from _acting(model, description.step)
    if rigid is None:
        yield f"boundary   {description.particles} particles ({_use_of_particles(scenario)})"
    yield from (f"{name:<10} {count} particles or elements" for name, count in description.systems.items())
    yield f"neighbours checked up to {MILLI * description.skin:.3g} mm apart"


def _solving(rigid: describe.SagDescription) -> Iterator[str]:
    """Yield when the iterations of a substep end; that is all that is known before a run."""
    if rigid.velocity_sweeps == 1:
        yield "each with one iteration over all contacts, whatever that leaves"
        return
    yield f"each until no impulse changes a velocity by {MILLI * rigid.tolerance:g} mm/s,"
    yield f"after {rigid.velocity_sweeps} iterations at most"
    if rigid.tolerance > rigid.fall:
        yield f"gravity does {MILLI * rigid.fall:.2g} mm/s: one iteration passes, friction may lag"


def _limits(limits: describe.StepLimits | None) -> list[str]:
    """Return who decides the step; where the two are far apart, what makes them equal."""
    if limits is None:
        return []
    if not math.isfinite(limits.blocks):
        return [f"           that of {limits.systems:.2e} s of the systems beside the blocks"]
    steps = f"blocks allow {limits.blocks:.2e} s, the systems beside them {limits.systems:.2e} s"
    ratio = limits.blocks / limits.systems
    if 1.0 / FAR_APART < ratio < FAR_APART:
        return [f"           {steps}"]
    who = "blocks" if ratio < 1.0 else "systems beside the blocks"
    more = f"{max(ratio, 1.0 / ratio):.0f} times as many steps as without them"
    use = "makes both equal" if limits.advised == limits.scale else "is the least with which blocks sink little"
    cure = f"contact.stiffness_scale = {limits.advised:.1g} {use}"
    return [f"           {steps}", f"warning: because of the {who} {more}:", f"         {cure}"]


def _statics(model: Model) -> Iterator[str]:
    """Yield whether an equilibrium of the blocks is possible as they are placed, where statics has an answer."""
    if len(model.bodies) > MOST_BLOCKS:
        return
    with suppress(InvalidInputError):
        blocks = Blockwork.of(model)
        from blocksim.statics.programme import horizontal_margin

        margins = horizontal_margin(blocks)
        if margins is None:
            yield "statics    no equilibrium: it cannot stand as it is placed"
            return
        margin, estimate = margins
        yield "statics    an equilibrium is possible; whether it is reached, runs decide"
        if math.isfinite(margin):
            yield f"           up to a horizontal acceleration of {margin:.3g} g at most"
        else:
            about = f", at about {estimate:.3g} g (an estimate)" if math.isfinite(estimate) else ""
            yield "           statics sets no bound on a horizontal acceleration: joints that slip"
            yield f"           without opening may give way{about}"


def _unscaled(scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[str]:
    """Yield which defaults of speeds and times the scenario leaves, where its blocks are far from centimetres."""
    speed = math.sqrt(scenario.gravity.size * placement.smallest_width(body for body in placed if not body.fixed))
    if not 0.0 < speed < math.inf or 1.0 / FAR_APART < speed / USUAL_SPEED < FAR_APART:
        return
    tables = {"time": scenario.time}
    tables |= {f"friction.{name}": pair for name, pair in scenario.friction if pair.kinetic < pair.static}
    left = [
        f"{name}.{key}"
        for name, table in tables.items()
        for key in UNSCALED[int(scenario.time.has_springs) :]  # their step scales
        if key in type(table).model_fields and key not in table.model_fields_set
    ]
    if left:
        why = f"made for blocks of centimetres; here √(gravity · least side) is {output.number(speed)} m/s"
        yield from _some("defaults", [f"of {', '.join(left)} are {why}"])


def _use_of_particles(scenario: Scenario) -> str:
    contact = scenario.contact
    match contact.model:
        case "surface":
            return "the surface model uses those at the corners"
        case "kernel":
            return f"{contact.kernel}, smoothing length {output.number(MILLI * contact.resolved_smoothing_length)} mm"
        case _:
            return f"at most {output.number(MILLI * contact.particle_spacing)} mm apart"


def _acting(model: Model, step: float) -> Iterator[str]:
    """Yield lines about driven bodies, events, loads, actuators, the start and probes, the first ones of many.

    `step` (s) is that of the run.
    """
    scenario, placed = model.scenario, model.bodies
    for drive in model.drives:
        spec = scenario.bodies[drive.body - len(placed) + len(scenario.bodies)]
        kind = "" if spec.motion is None else f" ({spec.motion.kind})"
        speed, spin = motion.greatest_rate(drive.shift), math.degrees(motion.greatest_rate(drive.turn))
        rates = [f"{output.number(MILLI * speed)} mm/s"] * (speed > 0.0) + [f"{output.number(spin)} °/s"] * (spin > 0.0)
        rests = f", at rest from {drive.rest_time:.3f} s on" if math.isfinite(drive.rest_time) else ""
        yield f"driven     {placed[drive.body].name}{kind}, at most {' and '.join(rates)}{rests}"
    ordered = [scenario.events[k] for k in events.in_order(scenario.events)]
    times = ["at rest" if one.at is None else f"{one.at:.3f} s" for one in ordered]
    yield from _some("event", [f"{at}: {events.describe_event(one)}" for at, one in zip(times, ordered, strict=True)])
    names = [load.name or f"loads.{number}" for number, load in enumerate(scenario.loads)]
    yield from _some("load", [f"{name}: {_load(load)}" for name, load in zip(names, scenario.loads, strict=True)])
    springs = excitation.springs_of(model, step)
    jacks = zip(events.actuator_names(scenario), scenario.actuators, springs, strict=True)
    yield from _some("actuator", [f"{name}: {_actuator(one, spring)}" for name, one, (spring, _) in jacks])
    if model.settles:
        held = f"; held: {', '.join(scenario.start.hold)}" if scenario.start.hold else ""
        yield from _some("start", [f"settles before time zero{held}"])
    yield from _some("probe", [f"{name}: {_probe(one)}" for name, one in model.probes.items()])


def _some(head: str, lines: Sequence[str]) -> Iterator[str]:
    """Yield the first lines of a kind and how many more there are."""
    first, others = f"{head:<{HEAD}}", f"{'':<{HEAD}}  "
    for line in lines[:MOST_LINES]:
        yield from textwrap.wrap(line, output.width_of_screen(), initial_indent=first, subsequent_indent=others)
    if len(lines) > MOST_LINES:
        yield f"{'':<{HEAD}}and {len(lines) - MOST_LINES} more {head}s"


def _pressed(load: loads.Pressure) -> str:
    """Return what a pressure acts on, in words."""
    return f"{load.body}, {load.face} face" if load.body else f"structure {load.structure}, {load.face} side"


def _load(load: loads.AnyLoad) -> str:
    """Return what a load is, in words."""
    match load:
        case loads.Gravity() if load.times:
            return f"gravity turns by {len(load.times)} samples until {load.times[-1]:g} s"
        case loads.Gravity():
            begin = "" if load.first is None else f" from {math.degrees(load.first):g}°"
            rate = f"{math.degrees(load.rate or 0.0):g} °/s"
            return f"gravity turns{begin} to a tilt of {math.degrees(load.last or 0.0):g}° at {rate}"
        case loads.Force():
            axes = " of its axes" if load.axes == "body" else ""
            way = f"at {math.degrees(load.direction):g}°{axes}"
            text = f"force of {_in_unit(load.magnitude, 'N')} on {load.body}, {way}"
        case loads.Moment():
            text = f"moment of {_in_unit(load.magnitude, 'N m')} on {load.body}"
        case loads.Horizontal():
            text = f"{load.magnitude:g} g on all free blocks, horizontally"
        case loads.Pressure(magnitude=None):
            text = f"water to {load.water_level or 0.0:g} m on {_pressed(load)}"
        case _:
            text = f"{_in_unit(load.magnitude or 0.0, 'Pa')} on {_pressed(load)}"
    match load.history:
        case loads.Constant():
            return text
        case loads.RampHistory() as ramp:
            return f"{text}; factor {ramp.first:g} to {ramp.last:g} from {ramp.start:g} to {ramp.end:g} s"
        case other:
            return f"{text}; {other.kind} of {len(other.times)} factors until {other.times[-1]:g} s"


def _in_unit(value: float, unit: str) -> str:
    factor, prefix = next(((size, name) for size, name in PREFIXES if abs(value) >= size), (1.0, ""))
    return f"{value / factor:.4g} {prefix}{unit}"


def _actuator(one: actuators.Actuator, stiffness: float) -> str:
    """Return what an actuator does, in words, with its stiffness (N/m)."""
    path = one.displacement
    verb = {"both": "moves", "push": "pushes", "pull": "pulls"}[one.sense]
    text = f"{verb} {one.body} at {math.degrees(one.direction):g}°"
    match path:
        case actuators.RampPath():
            text = f"{text}, to {MILLI * path.to:g} mm at {MILLI * path.rate:g} mm/s"
        case actuators.Cycles():
            most = f"{MILLI * max(path.amplitudes):g} mm at {MILLI * path.rate:g} mm/s"
            text = f"{text}, {path.repeats * len(path.amplitudes)} cycles up to {most}"
        case _:
            text = f"{text}, by {len(path.times)} displacements"
    given = "" if one.stiffness is not None else ", which follows from the step"
    until = actuators.stretches_of(path)[-1].start
    return f"{text} until {until:.4g} s; {1e-6 * stiffness:.4g} kN/mm{given}"


def _probe(probe: timeline.AnyProbe) -> str:
    """Return what a probe records and how often, in words."""
    match probe:
        case timeline.ForceProbe():
            text = f"force on {probe.on}" + ("" if probe.by is None else f" by {probe.by}")
        case timeline.PointProbe():
            text = f"point of {probe.body}"
        case timeline.EnergyProbe():
            text = "energies"
        case timeline.ActuatorProbe():
            text = f"force, displacement and work of {probe.actuator}"
        case _:
            text = f"joint of {' and '.join(probe.bodies)}"
    if probe.every is None:
        return f"{text}, at every output time"
    often = "at every step" if probe.every == timeline.STEP else f"every {MILLI * float(probe.every):g} ms"
    return f"{text}, {often}"


def _bodies(bodies: Sequence[PlacedBody]) -> list[str]:
    """List every block; of more than MOST_BODIES list the kinds, their numbers and the range of the centres."""
    if len(bodies) <= MOST_BODIES:
        cells = [
            (one.name, output.number(MILLI * one.x), output.number(MILLI * one.y), *_side_cells(one)) for one in bodies
        ]
        return output.table_lines(("block", "x mm", "y mm", *SIDES), cells)
    counts = Counter(body.block for body in bodies)
    kinds = {body.block: body for body in bodies}
    common = counts.most_common(MOST_BODIES)
    rows = [(name, str(count), *_side_cells(kinds[name])) for name, count in common]
    more = [f"... and {len(counts) - len(common)} more kinds"] if len(counts) > len(common) else []
    ends = {axis: [MILLI * getattr(body, axis) for body in bodies] for axis in ("x", "y")}
    spans = (f"{axis} {output.number(min(places))} to {output.number(max(places))} mm" for axis, places in ends.items())
    fixed = sum(body.fixed for body in bodies)
    still = f", {fixed} of them fixed" if fixed else ""
    return [
        *output.table_lines(("kind", "blocks", *SIDES), rows),
        *more,
        f"{len(bodies)} blocks{still}",
        f"centres at {', '.join(spans)}",
    ]


def _side_cells(body: PlacedBody) -> tuple[str, ...]:
    lengths = (body.size_x, body.size_y, body.depth)
    return (*(output.number(MILLI * v) for v in lengths), f"{body.mass:.5g}", f"{body.inertia:.5g}")


def _pairs(scenario: Scenario, pairs: Sequence[describe.PairDescription]) -> list[str]:
    """List the contact parameters of each pair of materials, and what the heads mean."""
    heads = [head for head, (name, _) in PAIR_COLUMNS.items() if getattr(pairs[0], name) is not None]
    if all(pair.shear_damping_ratio == pair.normal_damping_ratio for pair in pairs):
        heads = [head for head in heads if head != "ζ shear"]
    shown = [PAIR_COLUMNS[head] for head in heads]
    rows = [[pair.pair, *(format(getattr(pair, name), form) for name, form in shown)] for pair in pairs]
    table = output.table_lines(("pair", *heads), rows)
    if pairs[0].normal_damping_ratio is None:
        return [
            *table,
            "μs static and μk kinetic friction, e restitution; rigid contacts: K in N/m is",
            "the stiffness of one contact point (a face has two) at rest, for this step",
        ]
    points = "a face has two" if scenario.contact.model == "surface" else "the particles of a face share 2 K"
    return [
        *table,
        "μs static and μk kinetic friction, e restitution, ζ damping ratio, k/K in shear,",
        f"K stiffness in {pairs[0].stiffness_unit} of one contact point ({points})",
    ]


def _rules(pairs: Sequence[describe.PairDescription]) -> list[str]:
    """List the keys of the scenario that set values, with their pairs; the rest follows defaults and materials."""
    found: dict[str, dict[str, None]] = {}
    for pair in pairs:
        for key in pair.rules.values():
            if key not in {resolution.DEFAULT, resolution.MATERIALS}:
                found.setdefault(key, {})[" - ".join(pair.materials).replace(" ", HARD_SPACE)] = None
    room = max(LEAST_ROOM, output.width_of_screen() - len(output.GAP) - max(map(len, found), default=0))
    rows = [
        ("" if i else key, line.replace(HARD_SPACE, " "))
        for key in sorted(found, key=lambda key: not key.startswith("pairs."))
        for i, line in enumerate(textwrap.wrap(", ".join(found[key]), room))
    ]
    lines = output.table_lines(("set by", "for"), rows, left=2) if found else []
    of_springs = "" if pairs[0].normal_damping_ratio is None else "; stiffness from E and ν of the materials"
    return [*lines, f"other values: defaults{of_springs}"]
