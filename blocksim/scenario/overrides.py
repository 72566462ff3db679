"""Setting single values of a scenario by their dotted key, as --set and sweeps do."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from blocksim.scenario.keys import MISSING, KeyPath, field_at, follow, format_key, parse_key, read_key, skip_blank
from blocksim.scenario.models.contact import GROUND, Friction
from blocksim.scenario.quantities import shown
from blocksim.scenario.spelling import did_you_mean_or_list

Data = Mapping[str, object]

MAX_DEPTH = 16
SYNONYMS = {"kinetic": "kinetic_ratio", "kinetic_ratio": "kinetic"}
"""Two keys with the same meaning; setting one removes the other."""
_NAMED = (("materials",), ("blocks",))
_FRICTION = Friction()


class UnfitOverrideError(ValueError):
    """A dotted key or a value cannot be set; the text has the reason."""


@dataclass(frozen=True, slots=True)
class Override:
    """One value set from outside: its name in messages, its text, and the path that it sets."""

    label: str
    text: str
    path: KeyPath

    @property
    def key_length(self) -> int:
        """Length of the key in `text`."""
        try:
            return read_key(self.text)[1]
        except ValueError:
            return max(1, len(self.text.partition("=")[0]))


class TooDeepError(ValueError):
    """Tables or lists are nested deeper than any scenario needs."""


def frozen(value: object, depth: int = 0) -> object:
    """Copy nested data with tuples for lists; raises TooDeepError."""
    if depth > MAX_DEPTH:
        raise TooDeepError(f"nested more than {MAX_DEPTH} levels deep")
    if isinstance(value, Mapping):
        return {key: frozen(entry, depth + 1) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return tuple(frozen(entry, depth + 1) for entry in value)
    return value


def parse_override(text: str) -> tuple[tuple[str, ...], object]:
    """Split "key=value": the parts of the key, and the value as TOML or as a bare word.

    Raises UnfitOverrideError.
    """
    try:
        path, end = read_key(text)
    except ValueError:
        raise UnfitOverrideError("write KEY=VALUE with a dotted key, such as contact.stiffness_scale=0.1") from None
    equals = skip_blank(text, end)
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
    pair of materials starts as that of all pairs; a bare restitution becomes a table of both.
    """
    try:
        parts = parse_key(key) if isinstance(key, str) else tuple(key)
    except ValueError:
        raise UnfitOverrideError(f"{shown(key)} is not a dotted key") from None
    if parts[0] == "pairs" and len(parts) >= 3 and follow(data, parts[:3]) is MISSING:
        turned = (parts[0], parts[2], parts[1])  # pairs.B.A is the pair that the data may have as pairs.A.B
        parts = parts if follow(data, turned) is MISSING else (*turned, *parts[3:])
    path: list[str | int] = []
    start = _with_list_to_change(_with_own_friction(data, parts), parts)
    result = _put(start, parts, frozen(value), path)
    assert isinstance(result, Mapping)  # noqa: S101 - data is a mapping, so is its copy
    return result, tuple(path)


def _with_own_friction(data: Data, parts: Sequence[str | int]) -> Data:
    """Give a pair of materials the general friction to start from, before a value in its own is set."""
    inside_friction = parts[0] == "pairs" and tuple(parts[3:4]) == ("friction",) and len(parts) > 4
    if not inside_friction or follow(data, parts[:4]) is not MISSING:
        return data
    side = "block_ground" if GROUND in parts[1:3] else "block_block"
    general = follow(data, ("friction", side))
    return with_value(data, parts[:4], getattr(_FRICTION, side).static if general is MISSING else general)[0]


def _with_list_to_change(data: Data, parts: Sequence[str | int]) -> Data:
    """Write out the default of a missing list before one of its entries is set (bodies.0.velocity.1)."""
    path: KeyPath = ()
    for part, following in pairwise(parts):
        path = (*path, int(part) if isinstance(follow(data, path), tuple) and str(part).isdecimal() else part)
        if str(following).isdecimal() and follow(data, path) is MISSING:
            field = field_at(path, data)
            default = () if field is None or not isinstance(field.default, tuple) else field.default
            return with_value(data, path, default)[0] if default else data
    return data


def _put(node: object, parts: Sequence[str | int], value: object, done: list[str | int]) -> object:
    """Copy `node` with the value at `parts` below it; `done` collects the path that was taken."""
    if not parts:
        return value
    if isinstance(node, tuple | list):
        index = _index(node, parts[0], done)
        done.append(index)
        return (*node[:index], _put(node[index], parts[1:], value, done), *node[index + 1 :])
    if not isinstance(node, Mapping):
        raise UnfitOverrideError(f"{format_key(done)} is {shown(node)}, not a table")
    part = str(parts[0])
    child = node.get(part, MISSING)
    if child is MISSING and tuple(done) in _NAMED and len(parts) > 1:
        hint = did_you_mean_or_list(part, node)
        raise UnfitOverrideError(f"{done[0]} has no {shown(part)}, {hint}")
    if child is MISSING and not done and len(parts) > 1:
        field = field_at((part,), {})
        if field is not None and isinstance(field.default, tuple):
            raise UnfitOverrideError(f"this scenario has no [[{part}]], so no {shown(str(parts[1]))} among them")
    done.append(part)
    child = _opened(tuple(done), child) if len(parts) > 1 else child
    synonym = SYNONYMS.get(part)  # another way to write what is going to be set
    others = {key: entry for key, entry in node.items() if key != synonym}
    return {**others, part: _put(child, parts[1:], value, done)}


def _index(entries: Sequence[object], part: str | int, done: Sequence[str | int]) -> int:
    if str(part).isdecimal() and len(str(part)) < MAX_DEPTH and int(part) < len(entries):
        return int(part)
    named = [index for index, entry in enumerate(entries) if isinstance(entry, Mapping) and entry.get("name") == part]
    if len(named) == 1:
        return named[0]
    names = [entry["name"] for entry in entries if isinstance(entry, Mapping) and "name" in entry]
    if names and not str(part).isdecimal():
        raise UnfitOverrideError(f"{format_key(done)} has no {shown(part)}, {did_you_mean_or_list(str(part), names)}")
    message = f"{format_key(done)} is a list of {len(entries)}, numbered from 0; {shown(part)} does not exist"
    raise UnfitOverrideError(message)


def _opened(path: KeyPath, child: object) -> object:
    """Turn a bare number, or nothing, into the table that it stands for, before something inside is set."""
    bare = child is not MISSING and not isinstance(child, Mapping | tuple | list)
    if path == ("contact", "restitution") and bare:
        return {"block_block": child, "block_ground": child}
    if path[:-1] == ("friction",) and path[-1] in Friction.model_fields:
        if child is MISSING:
            return {"static": getattr(_FRICTION, str(path[-1])).static}
        return {"static": child} if bare else child
    if path[:1] == ("pairs",) and path[3:] == ("friction",) and bare:
        return {"static": child}
    return {} if child is MISSING else child
