"""Everything that must hold before a scenario may be used."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from pydantic import ValidationError

from blocksim.scenario import keys, overlap
from blocksim.scenario.findings import MAX_FINDINGS, Finding, did_you_mean_or_list, findings_of
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.study import Sweep
from blocksim.scenario.overrides import Data, UnfitOverrideError, with_value
from blocksim.scenario.placement import PlacedBody, placed_with_origin
from blocksim.scenario.quantities import shown
from blocksim.scenario.structures import UnfitError

MAX_BODIES = 100_000
MAX_OVERLAPS = 20
MAX_TRIED = 100
MAX_VARIED = 100
UNVARIED = ("schema", "name", "description", "experiment", "sweep", "provenance")


def examine(data: Data, folder: Path) -> tuple[Scenario | None, list[Finding]]:
    """Validate data (tuples for lists): the scenario, or None and all mistakes.

    Mistakes of placement, such as overlapping bodies, can only be told once everything else is right.
    """
    scenario, findings = _validated(data, folder)
    findings += islice(_references(data), MAX_FINDINGS)
    findings += [*_sweep(data), *_provenance(data)]
    if scenario is not None and not findings:
        findings += _placement(scenario)
    return (None if findings else scenario), findings


def _validated(data: Data, folder: Path) -> tuple[Scenario | None, list[Finding]]:
    try:
        return Scenario.model_validate(data, context={"folder": folder}), []
    except ValidationError as error:
        return None, findings_of(error, data)


def _references(data: Data) -> Iterator[Finding]:
    """Find names of blocks and materials that do not exist, and scenarios without a body."""
    if data.get("structures", ()) == () and data.get("bodies", ()) == ():
        yield Finding((), "nothing to simulate: add a [[structures]] or a [[bodies]] table")
    blocks = data.get("blocks")
    for name in blocks if isinstance(blocks, Mapping) else ():
        yield from _reference(data, ("blocks", name, "material"), "materials")
    yield from _reference(data, ("ground", "material"), "materials")
    for group in ("structures", "bodies"):
        entries = data.get(group)
        for index in range(len(entries) if isinstance(entries, tuple) else 0):
            yield from _reference(data, (group, index, "block"), "blocks")


def _reference(data: Data, path: keys.KeyPath, group: str) -> Iterator[Finding]:
    name, known = keys.follow(data, path), data.get(group)
    if isinstance(name, str) and isinstance(known, Mapping) and name not in known:
        hint = did_you_mean_or_list(name, known)
        yield Finding(path, f"unknown {group.removesuffix('s')} {shown(name)}, {hint}")


def _sweep(data: Data) -> Iterator[Finding]:
    """Try the values of a sweep one by one; whether values go together shows in each case of the sweep."""
    sweep = data.get("sweep")
    if not isinstance(sweep, Mapping):
        return
    if len(sweep) > MAX_VARIED:
        yield Finding(("sweep",), f"{len(sweep)} keys are too many; at most {MAX_VARIED} can be varied", at="key")
        return
    bare = {key: entry for key, entry in data.items() if key not in ("sweep", "experiment")}
    before = _single_mistakes(bare)
    for key, values in sweep.items():
        if key != "mode":
            yield from islice(_varied(bare, before, str(key), values), 1)


def _varied(data: Data, before: Sequence[Finding], key: str, values: object) -> Iterator[Finding]:
    """Yield what is wrong with a swept key, then with its values."""
    place: keys.KeyPath = ("sweep", key)
    try:
        path = keys.parse_key(key)
        expanded = Sweep.model_validate({key: values}).vary[key]
    except ValidationError:
        return
    except ValueError:
        yield Finding(place, f"{shown(key)} is not a dotted key", at="key")
        return
    if path[0] in UNVARIED:
        yield Finding(place, f"{path[0]} cannot be varied", at="key")
        return
    tried = expanded[:MAX_TRIED] if isinstance(values, tuple) else (expanded[0], expanded[-1])
    for index, value in enumerate(tried):
        value_place = (*place, index) if isinstance(values, tuple) else place
        yield from _tried(data, before, path, value, value_place)


def _tried(
    data: Data, before: Sequence[Finding], path: keys.KeyPath, value: object, place: keys.KeyPath
) -> Iterator[Finding]:
    """Yield the mistakes that setting one value adds."""
    try:
        changed, _ = with_value(data, path, value)
    except UnfitOverrideError as error:
        yield Finding(place[:2], str(error), at="key")
        return
    for finding in _single_mistakes(changed):
        if finding not in before:
            unknown = finding.at == "key"
            yield Finding(place[:2] if unknown else place, finding.message, at=finding.at)


def _single_mistakes(data: Data) -> list[Finding]:
    """List the mistakes of values by themselves."""
    _, findings = _validated(data, Path())
    return [finding for finding in (*findings, *islice(_references(data), MAX_FINDINGS)) if not finding.relation]


def _provenance(data: Data) -> Iterator[Finding]:
    """Find provenance of keys that no scenario has."""
    table = data.get("provenance")
    for key, text in table.items() if isinstance(table, Mapping) else ():
        try:
            path = tuple(int(part) if part.isdecimal() else part for part in keys.parse_key(str(key)))
        except ValueError:
            path = ()
        if isinstance(text, str) and not (path and keys.is_known(path, data)):
            yield Finding(("provenance", key), f"{shown(key)} is no key of this scenario", at="key")


def _placement(scenario: Scenario) -> Iterator[Finding]:
    """Place all bodies and find what cannot be at the start."""
    count = sum(structure.size for structure in scenario.structures) + len(scenario.bodies)
    if count > MAX_BODIES:
        yield Finding(("structures",), f"{count} bodies are too many; at most {MAX_BODIES} are possible")
        return
    unfit = list(_unfit_structures(scenario))
    if unfit:
        yield from unfit
        return
    origins, bodies = zip(*placed_with_origin(scenario), strict=True)
    yield from _impossible_masses(scenario)
    yield from _equal_names(origins, bodies)
    yield from _below_ground(origins, bodies)
    yield from _overlaps(origins, bodies)


def _unfit_structures(scenario: Scenario) -> Iterator[Finding]:
    for number, structure in enumerate(scenario.structures):
        try:
            structure.place(scenario.blocks[structure.block])
        except UnfitError as error:
            yield Finding(("structures", number, error.key), str(error))


def _impossible_masses(scenario: Scenario) -> Iterator[Finding]:
    """Find blocks whose sizes are possible numbers while their mass or inertia is not."""
    for name, block in scenario.blocks.items():
        mass = scenario.materials[block.material].density * block.size_x * block.size_y * block.depth
        inertia = mass * (block.size_x * block.size_x + block.size_y * block.size_y) / 12.0
        if not (0.0 < inertia < math.inf and 0.0 < mass < math.inf):
            message = f"a block of {mass:g} kg and {inertia:g} kg m^2 cannot be simulated"
            yield Finding(("blocks", name), f"{message}; check its sides and density")


def _equal_names(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    seen: set[str] = set()
    for origin, body in zip(origins, bodies, strict=True):
        if body.name in seen:
            message = f"two bodies are named {shown(body.name)}; a body without a name has its number"
            yield Finding((*origin, "name"), message)
        seen.add(body.name)


def _below_ground(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    for origin, body in zip(origins, bodies, strict=True):
        bottom = overlap.Rectangle.of(body).bottom
        if bottom < -overlap.TOLERANCE:
            yield Finding(origin, f"body {body.name} reaches {-bottom * 1e3:.6g} mm below the ground (y = 0)")


def _overlaps(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    for first, second, depth in islice(overlap.overlapping_pairs(bodies), MAX_OVERLAPS):
        names = f"bodies {bodies[first].name} and {bodies[second].name}"
        yield Finding(origins[second], f"{names} overlap by {depth * 1e3:.6g} mm; they may touch, no more")
