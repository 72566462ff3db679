"""Whether the entries of run.json and done.json that follow from the scenario are those that come out again.

Not among them is what a repetition cannot know: wall times, when and where the run was made, its parts.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blocksim.errors import InvalidInputError
from blocksim.scenario.limited import read_limited
from blocksim.simulation import folder as files
from blocksim.simulation.resumption import STARTS_ANEW
from blocksim.simulation.summary import MOST_BYTES, Summary

INTERRUPTED = "interrupted"
ALWAYS = ("name", "steps", "time_step_s", "simulated_time_s", "energy_J")
UNLESS_INTERRUPTED = ("reason", "exit_code")
HASHES = ("run", "scenario_hash")  # of the code, or of what it makes of a file, too


@dataclass(frozen=True)
class EntryDifference:
    """An entry that does not come out again; values as JSON has them."""

    file: str
    entry: str  # with points, as energy_J.kinetic
    stored: Any
    now: Any


def differing_entries(folder: Path, then: Summary, now: Summary, *, same_code: bool) -> tuple[EntryDifference, ...]:
    """Return which entries of a run's folder are not those of its repetition; some of them only for the same code.

    The final state and the status are not among them: they are reported by themselves.
    """
    whole = then.status != INTERRUPTED
    names = (*ALWAYS, *(UNLESS_INTERRUPTED if whole else ()), *(HASHES if same_code else ()))
    stored, wanted = _read(folder / files.SUMMARY), json.loads(now.to_json())
    if not whole and same_code:  # the repetition is of a scenario with another end
        wanted |= {name: getattr(then, name) for name in HASHES}
    found = [one for name in names for one in _apart(files.SUMMARY, name, stored.get(name), wanted[name])]
    if whole and not _are_warnings(then, now.warnings):
        found.append(EntryDifference(files.SUMMARY, "warnings", list(then.warnings), list(now.warnings)))
    return (*found, *_of_the_mark(folder, then))


def _of_the_mark(folder: Path, then: Summary) -> Iterator[EntryDifference]:
    """Yield how done.json, where there is one, contradicts run.json."""
    if files.is_finished(folder):
        stored = _read(folder / files.DONE)
        for name in ("run", "status"):
            yield from _apart(files.DONE, name, stored.get(name), getattr(then, name))


def _apart(file: str, entry: str, stored: Any, now: Any) -> Iterator[EntryDifference]:
    """Yield the differences of an entry, or of those in it."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for name, value in stored.items():  # a version before may have had fewer
            yield from _apart(file, f"{entry}.{name}", value, now.get(name))
    elif stored != now:
        yield EntryDifference(file, entry, stored, now)


def _are_warnings(then: Summary, now: tuple[str, ...]) -> bool:
    """Return True if the warnings are those of now, after what was reported when the run went on or began again."""
    before = then.warnings[: len(then.warnings) - len(now)]
    is_allowed = bool(then.resumed_from) or all(text.endswith(STARTS_ANEW) for text in before)
    return (*before, *now) == then.warnings and is_allowed


def _read(path: Path) -> dict[str, Any]:
    """Return the entries of a file. Raises InputMissingError or InvalidInputError."""
    try:
        entries = json.loads(read_limited(path, MOST_BYTES))
    except (ValueError, RecursionError) as error:
        message = f"{path}: not the entries of a run: {error}"
        raise InvalidInputError(message) from error
    if not isinstance(entries, dict):
        message = f"{path}: not the entries of a run"
        raise InvalidInputError(message)
    return entries
