"""A scenario file with some of its values replaced, and everything else as its author wrote it.

The text is edited where every value stands, so comments and order are kept. The result is then read again: where it
does not say exactly what it should (a value that goes over several lines, for instance), the whole scenario is written
out instead, resolved and without comments.
"""

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import tomli_w

from blocksim.errors import BlocksimError
from blocksim.scenario import Document, Scenario, scenario_hash, scenario_to_toml
from blocksim.scenario.keys import KeyPath, follow, format_key
from blocksim.scenario.models.motion import FromTable
from blocksim.scenario.overrides import with_value
from blocksim.scenario.source import Span, locate

TABLES: tuple[KeyPath, ...] = (("experiment", "table"), ("motion", "table"), ("sweep", "table"))
"""Keys whose values are paths, relative to the scenario's folder."""
NOTE = "calibrated, see [provenance]"
GAP = "  "
_COMMENT = re.compile(r"""([^#"']*?)(\s*)(?:#\s*(.*?)\s*)?""")
"""What stands behind a value: the end of its list or table, blanks, and a comment."""


def with_fitted(
    document: Document,
    values: Mapping[str, object],
    provenance: Mapping[str, str],
    folder: Path,
    head: str,
    note: str = NOTE,
) -> str:
    """Return the text of a scenario file to stand in `folder`: values set, their notes in [provenance], `head` on top.

    Values that were set over the document before are written too; paths of tables are those seen from the folder.
    `note` is the comment behind every fitted value. Raises what building the scenario raises.
    """
    changed = document.with_values(values)
    changed = changed.with_values({format_key(("provenance", key)): text for key, text in provenance.items()})
    scenario = changed.build()
    moved = _moved(changed, folder)
    with suppress(BlocksimError):  # no scenario any more, half-way through
        text = f"# {head}\n{_with_values(document.source.text, moved, len(document.overrides), note)}"
        if _says(text, scenario, folder):
            return text
    return f"# {head}\n{_resolved(scenario, moved)}"


def _with_values(text: str, wanted: Document, settings: int, note: str) -> str:
    """Return the text with all values that were set over it; the first so many are settings, the others are fitted."""
    fitted = {override.path for override in wanted.overrides[settings:] if override.path[0] != "provenance"}
    for path in dict.fromkeys([*(override.path for override in wanted.overrides), *_tables(wanted)]):
        if follow(wanted.data, path) != follow(Document.parse(text).data if text else {}, path):
            text = _edited(text, path, wanted, note if path in fitted else "")
    return text


def _tables(document: Document) -> tuple[KeyPath, ...]:
    """Return the keys of a scenario that may name a table."""
    bodies = document.data.get("bodies", ())
    count = len(bodies) if isinstance(bodies, tuple) else 0
    return (*TABLES, *(("bodies", number, "motion", "table") for number in range(count)))


def _moved(document: Document, folder: Path) -> Document:
    """Return the document with its paths as seen from another folder."""
    data = document.data
    for path in _tables(document):
        named = follow(data, path)
        if isinstance(named, str):
            target = (document.folder / named).resolve()
            data, _ = with_value(data, path, Path(os.path.relpath(target, folder.resolve())).as_posix())
    return replace(document, data=data, folder=folder)


def _edited(text: str, path: KeyPath, wanted: Document, note: str) -> str:
    """Return the text with the value at a path set, as the wanted document has it, and a note behind it."""
    places = locate(text)
    known = next((path[:size] for size in range(len(path), 0, -1) if path[:size] in places), ())
    lines = text.split("\n")
    if not known:  # in a table of its own at the end, or before all tables where it stands in none
        value = toml_value(follow(wanted.data, path))
        if len(path) == 1:
            return f"{format_key(path)} = {value}\n{text}"
        return f"{text.rstrip()}\n\n[{format_key(path[:1])}]\n{format_key(path[1:])} = {value}\n"
    place = places[known]
    is_header = lines[place.key.line - 1].lstrip().startswith("[") and place.key == place.value
    if not is_header:
        told = f"{path[-1]} {note}" if note and known != path else note
        return _replaced(lines, place.value, toml_value(follow(wanted.data, known)), told)
    line = f"{format_key(path[len(known) :])} = {toml_value(follow(wanted.data, path))}"
    return "\n".join([*lines[: place.key.line], line, *lines[place.key.line :]])


def _replaced(lines: list[str], span: Span, value: str, note: str) -> str:
    """Put a value where one stood; a comment behind it was about that one, which is said."""
    line = lines[span.line - 1]
    rest = line[span.column + span.length :]
    comment = _COMMENT.fullmatch(rest)
    if note and comment is not None:
        before = f"; before: {comment[3]}" if comment[3] else ""
        gap = " " * max(len(GAP), span.length + len(comment[2]) - len(value))  # the comment stays in its column
        rest = f"{comment[1]}{gap}# {note}{before}"
    return "\n".join([*lines[: span.line - 1], line[: span.column] + value + rest, *lines[span.line :]])


def toml_value(value: object) -> str:
    """Write a value as it stands in a TOML file, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{format_key((str(key),))} = {toml_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").rstrip("\n")


def _says(text: str, scenario: Scenario, folder: Path) -> bool:
    """Return True if a text, read in a folder, gives exactly this scenario."""
    with suppress(BlocksimError):
        found = replace(Document.parse(text, folder=folder), allow_outside=True).build()
        beside = [one.model_copy(update={"motion": None}) for one in (found, scenario)]  # the hash has its content
        return scenario_hash(found) == scenario_hash(scenario) and beside[0] == beside[1]
    return False


def _resolved(scenario: Scenario, moved: Document) -> str:
    experiment, motion = (follow(moved.data, path) for path in TABLES[:2])
    motions = ((number, body.motion) for number, body in enumerate(scenario.bodies))
    of_bodies = {
        one.table.digest: str(follow(moved.data, ("bodies", number, "motion", "table")))
        for number, one in motions
        if isinstance(one, FromTable)
    }
    return scenario_to_toml(
        scenario,
        experiment_table=experiment if isinstance(experiment, str) else None,
        motion_table=motion if isinstance(motion, str) else None,
        body_tables=of_bodies,
    )
