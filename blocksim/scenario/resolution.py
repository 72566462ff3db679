"""What a scenario resolves to: parameters of pairs of materials, all values written out, and their hash."""

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel

from blocksim.scenario import overrides as keys, units
from blocksim.scenario.models import base, geometry, motion, study, timeline
from blocksim.scenario.models.contact import GROUND, Friction, PairFriction
from blocksim.scenario.models.gravity import GravityField
from blocksim.scenario.models.scenario import Scenario

DEFAULT = "default"
MATERIALS = "materials"


@dataclass(frozen=True)
class ResolvedPair:
    """Contact parameters of two materials, SI; None where they follow from the materials, or from normal damping.

    `friction` is over the factor of [strength], `normal_stiffness` not yet times contact.stiffness_scale. `rules` has
    for every field the key that set it, "default" where none is given, "materials" where it follows from Young's moduli
    and Poisson's ratios.
    """

    friction: PairFriction
    restitution: float
    normal_stiffness: float | None
    shear_stiffness_ratio: float | None
    shear_damping_ratio: float | None
    rules: Mapping[str, str]


def resolve_pair(scenario: Scenario, one: str, other: str, *, ground: bool) -> ResolvedPair:
    """Return the contact parameters of the materials `one` and `other`, of two blocks unless `ground`.

    With `ground`, `one` is a block's material and `other` is "ground" or the material that a wall names; a wall
    without a material is as the ground.
    """
    partners = [(one, other)]  # whose tables apply, in order of precedence
    if ground and other != GROUND:
        partners.append((one, GROUND))
    elif ground and scenario.ground.material is not None:
        partners.append((one, scenario.ground.material))
    ways = dict.fromkeys(way for names in partners for way in (names, names[::-1]))
    found = ((way, scenario.pairs.get(way[0], {}).get(way[1])) for way in ways)
    overrides = [(keys.format_key(("pairs", *way)), pair) for way, pair in found if pair is not None]
    side = "block_ground" if ground else "block_block"
    contact = scenario.contact
    general: dict[str, tuple[object, str]] = {}
    tables = {"friction": (scenario.friction, "friction"), "restitution": (contact.restitution, "contact.restitution")}
    for name, (table, place) in tables.items():
        general[name] = getattr(table, side), f"{place}.{side}" if side in table.model_fields_set else DEFAULT
    for name in ("normal_stiffness", "shear_stiffness_ratio", "shear_damping_ratio"):
        otherwise = DEFAULT if name == "shear_damping_ratio" else MATERIALS
        value = getattr(contact, name)
        general[name] = value, otherwise if value is None else f"contact.{name}"
    values: dict[str, Any] = {}
    rules: dict[str, str] = {}
    for quantity, usual in general.items():
        special = ((getattr(pair, quantity), f"{key}.{quantity}") for key, pair in overrides)
        values[quantity], rules[quantity] = next((one for one in special if one[0] is not None), usual)
    values["friction"] = values["friction"].over(scenario.strength.divisor("joints"))
    return ResolvedPair(**values, rules=rules)


MARK = "# Resolved by blocksim"  # of every version; what follows in the line is for people
HEADER = f"{MARK}: all values as used, in SI units (m, kg, s, N, Pa), angles in rad.\n"
SCHEME = "time.scheme"
UNHASHED = {"description", "experiment", "sweep", "provenance"}


def scenario_to_toml(
    scenario: Scenario,
    experiment_table: str | None = None,
    motion_table: str | None = None,
    body_tables: Mapping[str, str] | None = None,
    *,
    is_varied: bool = False,
) -> str:
    """Write every key with its value; loading the text gives an equal scenario, floats to the last bit.

    Where a sweep varies the scheme, keys that only one scheme has are left out; a sweep is refused unless they have
    their defaults. What follows other values is left out where these vary, with `is_varied` in any case.
    `experiment_table` and `motion_table` replace the paths of tables, for copies kept beside the resolved file;
    `body_tables` those of the motions of bodies, by the digest of the table.
    """
    data = _plain(scenario)
    if scenario.sweep is not None or is_varied:
        # a sweep may vary static frictions, which the kinetic ones follow that were not set
        pairs = [(one, other, pair) for one, others in scenario.pairs.items() for other, pair in others.items()]
        frictions: list[tuple[PairFriction | None, tuple[str, ...]]]
        frictions = [(getattr(scenario.friction, side), ("friction", side)) for side in Friction.model_fields]
        frictions += [(pair.friction, ("pairs", one, other, "friction")) for one, other, pair in pairs]
        for friction, path in frictions:
            if friction is not None and "kinetic" not in friction.model_fields_set:
                functools.reduce(dict.__getitem__, path, data).pop("kinetic", None)
    if scenario.sweep is not None and SCHEME in scenario.sweep.vary:
        data["time"] = {key: value for key, value in data["time"].items() if key in timeline.Time.model_fields}
    if experiment_table is not None and "experiment" in data:
        data["experiment"] = {"table": experiment_table}
    if motion_table is not None and isinstance(scenario.motion, motion.TABLED):
        data["motion"]["table"] = motion_table
    for number, table in tables_of_bodies(scenario).items():
        name = (body_tables or {}).get(table.digest)
        if name is not None:
            data["bodies"][number]["motion"]["table"] = name
    return HEADER + tomli_w.dumps(data)


def deciding_values(scenario: Scenario, include: set[str] | None = None) -> dict[str, Any]:
    """Return everything that determines the motion and the output, as for JSON; of a table of motion its digest.

    All of it, or that of some fields.
    """
    data = scenario.model_dump(mode="json", include=include, exclude=UNHASHED)
    if "start" in data and not scenario.systems:  # nothing that settles unasked
        data["start"]["settle"] = bool(scenario.start.settle)
    if data.get("strength", {}).get("factor") == 1.0:  # divides nothing
        del data["strength"]
    if "motion" in data and isinstance(scenario.motion, motion.TABLED):
        data["motion"]["table"] = scenario.motion.table.digest
    for number, table in tables_of_bodies(scenario).items() if "bodies" in data else ():
        data["bodies"][number]["motion"]["table"] = table.digest
    return data


def tables_of_bodies(scenario: Scenario) -> dict[int, motion.MotionTable]:
    """Return the tables of motion of bodies by the numbers of these, for copies as they were read."""
    moved = ((number, body.motion) for number, body in enumerate(scenario.bodies))
    return {number: one.table for number, one in moved if isinstance(one, motion.FromTable)}


def hashed_texts(scenario: Scenario, field: str) -> list[str]:
    """Return what a field of a scenario adds to what is hashed, as JSON: keys and their values."""
    texts = deciding_values(scenario, {field}).items()
    return [
        json.dumps({key: value}, sort_keys=True, separators=(",", ":"), allow_nan=False)[1:-1] for key, value in texts
    ]


def _plain(table: object) -> Any:
    """Turn a table, or a value in it, into its TOML form; keys without a value are left out."""
    match table:
        case study.Sweep():
            return _plain(table.as_table())
        case Mapping():
            return {key: _plain(entry) for key, entry in table.items()}
        case tuple() | list():
            return [_plain(entry) for entry in table]
        case Path() | motion.MotionTable():
            return (table if isinstance(table, Path) else table.path).as_posix()
    if not isinstance(table, BaseModel) or isinstance(table, GravityField):
        return table.model_dump() if isinstance(table, GravityField) else table
    entries: dict[str, Any] = {}
    for name, info in type(table).model_fields.items():
        value = getattr(table, name)
        if keys.si_unit(info) != units.ANGLE.unit or value is None:
            value = _plain(value)
        elif isinstance(value, tuple):
            value = [f"{one!r} rad" for one in value]  # an angle must carry a unit: a bare one would be refused
        else:
            value = f"{value!r} rad"
        entries[info.alias or name] = value
    entries |= entries.pop(base.HELD, None) or {}
    if isinstance(table, PairFriction) and table.kinetic_ratio is not None:
        entries["kinetic"] = None
    if isinstance(table, geometry.Block):
        entries = {key: entry for key, entry in entries.items() if table.has_key(key)}
    return {key: entry for key, entry in entries.items() if entry is not None}
