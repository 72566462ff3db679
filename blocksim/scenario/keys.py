"""Dotted keys: reading and writing them, following them into data and into the models."""

import functools
import re
import tomllib
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from blocksim.scenario.models.base import Table
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.stepping import SCHEMES, Time
from blocksim.scenario.quantities import Kind, Quantity
from blocksim.scenario.systems import HELD, SYSTEMS

KeyPath = tuple[str | int, ...]
"""Path in a scenario, such as ("structures", 0, "overlap")."""

NAMED: dict[str | int, int] = {
    "materials": 2,
    "blocks": 2,
    "structures": 2,
    "bodies": 2,
    "walls": 2,
    "events": 2,
    "loads": 2,
    "pairs": 3,
    "probes": 2,
}
"""Tables of named or numbered entries: how many parts of a path lead to one entry."""

TAGS = ("kind", "scheme")
"""Keys whose word selects one of several tables."""

MISSING = object()
"""What `follow` returns where there is nothing."""

MAX_PARTS = 64
"""Of a dotted key; the time of tomllib grows with their square."""

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
        start = skip_blank(text, start)
        found = next((m for p in (_BASIC, _LITERAL, _BARE) if (m := p.match(text, start))), None)
        if found is None:
            raise ValueError("not a key")
        part = found[0]
        literal = part[1:-1] if part[0] == "'" else part
        parts.append(str(tomllib.loads(f"v = {part}")["v"]) if part[0] == '"' else literal)
        after = skip_blank(text, found.end())
        if not text.startswith(".", after):
            return tuple(parts), found.end()
        start = after + 1
    raise ValueError("too many parts")


def skip_blank(text: str, start: int) -> int:
    """Return the index of the first character from `start` that is neither space nor tab."""
    found = _BLANK.match(text, start)
    return start if found is None else found.end()


@functools.lru_cache(maxsize=1024)
def parse_key(text: str) -> tuple[str, ...]:
    """Read a whole text as one dotted key; raises ValueError."""
    parts, end = read_key(text)
    if skip_blank(text, end) != len(text):
        raise ValueError("not a key")
    return parts


def format_key(path: Sequence[str | int]) -> str:
    """Write a path as a dotted key, with quotes where TOML wants them."""
    return ".".join(part if _BARE.fullmatch(part) else _quoted(part) for part in map(str, path))


def _quoted(part: str) -> str:
    escaped = part.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'


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


def table_at(path: Sequence[str | int], data: object) -> type[Table] | None:
    """Return the model of the table at a path; `data` has the kinds of structures and motion."""
    annotation: object = Scenario
    for depth, part in enumerate(path):
        table = _table(annotation, follow(data, path[:depth]))
        entries = [(get_origin(option), get_args(option)) for option in options(annotation)]
        inner = [arguments[1] for origin, arguments in entries if origin is dict]
        inner += [arguments[0] for origin, arguments in entries if origin is tuple and isinstance(part, int)]
        field = None if table is None else _fields(table).get(part)
        annotation = inner[0] if inner else None if field is None else field.annotation
    return _table(annotation, follow(data, path))


def field_at(path: Sequence[str | int], data: object) -> FieldInfo | None:
    """Return the model field at a path, or None where the models know no such key."""
    table = table_at(path[:-1], data) if path else None
    return None if table is None else _fields(table).get(path[-1])


def field_of(key: str, scenario: Scenario) -> FieldInfo | None:
    """Return the field that a dotted key leads to in a scenario, None where it leads to none."""
    data = scenario.model_dump(by_alias=True, exclude={"sweep"})
    path: KeyPath = ()
    for part in parse_key(key):
        entries = follow(data, path)
        place: str | int = part
        if isinstance(entries, list | tuple):  # an entry of a list is meant by its number, or by its name
            named = (i for i, one in enumerate(entries) if isinstance(one, Mapping) and one.get("name") == part)
            place = int(part) if part.isdecimal() else next(named, part)
        path = (*path, place)
    return field_at(path, data)


def is_known(path: Sequence[str | int], data: object) -> bool:
    """Return True if the models have a place for this path (what has a name or number must be in `data`)."""
    named = 2 if path[0] in SYSTEMS else NAMED.get(path[0], 0)
    if named and follow(data, path[:named]) is MISSING:
        return False
    if len(path) <= named:
        return True
    return field_at(path, data) is not None or (
        isinstance(path[-1], int) and follow(data, path) is not MISSING and field_at(path[:-1], data) is not None
    )


def keys_of(table: type[Table]) -> tuple[str, ...]:
    """Return the keys that a table may have, as written in the file."""
    return tuple(str(key) for key in _fields(table))


def _fields(table: type[Table]) -> dict[str | int, FieldInfo]:
    """Return the fields of a table by their keys; of a scenario those of the tables of all systems too."""
    systems: dict[str | int, FieldInfo] = {
        name: FieldInfo(annotation=tuple[entry, ...], default=(), description=entry.__doc__)  # type: ignore[valid-type]
        for name, entry in (SYSTEMS.items() if table is Scenario else ())
    }
    return {**_own_fields(table), **systems}


@functools.cache
def _own_fields(table: type[Table]) -> dict[str | int, FieldInfo]:
    return {info.alias or name: info for name, info in table.model_fields.items() if info.alias != HELD}


def _table(annotation: object, node: object) -> type[Table] | None:
    tables = [option for option in options(annotation) if isinstance(option, type) and issubclass(option, Table)]
    if len(tables) > 1:
        tables = [*SCHEMES.values()] if issubclass(tables[0], Time) else tables
        for table in tables:
            tag = _tag(table)  # the key whose word distinguishes the alternatives, here or by default
            word = node.get(tag, MISSING) if isinstance(node, Mapping) else MISSING
            if (table.model_fields[tag].default if word is MISSING else word) in kinds_of(table):
                return table
        return None
    return tables[0] if tables else None


def _tag(table: type[Table]) -> str:
    return next(tag for tag in TAGS if tag in table.model_fields)


def kinds_of(table: type[Table]) -> tuple[str, ...]:
    """Return the words that distinguish this table from its alternatives."""
    return get_args(table.model_fields[_tag(table)].annotation)


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
