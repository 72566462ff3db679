"""Mistakes in the data of a scenario, in plain words, with the path of the key concerned."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, cast

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from blocksim.scenario.models import actuators, base, loads, motion, scenario, timeline
from blocksim.scenario.overrides import MISSING, NAMED, KeyPath, field_at, fields_of, follow, marks_of, table_at
from blocksim.scenario.spelling import did_you_mean, did_you_mean_or_list, meant_word, nearest
from blocksim.scenario.structures import KINDS
from blocksim.scenario.units import toml

TWO_VALUES = "two values are needed, one along x and one along y"
MAX_MISTAKES = 200  # mistakes that are examined; a file of a million mistakes must not take minutes
KINDS_IN: dict[str | int, Iterable[str]] = {
    "structures": KINDS,
    "motion": motion.MOTIONS,
    "probes": timeline.PROBES,
    "bodies": motion.DRIVES,
    "loads": loads.LOADS,
    "history": loads.HISTORIES,
    "displacement": actuators.PATHS,
}


Place = Literal["key", "value"]


class Mistake(NamedTuple):
    """One mistake: its place in the data, its message, and the part of the line to mark with a caret.

    `relation` is true where each value is valid and only their combination is not; `meant` is the path that a
    misspelt key was probably meant to be.
    """

    path: KeyPath
    message: str
    at: Place = "value"
    relation: bool = False
    meant: KeyPath = ()


def unknown(path: KeyPath, what: str, known: Collection[str], name: object, at: Place = "value") -> Iterator[Mistake]:
    """Find a name that is none of those known, of what there is."""
    if isinstance(name, str) and name not in known:
        yield Mistake(path, f"unknown {what} {toml(name)}, {did_you_mean_or_list(name, known)}", at=at)


def repetitions(names: Iterable[str | None]) -> Iterator[int]:
    """Yield the numbers of names that came before."""
    seen: set[str | None] = {None}
    for number, name in enumerate(names):
        if name is not None and name in seen:
            yield number
        seen.add(name)


def mistakes_of(error: ValidationError, data: object) -> list[Mistake]:
    """Translate the errors of pydantic; a key is not missing where it is only misspelt."""
    entries = [e for e in error.errors(include_url=False) if e["type"] != "default_factory_not_called"]
    findings = [_finding(entry, data) for entry in entries[:MAX_MISTAKES]]
    meant = {finding.meant for finding in findings if finding.meant}
    return [finding for finding in findings if finding.path not in meant]


def _finding(entry: ErrorDetails, data: object) -> Mistake:
    path = _path(entry["loc"])
    match entry["type"]:
        case "missing":
            return _missing(path, data)
        case "union_tag_not_found":
            return Mistake((*path, "kind"), f"this key is missing: {_kinds(path)[1]} is needed", at="key")
        case "union_tag_invalid":
            kind = follow(data, (*path, "kind"))
            table, kinds = _kinds(path)
            what = "motion" if path[-1] == "motion" else table.removesuffix("s")
            hint = did_you_mean(str(kind), KINDS_IN[table]) or f"choose {kinds}"
            return Mistake((*path, "kind"), f"unknown {what} kind {toml(kind)}; {hint}")
        case "extra_forbidden":
            return _unknown_key(path, data)
        case "blocksim":
            context = entry["ctx"]
            key = context["key"]
            known = (*path, *key)
            return Mistake(_existing(known, data), context["message"], context["at"], relation=bool(key))
        case _:
            return Mistake(_existing(path, data), _wrong_type(entry, path))


def _path(loc: Sequence[str | int]) -> KeyPath:
    """Drop what pydantic adds to the path of the file: the tag of a union, and the sweep's inner table."""
    path = tuple(loc)
    match path:
        case (held, *_) if held == base.HELD:
            path = path[1:]
        case ("structures" | "probes", *_):
            path = (*path[:2], *path[3:])
        case ("bodies", _, "motion", *_):
            path = (*path[:3], *path[4:])
        case ("loads", _, _, "history", *_):
            path = (*path[:2], "history", *path[5:])
        case ("actuators", _, "displacement", *_):
            path = (*path[:3], *path[4:])
        case ("loads", *_):
            path = (*path[:2], *path[3:])
        case ("time", scheme, *_) if scheme not in timeline.SCHEMES:
            pass  # a scheme that is none of the union
        case ("motion" | "time", *_) | ("sweep", "vary", *_):
            path = (path[0], *path[2:])
    return path


def _existing(path: KeyPath, data: object) -> KeyPath:
    """Cut a path down to what is in the file: a bare number may have become a table."""
    while path and follow(data, path) is MISSING:
        path = path[:-1]
    return path


def _missing(path: KeyPath, data: object) -> Mistake:
    if isinstance(path[-1], int):
        return Mistake(path[:-1], f"this list is too short; {TWO_VALUES}")
    field = field_at(path, data)
    told = f": {field.description}" if field is not None else ""
    wanted = next((m.wanted for m in marks_of(field) if hasattr(m, "wanted")), "") if field is not None else ""
    needed = f"; {wanted} is needed" if wanted else ""
    return Mistake(path, f"this key is missing{told}{needed}", at="key")


def _unknown_key(path: KeyPath, data: object) -> Mistake:
    schemes = [word for word, table in timeline.SCHEMES.items() if path[0] == "time" and path[-1] in fields_of(table)]
    present = timeline.scheme_of(follow(data, path[:-1]))
    if schemes:
        message = f"this key belongs to scheme {toml(schemes[0])}; the scheme here is {toml(present)}"
        return Mistake(path, message, at="key")
    table = timeline.SCHEMES[present] if path[0] == "time" else table_at(path[:-1], data)
    known = fields_of(table) if table is not None else {}
    meant = meant_word(str(path[-1]), known)
    is_typing_error = nearest(str(path[-1]), known, most=1) is not None
    if not meant or (len(path) == 1 and not is_typing_error):
        singles = (name for name in fields_of(scenario.Scenario) if name not in NAMED and name not in base.SYSTEMS)
        tables = ((name, table_at((name,), {})) for name in singles)
        having = [name for name, one in tables if one is not None and path[-1] in fields_of(one)]
        if len(having) == 1:
            return Mistake(path, f"unknown key, did you mean {f'{having[0]}.{path[-1]}'!r}?", at="key")
    if len(path) > 1 and not is_typing_error and path[-1] in fields_of(scenario.Scenario):
        return Mistake(path, f"unknown key, {path[-1]} belongs at the top of the file", at="key")
    hint = f"did you mean {meant!r}?" if meant else f"allowed are: {', '.join(known)}"
    return Mistake(path, f"unknown key, {hint}", at="key", meant=(*path[:-1], meant) if meant else ())


def _kinds(path: KeyPath) -> tuple[str, str]:
    """Return the table whose kinds are known, that of bodies or the last one on the way, and these kinds in words."""
    table = "bodies" if path[0] == "bodies" else next(str(part) for part in reversed(path) if part in KINDS_IN)
    *others, last = (toml(kind) for kind in KINDS_IN[table])
    return table, f"{', '.join(others)} or {last}"


def _wrong_type(entry: ErrorDetails, path: KeyPath) -> str:
    value = cast("Any", entry["input"])
    match entry["type"]:
        case "model_type" | "dict_type" | "model_attributes_type":
            double = f"; write [{path[-1]}] with single brackets" if isinstance(value, list | tuple) else ""
            return f"{toml(value)} is not a table{double}"
        case "tuple_type":
            is_single = isinstance(value, Mapping) and len(path) == 1
            double = f"; write [[{path[-1]}]] with double brackets" if is_single else ""
            return f"{toml(value)} is not a list{double}"
        case "too_long":
            return f"this list is too long; {TWO_VALUES}"
        case "string_type":
            quote = "; quote the whole dotted key" if isinstance(value, Mapping) else ""
            return f"{toml(value)} is not a string in quotes{quote}"
        case "bool_type":
            word = value.lower() if isinstance(value, str) else ""
            how = f"{word}, in lower case and without quotes" if word in ("true", "false") else "true or false"
            return f"{toml(value)} is neither true nor false; write {how}"
        case _:
            return f"{toml(value)}: {entry['msg'][0].lower()}{entry['msg'][1:]}"
