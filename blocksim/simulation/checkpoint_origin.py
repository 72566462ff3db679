"""What a checkpoint came from, and in what another run differs from that."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.resolved import deciding_values
from blocksim.simulation.provenance import code_hashes, code_version, machine

COMPILERS = ("numba", "llvmlite", "numpy")
MOST_NAMED = 6  # differences in a message
NONE = "none"
AGAIN = "--overwrite starts again, --out DIR keeps both"


class Origin(BaseModel, frozen=True):
    """All that decides the bits of a run, taken apart so that differences can be named."""

    scenario: dict[str, Any]  # as blocksim.scenario.resolved.deciding_values
    versions: dict[str, str]  # of blocksim and of what compiles it
    rooms: dict[str, str]  # hash of every folder of code that decides bits
    machine: str  # processor and system: the last digit of a sine may depend on them


def origin_of(scenario: Scenario) -> Origin:
    """Return what a run of a scenario comes from, here and now."""
    return Origin(
        scenario=deciding_values(scenario),
        versions={"blocksim": code_version(), **{name: metadata.version(name) for name in COMPILERS}},
        rooms=code_hashes(),
        machine=machine(),
    )


def refuse_other(path: Path, old: Origin, new: Origin) -> None:
    """Raise InvalidInputError, which names what differs, where a run would continue to other bits."""
    refuse_other_scenario(path, old.scenario, new.scenario)
    changed = [*_changed(old.versions, new.versions)]
    if changed:
        raise InvalidInputError(f"{path}: of another version of the code: {_listed(changed)}; {AGAIN}")
    rooms = [room for room in new.rooms if old.rooms.get(room) != new.rooms[room]]
    if rooms:
        where = _listed([f"blocksim/{room}" for room in rooms])
        raise InvalidInputError(f"{path}: of another version of the code: it differs in {where}; {AGAIN}")


def refuse_other_scenario(path: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Raise InvalidInputError, which names the keys, where two scenarios differ in what decides the motion."""
    changed = [*_changed(dict(_flat(old)), dict(_flat(new)))]
    if changed:
        raise InvalidInputError(f"{path}: of another scenario: {_listed(changed)}; {AGAIN}")


def _flat(data: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield all values with their keys, as --set names them."""
    entries: Sequence[tuple[object, object]] = ()
    if isinstance(data, Mapping):
        entries = [*data.items()]
    elif isinstance(data, list | tuple):
        entries = [*enumerate(data)]
    else:
        yield key, data
    for name, value in entries:
        yield from _flat(value, f"{key}.{name}" if key else str(name))


def _changed(old: Mapping[str, object], new: Mapping[str, object]) -> Iterator[str]:
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key), new.get(key)
        if before != after:
            yield f"{key} {_shown(before)} -> {_shown(after)}"


def _shown(value: object) -> str:
    return NONE if value is None else str(value)


def _listed(changed: Sequence[str]) -> str:
    more = len(changed) - MOST_NAMED
    return ", ".join(changed[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
