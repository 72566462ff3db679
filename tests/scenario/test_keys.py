"""Dotted keys: written, read, followed through data, models and texts, and meant by misspelt words."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario.document import Span, locate
from blocksim.scenario.overrides import KeyPath, format_key, is_known, parse_key
from blocksim.scenario.spelling import USUAL, meant_word, nearest
from tests.golden import Golden
from tests.scenario.conftest import SCENARIOS

DATA = {
    "blocks": {"brick": {"width": 1}},
    "structures": ({"kind": "stack"}, {"kind": "none"}, 3),
    "friction": {"block_block": 0.3},
    "pairs": {"steel": {"oak": {"friction": 0.3}}},
}


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("a", ("a",)),
        ("a.b-c.0", ("a", "b-c", "0")),
        (' a . "b.c" . \'d"\' ', ("a", "b.c", 'd"')),
        (r'"\u00e4\"."', ('ä".',)),
        ('""', ("",)),
    ],
)
def test_keys_are_read_as_in_toml(text: str, parts: tuple[str, ...]) -> None:
    assert parse_key(text) == parts


@pytest.mark.parametrize("text", ["", ".", "a.", ".a", "a b", "a..b", '"a', "ä", "a=b"])
def test_what_is_no_key(text: str) -> None:
    with pytest.raises(ValueError, match="not a key"):
        parse_key(text)


@given(st.lists(st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs"])), min_size=1, max_size=4))
def test_a_key_that_was_written_is_read_again(parts: list[str]) -> None:
    assert parse_key(format_key(parts)) == tuple(parts)


KNOWN = """time.end contact.restitution contact.restitution.block_ground blocks.brick blocks.brick.length
    structures.0.offset pairs.steel pairs.steel.oak pairs.steel.oak.restitution pairs.steel.oak.friction.kinetic
    ground.profile"""
UNKNOWN = """blocks.stone structures.0.overlap structures.9 time.end.x friction.block_blok blocks.stone.length pairs.oak
    pairs.steel.ground.restitution walls.0.from"""


@pytest.mark.parametrize("key", [*KNOWN.split(), *UNKNOWN.split()])
def test_known_keys(key: str) -> None:
    path = tuple(int(part) if part.isdigit() else part for part in key.split("."))
    assert is_known(path, DATA) is (key in KNOWN.split())


@pytest.mark.parametrize(
    ("word", "known", "most", "meant"),
    [
        ("MPA", ["Pa", "MPa"], 0, "MPa"),
        ("widht", ["height", "width"], 1, "width"),
        ("wdth", ["height", "width"], 1, "width"),
        ("widthh", ["height", "width"], 1, "width"),
        ("wudth", ["height", "width"], 1, "width"),
        ("wudht", ["height", "width"], 1, None),
        ("wudht", ["height", "width"], 2, "width"),
        ("mn", ["kPa"], 1, None),
    ],
)
def test_nearest_allows_so_many_letters_replaced_added_dropped_or_swapped(
    word: str, known: list[str], most: int, meant: str | None
) -> None:
    assert nearest(word, known, most=most) == meant


def test_a_long_word_with_several_wrong_letters_is_not_taken_for_its_beginning() -> None:
    assert meant_word("resttiuion", ("res", "restitution")) == "restitution"


def test_symbols_of_papers_and_words_of_other_programs_lead_to_keys_that_exist() -> None:
    assert meant_word("vx", ["x", "y", "velocity"]) == "velocity"
    assert meant_word("e", ["young_modulus", "density"]) == "young_modulus"
    assert meant_word("e", ["model", "restitution"]) == "restitution"
    assert meant_word("vx", ["x", "y"]) is None
    keys = (SCENARIOS / "README.md").read_text("utf-8")
    known = {row.split("`")[1].rpartition(".")[2] for row in keys.splitlines() if row.startswith("| `")}
    assert {key for meant in USUAL.values() for key in meant} - {"speed", "restitution"} <= known


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


def test_spans(golden: Golden) -> None:
    """A list is first mentioned at its first header."""
    places = locate(TEXT)
    spans = ((path, place.key.line, cut(TEXT, place.key), cut(TEXT, place.value)) for path, place in places.items())
    golden("\n".join(f"{'.'.join(map(str, path))}: line {line}, {key} = {value}" for path, line, key, value in spans))
