"""Dotted keys: written, read, followed through data, models and texts, and meant by misspelt words."""

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario.document import Span, locate
from blocksim.scenario.overrides import format_key, is_known, parse_key
from blocksim.scenario.spelling import USUAL, meant_word, nearest
from tests.golden import Golden
from tests.scenario.conftest import SCENARIOS

DATA = {
    "blocks": {"brick": {"width": 1}},
    "structures": ({"kind": "stack"}, {"kind": "none"}, 3),
    "friction": {"block_block": 0.3},
    "pairs": {"steel": {"oak": {"friction": 0.3}}},
}


KEYS = ["a", "a.b-c.0", ' a . "b.c" . \'d"\' ', r'"\u00e4\"."', '""']
NO_KEYS = ["", ".", "a.", ".a", "a b", "a..b", '"a', "ä", "a=b"]


def test_keys_are_read_as_in_toml(golden: Golden) -> None:
    golden("\n".join(f"{text!r}: {parse_key(text)}" for text in KEYS))
    for text in NO_KEYS:
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


WORDS = [("MPA", 0), ("widht", 1), ("wdth", 1), ("widthh", 1), ("wudth", 1), ("wudht", 1), ("wudht", 2), ("mn", 1)]


def test_nearest_allows_so_many_letters_replaced_added_dropped_or_swapped(golden: Golden) -> None:
    known = ["Pa", "MPa", "kPa", "height", "width"]
    golden("\n".join(f"{word}, {most}: {nearest(word, known, most=most)}" for word, most in WORDS))


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


def cut(text: str, span: Span) -> str:
    return text.split("\n")[span.line - 1][span.column : span.column + span.length]


def test_spans(golden: Golden) -> None:
    """A list is first mentioned at its first header."""
    places = locate(TEXT)
    spans = ((path, place.key.line, cut(TEXT, place.key), cut(TEXT, place.value)) for path, place in places.items())
    golden("\n".join(f"{'.'.join(map(str, path))}: line {line}, {key} = {value}" for path, line, key, value in spans))
