"""Everything that must hold before a scenario may be used, and warnings of values that are hardly meant."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cache, partial
from itertools import islice, pairwise
from math import dist, inf
from pathlib import Path
from statistics import median
from typing import cast, get_args

from pydantic import ValidationError

from blocksim.scenario import events, geometry, mistakes, overlap, overrides, placement, spelling, start, units
from blocksim.scenario.models import actuators, base, contact, loads, motion, study, timeline
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import RAMP_TIME
from blocksim.scenario.structures import polygons
from blocksim.scenario.structures.base import PolygonStructure

BLOCKS_BY_NAME = ("structures", "bodies")
WITH_NAMES = frozenset({*BLOCKS_BY_NAME, "blocks", "materials", "ground", "walls", "pairs"})  # of blocks and materials
SPRING_CHOICES = ("model", "law")  # keys of [contact] that rigid contacts do not have


def wrong_names(data: overrides.Data) -> Iterator[mistakes.Mistake]:
    """Find names of blocks and materials that do not exist, and scenarios without a body."""
    if all(data.get(group, ()) == () for group in (*BLOCKS_BY_NAME, *base.SYSTEMS)):
        *tables, last = (f"[[{name}]]" for name in (*BLOCKS_BY_NAME, *base.SYSTEMS))
        yield mistakes.Mistake((), f"nothing to simulate: add a {', '.join(tables)} or {last} table")
    blocks = data.get("blocks")
    for name in blocks if isinstance(blocks, Mapping) else ():
        yield from _unknown(data, ("blocks", name, "material"), "materials")
    yield from _unknown(data, ("ground", "material"), "materials")
    named = (("walls", "material", "materials"), *((group, "block", "blocks") for group in BLOCKS_BY_NAME))
    for group, key, kind in named:
        entries = data.get(group)
        for index in range(len(entries) if isinstance(entries, tuple) else 0):
            yield from _unknown(data, (group, index, key), kind)
    yield from _wrong_pairs(data)


def _unknown(data: overrides.Data, path: overrides.KeyPath, group: str) -> Iterator[mistakes.Mistake]:
    known = data.get(group, {} if group == "blocks" else None)  # materials that are missing are told of by themselves
    if isinstance(known, Mapping):
        yield from mistakes.unknown(path, group.removesuffix("s"), known, overrides.follow(data, path))


def _wrong_pairs(data: overrides.Data) -> Iterator[mistakes.Mistake]:
    materials, pairs = data.get("materials"), data.get("pairs")
    known = [*materials, contact.GROUND] if isinstance(materials, Mapping) else []
    if contact.GROUND in known[:-1]:
        message = f"{units.toml(contact.GROUND)} means the ground in [pairs]; give this material another name"
        yield mistakes.Mistake(("materials", contact.GROUND), message, at="key")
    found: set[frozenset[str]] = set()
    for one, partners in pairs.items() if isinstance(pairs, Mapping) else ():
        yield from mistakes.unknown(("pairs", one), "material", known, one if known else None, "key")
        missing = f"name the other material too, as in [{overrides.format_key(('pairs', one, contact.GROUND))}]"
        if partners == {}:
            yield mistakes.Mistake(("pairs", one), missing, at="key")
        for other in partners if isinstance(partners, Mapping) else ():
            path = ("pairs", one, other)
            if other in contact.Pair.model_fields and other not in known:
                yield mistakes.Mistake(path, missing, at="key")
            else:
                yield from mistakes.unknown(path, "material", known, other if known else None, "key")
            if one == other == contact.GROUND:
                yield mistakes.Mistake(path, "the ground is not in contact with itself", at="key")
            elif frozenset((one, other)) in found:
                twin = overrides.format_key(("pairs", other, one))
                yield mistakes.Mistake(path, f"the same pair is given as {twin}; keep one of the two", at="key")
            found.add(frozenset((one, other)))


def unfit_choices(scenario: Scenario) -> Iterator[mistakes.Mistake]:
    """Find contact model and force law that the non-smooth scheme, soil or outlines do not have, and blocks of soil.

    Numbers of springs and dashpots are not refused, so that a scenario can be run by both schemes; they have no effect.
    """
    for name in () if scenario.time.has_systems else scenario.systems:
        message = f"{name} need another scheme: {units.toml(scenario.time.scheme)} advances blocks and supports only"
        yield mistakes.Mistake((name,), message, at="key", relation=True)
    if scenario.systems.get("soils") and scenario.contact.model != "surface":
        message = f'{units.toml(scenario.contact.model)} does not go with soil; use model = "surface"'
        yield mistakes.Mistake(("contact", "model"), message, relation=True)
    scheme, model, why = scenario.time.scheme, scenario.contact.model, ""  # why no block can have an outline
    if model not in scenario.time.models_of_outlines:
        reason = ": its boundary particles lie on rectangles only" if scenario.time.has_springs else ""
        known = ((name, one) for name, time in sorted(timeline.SCHEMES.items()) for one in time.models_of_outlines)
        modelled = " or ".join(f"{units.toml(name)} and {units.toml(one)}" for name, one in known)
        where = f"with time.scheme = {units.toml(scheme)} and contact.model = {units.toml(model)}"
        why = f"outlines are not modelled {where}{reason}; use {modelled}"
    for name, block in scenario.blocks.items():
        if scenario.materials[block.material].friction_angle is not None:
            message = f"{units.toml(block.material)} is soil, as it has a friction_angle; blocks are of other materials"
            yield mistakes.Mistake(("blocks", name, "material"), message, relation=True)
        if why and block.polygon:
            key = next(key for key in ("outline", "sides") if block.has_key(key))
            yield mistakes.Mistake(("blocks", name, key), why, at="key", relation=True)
    polygonal = [i for i, structure in enumerate(scenario.structures) if isinstance(structure, PolygonStructure)]
    for number in polygonal if why else ():
        yield mistakes.Mistake(("structures", number, "kind"), why, relation=True)
    springs = units.toml(next(name for name, one in timeline.SCHEMES.items() if one.has_springs))
    for key in () if scenario.time.has_springs else SPRING_CHOICES:
        chosen = getattr(scenario.contact, key)
        if chosen != contact.Contact.model_fields[key].default:
            message = f"{units.toml(chosen)} needs springs, time.scheme = {springs}; here contacts are rigid"
            yield mistakes.Mistake(("contact", key), message, relation=True)


def _unknown_provenance(data: overrides.Data) -> Iterator[mistakes.Mistake]:
    """Find provenance of keys that no scenario has."""
    table = data.get("provenance")
    for key, text in table.items() if isinstance(table, Mapping) else ():
        try:
            path = tuple(int(part) if part.isdecimal() else part for part in overrides.parse_key(str(key)))
        except ValueError:
            path = ()
        if isinstance(text, str) and not (path and overrides.is_known(path, data)):
            yield mistakes.Mistake(("provenance", key), f"{units.toml(key)} is not a key of this scenario", at="key")


STEEPEST = 5.0
"""Friction coefficient (79 degrees) above which a friction angle without its unit is more likely."""
LIGHTEST, HEAVIEST = 25.0, 25_000.0  # kg/m3: foams and osmium
SOFTEST = 1e4  # Pa: gels
LONGEST = 50.0  # m
MOST_GAPS = 5  # that are named


def implausible_values(scenario: Scenario, placed: Sequence[placement.PlacedBody]) -> list[str]:
    """Return a warning for each value that looks like one in another unit, of frictions swept ones too.

    Also for what was not read of drawings, for soils of whose width or height no whole number of particles takes all,
    with a finer spacing that does, for what the end of the run cuts off, and for blocks that nothing supports at the
    start.
    """
    warnings = []
    for name, material in scenario.materials.items():
        key = overrides.format_key(("materials", name))
        if not LIGHTEST <= material.density <= HEAVIEST:
            given = "density" if material.unit_weight is None else "unit_weight"
            warnings.append(f"{key}.{given} makes {material.density:.4g} kg/m^3; is the unit right?")
        if material.young_modulus < SOFTEST:
            warnings.append(f"{key}.young_modulus = {material.young_modulus:.4g} Pa; is the unit right?")
    for name, block in scenario.blocks.items():
        sizes = {side: getattr(block, side) or 0.0 for side in ("width", "height", "length")}
        sizes |= {"depth": block.given_depth or 0.0, "radius": 2.0 * (block.radius or 0.0)}
        sizes["outline"] = dist(*geometry.box_of(block.outline or [(0.0, 0.0)]))
        for side, size in sizes.items():
            if size > LONGEST:
                key = overrides.format_key(("blocks", name, side))
                warnings.append(f"{key} makes {size:.4g} m; is the unit right?")
    for number, structure in enumerate(scenario.structures):
        if isinstance(structure, polygons.Polygons):
            size = median(dist(*geometry.box_of(one.outline)) for one in structure.cells_given)
            if size > 10.0:  # m, of most blocks of a drawing: bricks and stones in mm come out larger
                key = overrides.format_key(("structures", number))
                warnings.append(f'{key}: blocks of {size:.3g} m; for a drawing in mm add unit = "1 mm"')
            warnings += structure.remarks
    warnings += _friction_angles(scenario)
    warnings += _impacts(scenario, placed)
    for soil in placement.soil_tables(scenario):
        for name, width in islice(start.gaps(soil, scenario, placed), MOST_GAPS):
            warnings.append(
                f"soil {soil.name}: a gap of {1e3 * width:.3g} mm to {name}, {width / soil.spacing:.2g} spacings; "
                "until it closes the soil slides, and its thrust is another: let the outline begin at that face"
            )
    loose = overlap.support_warning(scenario, placed)
    return [*warnings, *cut_off(scenario, placed), *([loose] if loose else [])]


STRONG_RESTITUTION = 0.5  # beyond which simultaneous impacts were seen to create energy
BESIDE = 0.01  # of the smallest side: blocks no farther apart touch


def _impacts(scenario: Scenario, placed: Sequence[placement.PlacedBody]) -> Iterator[str]:
    """Yield that contact.impacts has no effect, or that blocks touch whose restitution asks for another value."""
    if not scenario.time.has_rigid_contacts:
        if scenario.contact.impacts == "sequential":
            rigid = f"time.scheme = {units.toml(timeline.IMPULSES)} has rigid ones"
            yield f"contact.impacts has no effect: contacts are springs; {rigid}"
        return
    pairs = [pair.restitution or 0.0 for row in scenario.pairs.values() for pair in row.values()]
    restitution = max(scenario.contact.restitution.block_block, *pairs, 0.0)
    if restitution <= STRONG_RESTITUTION or scenario.contact.impacts == "sequential":
        return
    free = [body for body in placed if not body.fixed]
    one, other, _ = overlap.pairs_within(overlap.Outlines.of(free), BESIDE * placement.smallest_width(free))
    if one.size:
        yield (
            f"restitution {restitution:g} between blocks that touch ({free[one[0]].name} and {free[other[0]].name}): "
            "simultaneous impacts pass no blow on from block to block, and may create energy; set "
            'contact.impacts = "sequential"'
        )


ROUND_OFF = 1e-9  # of the end: sums of times that are meant to be equal
MOST_NAMES = 8  # that a warning lists


def cut_off(scenario: Scenario, placed: Sequence[placement.PlacedBody]) -> Iterator[str]:
    """Yield a warning for everything that begins at the end of the run or later, or is not complete by then."""
    end, found = scenario.time.end, dict[str, list[str]]()
    for key, begin, last in _spans(scenario, placed):
        if begin >= end:
            found.setdefault(f"nothing changes before {begin:g} s", []).append(key)
        elif last > end * (1.0 + ROUND_OFF):
            found.setdefault(f"cut off, as complete only at {last:g} s", []).append(key)
    for what, keys in found.items():
        yield f"{spelling.list_names(keys, MOST_NAMES)}: {what}, but the run ends at time.end = {end:g} s"


def _spans(scenario: Scenario, placed: Sequence[placement.PlacedBody]) -> Iterator[tuple[str, float, float]]:
    """Yield key, begin and end (s) of everything that changes over time, but what an event ends before."""
    ends: dict[str, float] = {}  # by the name of a load, an actuator or a body; at a rest that nobody knows, at once
    for event in scenario.events:
        for name in (*event.unload, *event.free, *event.remove):
            ends[name] = min(ends.get(name, inf), event.at or 0.0)
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
            yield overrides.format_key((table, number)), moments[0], min(moments[-1], ends.get(name, inf))
    single = placed[len(placed) - len(scenario.bodies) :]
    for number, (body, one) in enumerate(zip(scenario.bodies, single, strict=True)):
        if body.motion is not None:
            key, begin, last = _of_motion(overrides.format_key(("bodies", number, "motion")), body.motion)
            yield key, begin, min(last, ends.get(one.name, inf))
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


def _friction_angles(scenario: Scenario) -> Iterator[str]:
    """Find frictions that look like angles, the largest bare value of each that the sweep varies too."""
    sides = contact.Friction.model_fields
    frictions = [(f"friction.{side}", float(getattr(scenario.friction, side).static)) for side in sides]
    for left, others in scenario.pairs.items():
        for right, pair in others.items():
            if pair.friction is not None:
                frictions.append((overrides.format_key(("pairs", left, right, "friction")), pair.friction.static))
    for key, values in {} if scenario.sweep is None else scenario.sweep.vary.items():
        parts = overrides.parse_key(key)
        if "friction" not in (parts[0], *parts[3:4]) or parts[-1] in ("kinetic_ratio", "transition_speed"):
            continue
        match values:
            case study.Uniform(angle=False):
                frictions.append((key, values.high))
            case study.Normal(angle=False):
                frictions.append((key, values.mean))
            case tuple():
                bare = [float(value) for value in values if isinstance(value, int | float)]
                frictions += [(key, max(bare))] if bare else []
    for key, value in frictions:
        if value > STEEPEST:
            yield f'{key} = {value:g} is a friction coefficient; for an angle write "{value:g} deg"'


MAX_VARIED = 100
MODES = get_args(study.Mode)
ENDS = ("from", "mean", "to")
"""Keys of a variation that is not a list, in the order in which they are reported."""
Trial = Callable[[overrides.KeyPath, object, overrides.KeyPath], Iterator[mistakes.Mistake]]
"""Finds the mistakes of a value at the path of a key, and puts them at a place of the sweep."""
UNVARIED = ("schema", "name", "description", "experiment", "sweep", "provenance")


def examine(
    data: overrides.Data, folder: Path
) -> tuple[Scenario | None, list[mistakes.Mistake], Callable[[], placement.Placement]]:
    """Validate data (tuples for lists): the scenario, or None and all mistakes, and what gives the placed blocks.

    Mistakes of placement, such as overlapping bodies, can only be found once everything else is right.
    """
    scenario, findings = _validated(data, folder)
    findings += [*_sweep(data, folder), *_unknown_provenance(data)]
    placed = cache(partial(placement.place, cast("Scenario", scenario)))
    if scenario is not None and not findings:
        findings += [*unfit_choices(scenario), *start.impossible_starts(scenario, placed)]
    return (None if findings else scenario), findings, placed


def mistakes_among(
    data: overrides.Data,
    folder: Path,
    scenario: Scenario,
    placed: Callable[[], placement.Placement],
    tables: Collection[str],
) -> Iterator[mistakes.Mistake]:
    """Find mistakes in how some tables, each valid, go with the others of a scenario that had none before."""
    if not WITH_NAMES.isdisjoint(tables):
        yield from wrong_names(data)
    yield from _sweep(data, folder)
    yield from _unknown_provenance(data)
    yield from unfit_choices(scenario)
    yield from start.impossible_starts(scenario, placed, tables)


def _validated(data: overrides.Data, folder: Path) -> tuple[Scenario | None, list[mistakes.Mistake]]:
    """Return the scenario, None where pydantic has errors, and the mistakes of values and of names."""
    try:
        scenario, findings = Scenario.model_validate(data, context={"folder": folder}), []
    except ValidationError as error:
        scenario, findings = None, mistakes.mistakes_of(error, data)
    return scenario, [*findings, *islice(wrong_names(data), mistakes.MAX_MISTAKES)]


def _sweep(data: overrides.Data, folder: Path) -> Iterator[mistakes.Mistake]:
    """Try the values of a sweep one by one; whether values are compatible shows in each case of the sweep."""
    sweep = data.get("sweep")
    if not isinstance(sweep, Mapping):
        return
    if len(sweep) > MAX_VARIED:
        message = f"{len(sweep)} keys are too many; at most {MAX_VARIED} can be varied"
        yield mistakes.Mistake(("sweep",), message, at="key")
        return
    trial = trial_of(data, folder)
    mode = {"mode": sweep["mode"]} if sweep.get("mode") in MODES else {}
    for key, values in sweep.items():
        try:
            study.Sweep.model_validate({**mode, key: values})
        except ValidationError:
            continue
        if key not in study.OWN_KEYS:
            yield from islice(_varied(trial, str(key), values), 1)
    for key in map(str, sweep):
        table, dot, word = key.rpartition(".")
        synonym = f"{table}{dot}{overrides.SYNONYMS.get(word, word)}"
        if word == "kinetic_ratio" and synonym in sweep:
            message = f"{synonym}, which means the same, is varied too; keep one of the two"
            yield mistakes.Mistake(("sweep", key), message, at="key")


def _varied(tried: Trial, key: str, values: object) -> Iterator[mistakes.Mistake]:
    """Yield the mistakes in a swept key, then in its values as written, so that their dimension is checked too."""
    complaint = variation_fault(key)
    if complaint:
        yield mistakes.Mistake(("sweep", key), complaint, at="key")
        return
    parts = {end: values[end] for end in ENDS if end in values} if isinstance(values, Mapping) else {}
    for part, value in parts.items() or enumerate(values[:100] if isinstance(values, tuple) else ()):
        yield from tried(overrides.parse_key(key), value, ("sweep", key, part))


def variation_fault(key: str) -> str:
    """Return why a key cannot be swept, or nothing; whether the scenario has the key shows when it is tried."""
    try:
        first = overrides.parse_key(key)[0]
    except ValueError:
        return f"{units.toml(key)} is not a dotted key"
    return f"{first} cannot be varied" if first in UNVARIED else ""


def trial_of(data: overrides.Data, folder: Path) -> Trial:
    """Return what finds the mistakes that setting one value adds to data, without its sweep and experiment."""
    bare = {key: entry for key, entry in data.items() if key not in ("sweep", "experiment")}
    _, before = _validated(bare, folder)

    def tried(path: overrides.KeyPath, value: object, place: overrides.KeyPath) -> Iterator[mistakes.Mistake]:
        try:
            changed, _ = overrides.with_value(bare, path, value)
        except overrides.UnfitOverrideError as error:
            yield mistakes.Mistake(place[:2], str(error), at="key")
            return
        for finding in _validated(changed, folder)[1]:
            if not finding.relation and finding not in before:
                yield mistakes.Mistake(place[:2] if finding.at == "key" else place, finding.message, at=finding.at)

    return tried
