"""Where keys and values stand in a TOML text."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from blocksim.scenario.document import Span, locate
from blocksim.scenario.overrides import KeyPath

TEXT = '''\
# comment with [brackets] and = signs
top = 1            # and a comment
"quoted key" = "text with # and ] and \\" inside"
[a . 'b']
point.x = 1.5
point.y = [ 1, [2, 3], "],#", # comment ]
  { z = 1, w = 'lit}' },
]
long = """
one ""two"" \\"""
"""""
literal = \'\'\'it''s\'\'\'
date = 1979-05-27 07:32:00
[[list]]
n = 0
[[list.sub]]
m = 0
[[list.sub]]
m = 1
[[list]]
n = 1
[list.table]
k = true
[[list.sub]]
m = 2
[deep.er.still]
end = inf'''


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


@pytest.mark.parametrize(
    ("path", "key", "value"),
    [
        (("top",), "top", "1"),
        (("quoted key",), '"quoted key"', '"text with # and ] and \\" inside"'),
        (("a", "b"), "a . 'b'", "a . 'b'"),
        (("a", "b", "point", "x"), "point.x", "1.5"),
        (("a", "b", "point", "y"), "point.y", '[ 1, [2, 3], "],#", # comment ]'),
        (("a", "b", "point", "y", 1, 1), "3", "3"),
        (("a", "b", "point", "y", 3, "w"), "w", "'lit}'"),
        (("a", "b", "long"), "long", '"""'),
        (("a", "b", "literal"), "literal", "'''it''s'''"),
        (("a", "b", "date"), "date", "1979-05-27 07:32:00"),
        (("list", 1), "list", "list"),
        (("list", 1, "sub", 0, "m"), "m", "2"),
        (("deep", "er"), "deep.er.still", "deep.er.still"),
        (("deep", "er", "still", "end"), "end", "inf"),
    ],
)
def test_spans(path: KeyPath, key: str, value: str) -> None:
    place = locate(TEXT)[path]
    assert (cut(TEXT, place.key), cut(TEXT, place.value)) == (key, value)


def test_a_list_is_first_mentioned_at_its_first_header() -> None:
    places = locate(TEXT)
    assert places["list",].key.line == places["list", 0].key.line == 14
    assert places["list", 0, "sub", 1].key.line == 18
