"""What the shell completes after TAB: kinds, keys of the scenario on the line, names of cases and measurements.

Completion must never fail or print: it offers nothing where something cannot be read. Nor may it offer what a shell
could take for more than a word: zsh evaluates it at TAB, and bash runs it at Enter. A scenario may be a stranger's.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

Complete = Callable[[Any, str], list[str]]

_WORD = re.compile(r"[A-Za-z0-9._-]+")


def of_names(names: Callable[[], Any]) -> Complete:
    """Return a completion of some names, which are computed only when TAB is pressed."""

    def complete(ctx: Any, incomplete: str) -> list[str]:  # noqa: ARG001 - typer passes both by name
        return _words(names(), incomplete)

    return complete


def _words(names: Iterable[str], incomplete: str) -> list[str]:
    """Return the names that begin as what is typed, and that no shell takes for anything but a word."""
    return [name for name in names if name.startswith(incomplete) and _WORD.fullmatch(name)]


def _kinds() -> list[str]:
    from blocksim.view.kinds import MOTION, PROBE, RUN_KINDS, SWEEP_KINDS

    return [*RUN_KINDS, MOTION, PROBE, *SWEEP_KINDS, "tornado"]


def _colours() -> tuple[str, ...]:
    from blocksim.view.paint import COLOURS

    return COLOURS


def _cases() -> list[str]:
    from blocksim.verification.cases import CASES
    from blocksim.verification.soil import SOIL_CASES

    return [case.id for case in (*CASES, *SOIL_CASES)]


def _templates() -> Iterable[str]:
    from blocksim.cli import new

    return new.templates()


kinds, colours, cases, templates = map(of_names, (_kinds, _colours, _cases, _templates))
"""Completions of kinds of pictures, of ways to colour them, of verification cases, and of templates."""


def scenario_keys(ctx: Any, incomplete: str) -> list[str]:
    """Return the dotted keys of the scenario on the line, each with its equals sign."""
    words = [
        str(word) for word in (ctx.params.get("scenario"), *ctx.args)
    ]  # after an option without value all words are args
    place = next((word for word in words if word.endswith(".toml")), None)
    if place is None:
        return []
    return [f"{key}=" for key in _words(_keys_in(Path(place)), incomplete)]


def _keys_in(path: Path) -> list[str]:
    import tomllib

    from blocksim.scenario import load_scenario, scenario_to_toml
    from blocksim.scenario.overrides import format_key

    with suppress(Exception):
        paths = _paths(tomllib.loads(scenario_to_toml(load_scenario(path))))
        return list(dict.fromkeys(map(format_key, paths)))
    return []


def _paths(entry: object, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Yield the paths of all values in nested tables; entries of lists of tables by number."""
    if isinstance(entry, Mapping):
        for key, value in entry.items():
            yield from _paths(value, (*path, str(key)))
    elif isinstance(entry, list) and entry and isinstance(entry[0], Mapping):
        for index, value in enumerate(entry):
            yield from _paths(value, (*path, index))
    else:
        yield path
