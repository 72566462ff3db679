"""What the shell completes after TAB: kinds, keys of the scenario on the line, names of cases and measurements.

Completion must never fail or print: it offers nothing where something cannot be read.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

Complete = Callable[[Any, str], list[str]]


def of_names(names: Callable[[], Any]) -> Complete:
    """Return a completion of some names, which are computed only when TAB is pressed."""

    def complete(ctx: Any, incomplete: str) -> list[str]:  # noqa: ARG001 - typer passes both by name
        return [name for name in names() if name.startswith(incomplete)]

    return complete


def scenario_keys(ctx: Any, incomplete: str) -> list[str]:
    """Return the dotted keys of the scenario on the line, each with its equals sign."""
    words = [
        str(word) for word in (ctx.params.get("scenario"), *ctx.args)
    ]  # after an option without value all words are args
    place = next((word for word in words if word.endswith(".toml")), None)
    if place is None:
        return []
    return [f"{key}=" for key in _keys_in(Path(place)) if key.startswith(incomplete)]


def _keys_in(path: Path) -> list[str]:
    import tomllib

    from blocksim.scenario import load_scenario, scenario_to_toml

    with suppress(Exception):
        return list(dict.fromkeys(_dotted(tomllib.loads(scenario_to_toml(load_scenario(path))))))
    return []


def _dotted(entry: object, prefix: str = "") -> Iterator[str]:
    """Yield the keys of all values in nested tables; entries of lists of tables by number."""
    if isinstance(entry, Mapping):
        for key, value in entry.items():
            yield from _dotted(value, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(entry, list) and entry and isinstance(entry[0], Mapping):
        for index, value in enumerate(entry):
            yield from _dotted(value, f"{prefix}.{index}")
    else:
        yield prefix
