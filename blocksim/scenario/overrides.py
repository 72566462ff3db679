"""Dotted keys: reading, writing and following them, and setting single values by them as --set and sweeps do."""

import functools
import re
import tomllib
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from blocksim.scenario.models import base, contact, timeline
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.scenario.units import Kind, Quantity, toml

KeyPath = tuple[str | int, ...]  # path in a scenario, such as ("structures", 0, "overlap")

_LISTS = ("materials", "blocks", "structures", "bodies", "walls", "events", "loads", "actuators", "probes")
NAMED: dict[str | int, int] = {**dict.fromkeys(_LISTS, 2), "pairs": 3}
"""Tables of named or numbered entries: how many parts of a path lead to one entry."""

TAGS = ("kind", "scheme")  # keys whose word selects one of several tables

MISSING = object()  # what `follow` returns where there is nothing

MAX_PARTS = 64  # of a dotted key; the time of tomllib grows with their square

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_BASIC = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"')
_LITERAL = re.compile(r"'[^'\n]*'")
_BLANK = re.compile(r"[ \t]*")


def read_key(text: str, start: int = 0) -> tuple[tuple[str, ...], int]:
    """Read a TOML key, dotted and quoted or not, from `start`: its parts, and where it ends.

    Raises ValueError, also for more than MAX_PARTS parts.
    """
    parts: list[str] = []
    while len(parts) < MAX_PARTS:
        start = skip(text, start)
        found = next((m for p in (_BASIC, _LITERAL, _BARE) if (m := p.match(text, start))), None)
        if found is None:
            raise ValueError("not a key")
        part = found[0]
        literal = part[1:-1] if part[0] == "'" else part
        parts.append(str(tomllib.loads(f"v = {part}")["v"]) if part[0] == '"' else literal)
        after = skip(text, found.end())
        if not text.startswith(".", after):
            return tuple(parts), found.end()
        start = after + 1
    raise ValueError("too many parts")


def skip(text: str, start: int, what: re.Pattern[str] = _BLANK) -> int:
    """Return where something ends that may be at an index: spaces and tabs, or another pattern."""
    found = what.match(text, start)
    return start if found is None else found.end()


@functools.lru_cache(maxsize=1024)
def parse_key(text: str) -> tuple[str, ...]:
    """Read a whole text as one dotted key; raises ValueError."""
    parts, end = read_key(text)
    if skip(text, end) != len(text):
        raise ValueError("not a key")
    return parts


def format_key(path: Sequence[str | int]) -> str:
    """Write a path as a dotted key, with quotes where TOML wants them."""
    parts = []
    for part in map(str, path):
        escaped = part.replace("\\", "\\\\").replace('"', '\\"')
        quoted = "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped)
        parts.append(part if _BARE.fullmatch(part) else f'"{quoted}"')
    return ".".join(parts)


def follow(data: object, path: Sequence[str | int]) -> object:
    """Return the value at a path of nested mappings and sequences, or MISSING."""
    for part in path:
        if isinstance(data, Mapping):
            data = data.get(part, MISSING)
        elif isinstance(data, list | tuple) and isinstance(part, int) and 0 <= part < len(data):
            data = data[part]
        else:
            return MISSING
    return data


def table_at(path: Sequence[str | int], data: object) -> type[base.Table] | None:
    """Return the model of the table at a path; `data` has the kinds of structures and motion."""
    annotation: object = Scenario
    for depth, part in enumerate(path):
        table = _table(annotation, follow(data, path[:depth]))
        entries = [(get_origin(option), get_args(option)) for option in options(annotation)]
        inner = [arguments[1] for origin, arguments in entries if origin is dict]
        inner += [arguments[0] for origin, arguments in entries if origin is tuple and isinstance(part, int)]
        field = None if table is None else fields_of(table).get(str(part))
        annotation = inner[0] if inner else None if field is None else field.annotation
    return _table(annotation, follow(data, path))


def field_at(path: Sequence[str | int], data: object) -> FieldInfo | None:
    """Return the model field at a path, or None where the models know no such key."""
    table = table_at(path[:-1], data) if path else None
    return None if table is None else fields_of(table).get(str(path[-1]))


def field_of(key: str, scenario: Scenario) -> FieldInfo | None:
    """Return the field that a dotted key leads to in a scenario, None where it leads to none."""
    data = scenario.model_dump(by_alias=True, exclude={"sweep"})
    try:
        return field_at(with_value(data, key, None)[1], data)
    except UnfitOverrideError:
        return None


def is_known(path: Sequence[str | int], data: object) -> bool:
    """Return True if the models have a place for this path (what has a name or number must be in `data`)."""
    named = 2 if path[0] in base.SYSTEMS else NAMED.get(path[0], 0)
    if named and follow(data, path[:named]) is MISSING:
        return False
    if len(path) <= named:
        return True
    return field_at(path, data) is not None or (
        isinstance(path[-1], int) and follow(data, path) is not MISSING and field_at(path[:-1], data) is not None
    )


def fields_of(table: type[base.Table]) -> dict[str, FieldInfo]:
    """Return the fields of a table by their keys in the file; of a scenario those of the tables of all systems too."""
    systems = {
        name: FieldInfo(annotation=tuple[entry, ...], default=(), description=entry.__doc__)  # type: ignore[valid-type]
        for name, entry in (base.SYSTEMS.items() if table is Scenario else ())
    }
    return {info.alias or name: info for name, info in table.model_fields.items() if info.alias != base.HELD} | systems


def _table(annotation: object, node: object) -> type[base.Table] | None:
    tables = [option for option in options(annotation) if isinstance(option, type) and issubclass(option, base.Table)]
    if len(tables) > 1:
        tables = [*timeline.SCHEMES.values()] if issubclass(tables[0], timeline.Time) else tables
        for table in tables:
            tag = next(tag for tag in TAGS if tag in table.model_fields)  # the key that tells, here or by default
            word = node.get(tag, MISSING) if isinstance(node, Mapping) else MISSING
            field = table.model_fields[tag]
            if (field.default if word is MISSING else word) in get_args(field.annotation):
                return table
        return None
    return tables[0] if tables else None


def si_unit(info: FieldInfo) -> str:
    """Return the SI unit of the values of a field, empty for plain numbers and words."""
    kinds = (mark.kind if isinstance(mark, Quantity) else mark for mark in marks_of(info))
    return next((kind.unit for kind in kinds if isinstance(kind, Kind)), "")


def marks_of(info: FieldInfo) -> Iterator[Any]:
    """Yield what describes the values of a field: annotations of its type, and of the alternatives in it."""
    yield from info.metadata
    inner = [*get_args(info.annotation)]
    while inner:
        part = inner.pop(0)
        yield part
        inner[:0] = get_args(part)


def options(annotation: Any) -> Iterator[Any]:
    """Yield the alternatives of a type expression, without metadata."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from options(get_args(annotation)[0])
    elif origin in (Union, types.UnionType):
        for option in get_args(annotation):
            yield from options(option)
    else:
        yield annotation


Data = Mapping[str, object]

MAX_DEPTH = 16
SYNONYMS = {"kinetic": "kinetic_ratio", "kinetic_ratio": "kinetic"}
"""Two keys with the same meaning; setting one removes the other."""
_NAMED = (("materials",), ("blocks",))
_FRICTION = contact.Friction()


class UnfitOverrideError(ValueError):
    """A dotted key or a value cannot be set; the text has the reason."""


class Override(NamedTuple):
    """One value set from outside: its name in messages, its text, and the path that it sets."""

    label: str
    text: str
    path: KeyPath


class TooDeepError(ValueError):
    """Tables or lists are nested deeper than any scenario needs."""


def freeze(value: object, depth: int = 0) -> object:
    """Copy nested data with tuples for lists; raises TooDeepError."""
    if depth > MAX_DEPTH:
        raise TooDeepError(f"nested more than {MAX_DEPTH} levels deep")
    if isinstance(value, Mapping):
        return {key: freeze(entry, depth + 1) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return tuple(freeze(entry, depth + 1) for entry in value)
    return value


def parse_override(text: str) -> tuple[tuple[str, ...], object]:
    """Split "key=value": the parts of the key, and the value as TOML or as a bare word.

    Raises UnfitOverrideError.
    """
    try:
        path, end = read_key(text)
    except ValueError:
        raise UnfitOverrideError("write KEY=VALUE with a dotted key, such as contact.stiffness_scale=0.1") from None
    equals = skip(text, end)
    value = text[equals + 1 :].strip()
    if text[equals : equals + 1] != "=" or not value:
        raise UnfitOverrideError("write KEY=VALUE, such as contact.stiffness_scale=0.1")
    return path, parse_value(value)


def parse_value(text: str) -> object:
    """Read a TOML value; anything that does not start like one ("5 mm/s", "linear") is text."""
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        found = {}
    if set(found) == {"value"}:
        return found["value"]
    if text[0] in "\"'[{":
        raise UnfitOverrideError(f"{text[:40]} is not a TOML value")
    return text


def with_value(data: Data, key: str | Sequence[str | int], value: object) -> tuple[Data, KeyPath]:
    """Return data with one value set, and the path that was set; raises UnfitOverrideError.

    Missing tables on the way are created. A bare friction c becomes { static = c }, whose kinetic part
    follows the static one until it is set, by itself or by its ratio, of which the later one holds; the friction of a
    pair of materials starts as that of all pairs; a bare restitution becomes a table of both, gravity its magnitude.
    """
    try:
        parts = parse_key(key) if isinstance(key, str) else tuple(key)
    except ValueError:
        raise UnfitOverrideError(f"{toml(key)} is not a dotted key") from None
    if parts[0] == "pairs" and len(parts) >= 3 and follow(data, parts[:3]) is MISSING:
        turned = (parts[0], parts[2], parts[1])  # pairs.B.A is the pair that the data may have as pairs.A.B
        parts = parts if follow(data, turned) is MISSING else (*turned, *parts[3:])
    path: list[str | int] = []
    result = _put(data, data, parts, freeze(value), path)
    assert isinstance(result, Mapping)  # noqa: S101 - data is a mapping, so is its copy
    return result, tuple(path)


def _put(data: Data, node: object, parts: Sequence[str | int], value: object, done: list[str | int]) -> object:
    """Copy `node` with the value at `parts` below it; `done` collects the path that was taken."""
    if not parts:
        return value
    if isinstance(node, tuple | list):
        index = _index(node, parts[0], done)
        done.append(index)
        return (*node[:index], _put(data, node[index], parts[1:], value, done), *node[index + 1 :])
    if not isinstance(node, Mapping):
        raise UnfitOverrideError(f"{format_key(done)} is {toml(node)}, not a table")
    part = str(parts[0])
    child = node.get(part, MISSING)
    if child is MISSING and tuple(done) in _NAMED and len(parts) > 1:
        hint = did_you_mean_or_list(part, node)
        raise UnfitOverrideError(f"{done[0]} has no {toml(part)}, {hint}")
    if child is MISSING and not done and len(parts) > 1:
        field = field_at((part,), {})
        if field is not None and isinstance(field.default, tuple):
            raise UnfitOverrideError(f"this scenario has no [[{part}]], so no {toml(str(parts[1]))} among them")
    done.append(part)
    child = _opened(data, tuple(done), child, str(parts[1])) if len(parts) > 1 else child
    synonym = SYNONYMS.get(part)  # another way to write what is going to be set
    others = {key: entry for key, entry in node.items() if key != synonym}
    return {**others, part: _put(data, child, parts[1:], value, done)}


def _index(entries: Sequence[object], part: str | int, done: Sequence[str | int]) -> int:
    if str(part).isdecimal() and len(str(part)) < MAX_DEPTH and int(part) < len(entries):
        return int(part)
    named = [index for index, entry in enumerate(entries) if isinstance(entry, Mapping) and entry.get("name") == part]
    if len(named) == 1:
        return named[0]
    names = [entry["name"] for entry in entries if isinstance(entry, Mapping) and "name" in entry]
    if names and not str(part).isdecimal():
        raise UnfitOverrideError(f"{format_key(done)} has no {toml(part)}, {did_you_mean_or_list(str(part), names)}")
    message = f"{format_key(done)} is a list of {len(entries)}, numbered from 0; {toml(part)} does not exist"
    raise UnfitOverrideError(message)


def _opened(data: Data, path: KeyPath, child: object, following: str) -> object:
    """Return what a bare number, or nothing, stands for, before something inside is set.

    A pair of materials starts from the general friction, a missing list from its default (bodies.0.velocity.1).
    """
    is_bare = child is not MISSING and not isinstance(child, Mapping | tuple | list)
    if path == ("contact", "restitution") and is_bare:
        return {"block_block": child, "block_ground": child}
    if path == ("gravity",) and is_bare:
        return {"magnitude": child}
    is_of_pair = path[0] == "pairs" and path[3:] == ("friction",)
    if is_of_pair or (path[:-1] == ("friction",) and path[-1] in contact.Friction.model_fields):
        if child is MISSING:
            side = str(path[-1]) if not is_of_pair else "block_ground" if contact.GROUND in path else "block_block"
            general = follow(data, ("friction", side))
            child = getattr(_FRICTION, side).static if general is MISSING else general
        return child if isinstance(child, Mapping | tuple | list) else {"static": child}
    field = field_at(path, data) if child is MISSING and following.isdecimal() else None
    if field is not None and isinstance(field.default, tuple) and field.default:
        return field.default
    return {} if child is MISSING else child
