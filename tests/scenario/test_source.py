"""Where keys and values stand in a TOML text."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

from blocksim.scenario.document import Span, locate
from blocksim.scenario.overrides import KeyPath
from tests.golden import Golden

TEXT = Path(__file__).with_name("source.toml").read_text()


def values(data: object, path: KeyPath = ()) -> Iterator[tuple[KeyPath, object]]:
    """Yield every path of parsed TOML and what stands there."""
    if path:
        yield path, data
    for key, entry in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from values(entry, (*path, key))


def cut(text: str, span: Span) -> str:
    return text.split("\n")[span.line - 1][span.column : span.column + span.length]


def check_places(text: str) -> None:
    """Every path has a place, and what is cut out at the place of a one-line value reads as the value."""
    places = locate(text)
    data = tomllib.loads(text)
    assert set(places) == {path for path, _ in values(data)}
    for path, value in values(data):
        if not isinstance(value, dict | list) and "\n" not in str(value):
            found = cut(text, places[path].value)
            assert tomllib.loads(f"v = {found}")["v"] == value, path


def test_every_value_is_found() -> None:
    check_places(TEXT)


def test_every_value_of_a_shipped_scenario_is_found(shipped: Path) -> None:
    check_places(shipped.read_text())


def test_spans(golden: Golden) -> None:
    """A list is first mentioned at its first header."""
    places = locate(TEXT)
    spans = ((path, place.key.line, cut(TEXT, place.key), cut(TEXT, place.value)) for path, place in places.items())
    golden("\n".join(f"{'.'.join(map(str, path))}: line {line}, {key} = {value}" for path, line, key, value in spans))
