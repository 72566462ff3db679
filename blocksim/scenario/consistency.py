"""What keys of a scenario say about one another: names that must exist, choices of the scheme, provenance of keys."""

from collections.abc import Iterator, Mapping

from blocksim.scenario import keys
from blocksim.scenario.findings import Finding
from blocksim.scenario.models.contact import GROUND, Contact, Pair
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.stepping import SCHEMES
from blocksim.scenario.overrides import Data
from blocksim.scenario.quantities import shown
from blocksim.scenario.soil_places import unfit_soils
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.scenario.structures import Shaped
from blocksim.scenario.systems import SYSTEMS

BLOCKS_BY_NAME = ("structures", "bodies")
SPRING_CHOICES = ("model", "law")
"""Keys of [contact] that rigid contacts do not have."""


def wrong_names(data: Data) -> Iterator[Finding]:
    """Find names of blocks and materials that do not exist, and scenarios without a body."""
    if all(data.get(group, ()) == () for group in (*BLOCKS_BY_NAME, *SYSTEMS)):
        *tables, last = (f"[[{name}]]" for name in (*BLOCKS_BY_NAME, *SYSTEMS))
        yield Finding((), f"nothing to simulate: add a {', '.join(tables)} or {last} table")
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


def _unknown(data: Data, path: keys.KeyPath, group: str) -> Iterator[Finding]:
    name = keys.follow(data, path)
    known = data.get(group, {} if group == "blocks" else None)  # materials that are missing are told of by themselves
    if isinstance(name, str) and isinstance(known, Mapping) and name not in known:
        hint = did_you_mean_or_list(name, known)
        yield Finding(path, f"unknown {group.removesuffix('s')} {shown(name)}, {hint}")


def _wrong_pairs(data: Data) -> Iterator[Finding]:
    materials, pairs = data.get("materials"), data.get("pairs")
    known = [*materials, GROUND] if isinstance(materials, Mapping) else []
    if GROUND in known[:-1]:
        message = f"{shown(GROUND)} means the ground in [pairs]; give this material another name"
        yield Finding(("materials", GROUND), message, at="key")
    found: set[frozenset[str]] = set()
    for one, partners in pairs.items() if isinstance(pairs, Mapping) else ():
        if known and one not in known:
            yield Finding(
                ("pairs", one), f"unknown material {shown(one)}, {did_you_mean_or_list(one, known)}", at="key"
            )
        missing = f"name the other material too, as in [{keys.format_key(('pairs', one, GROUND))}]"
        if partners == {}:
            yield Finding(("pairs", one), missing, at="key")
        for other in partners if isinstance(partners, Mapping) else ():
            path = ("pairs", one, other)
            if other in Pair.model_fields and other not in known:
                yield Finding(path, missing, at="key")
            elif known and other not in known:
                yield Finding(path, f"unknown material {shown(other)}, {did_you_mean_or_list(other, known)}", at="key")
            if one == other == GROUND:
                yield Finding(path, "the ground is not in contact with itself", at="key")
            elif frozenset((one, other)) in found:
                twin = keys.format_key(("pairs", other, one))
                yield Finding(path, f"the same pair is given as {twin}; keep one of the two", at="key")
            found.add(frozenset((one, other)))


def unfit_choices(scenario: Scenario) -> Iterator[Finding]:
    """Find contact model and force law that the non-smooth scheme does not have.

    Numbers of springs and dashpots are not refused, so that a scenario can be run by both schemes; they have no effect.
    """
    for name in () if scenario.time.has_systems else scenario.systems:
        message = f"{name} need another scheme: {shown(scenario.time.scheme)} advances blocks and supports only"
        yield Finding((name,), message, at="key", relation=True)
    yield from unfit_soils(scenario)
    if scenario.start.settle and scenario.systems:
        message = f"{', '.join(scenario.systems)} cannot settle: blocks and supports alone can"
        yield Finding(("start", "settle"), message, relation=True)
    why = _why_without_outlines(scenario)
    for name, block in scenario.blocks.items():
        if why and block.polygon:
            key = "outline" if block.outline is not None else "sides"
            yield Finding(("blocks", name, key), why, at="key", relation=True)
    for number, structure in enumerate(scenario.structures):
        if why and isinstance(structure, Shaped):
            yield Finding(("structures", number, "kind"), why, relation=True)
    springs = next(name for name, one in SCHEMES.items() if one.has_springs)
    for key in () if scenario.time.has_springs else SPRING_CHOICES:
        chosen = getattr(scenario.contact, key)
        if chosen != Contact.model_fields[key].default:
            message = f"{shown(chosen)} needs springs, time.scheme = {shown(springs)}; here contacts are rigid"
            yield Finding(("contact", key), message, relation=True)


def _why_without_outlines(scenario: Scenario) -> str:
    """Return why no block of a scenario can have an outline; nothing where blocks can."""
    scheme, model = scenario.time.scheme, scenario.contact.model
    if model not in scenario.time.models_of_outlines:
        why = ": its boundary particles lie on rectangles only" if scenario.time.has_springs else ""
        known = ((name, one) for name, time in sorted(SCHEMES.items()) for one in time.models_of_outlines)
        modelled = " or ".join(f"{shown(name)} and {shown(one)}" for name, one in known)
        where = f"with time.scheme = {shown(scheme)} and contact.model = {shown(model)}"
        return f"outlines are not modelled {where}{why}; use {modelled}"
    if scenario.systems:
        return f"outlines are not modelled beside {', '.join(scenario.systems)}, whose particles meet rectangles only"
    return ""


def unknown_provenance(data: Data) -> Iterator[Finding]:
    """Find provenance of keys that no scenario has."""
    table = data.get("provenance")
    for key, text in table.items() if isinstance(table, Mapping) else ():
        try:
            path = tuple(int(part) if part.isdecimal() else part for part in keys.parse_key(str(key)))
        except ValueError:
            path = ()
        if isinstance(text, str) and not (path and keys.is_known(path, data)):
            yield Finding(("provenance", key), f"{shown(key)} is not a key of this scenario", at="key")
