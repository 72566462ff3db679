"""Dotted keys: written, read, and followed through data and models."""

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario.models.contact import PairFriction
from blocksim.scenario.models.motion import FromTable
from blocksim.scenario.overrides import MISSING, field_at, follow, format_key, is_known, parse_key, table_at
from blocksim.scenario.structures.masonry import Stack

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


def test_follow() -> None:
    assert follow(DATA, ("structures", 0, "kind")) == "stack"
    assert follow(DATA, ()) is DATA
    nowhere: list[tuple[str | int, ...]] = [
        ("structures", 3),
        ("structures", -1),
        ("structures", "0"),
        ("nothing",),
        ("friction", "block_block", 0),
    ]
    for path in nowhere:
        assert follow(DATA, path) is MISSING


def test_the_model_of_a_table_depends_on_the_kind_of_structure() -> None:
    assert table_at(("structures", 0), DATA) is Stack
    assert table_at(("structures", 1), DATA) is None
    assert table_at(("structures", 2), DATA) is None
    assert table_at(("friction", "block_ground"), DATA) is PairFriction
    assert table_at(("time", "end"), DATA) is None
    assert table_at(("motion",), {"motion": {"kind": "table"}}) is FromTable
    assert table_at(("motion",), {"motion": {"kind": "none"}}) is None
    assert table_at(("motion",), DATA) is None


def test_the_field_of_a_key_is_found_by_its_name_in_the_file() -> None:
    assert field_at(("schema",), DATA) is not None
    assert field_at(("schema_version",), DATA) is None
    assert field_at((), DATA) is None


@pytest.mark.parametrize(
    ("path", "known"),
    [
        (("time", "end"), True),
        (("contact", "restitution"), True),
        (("contact", "restitution", "block_ground"), True),
        (("blocks", "brick"), True),
        (("blocks", "brick", "length"), True),
        (("structures", 0, "offset"), True),
        (("blocks", "stone"), False),
        (("structures", 0, "overlap"), False),
        (("structures", 9), False),
        (("time", "end", "x"), False),
        (("friction", "block_blok"), False),
        (("blocks", "stone", "length"), False),
        (("pairs", "steel"), True),
        (("pairs", "oak"), False),
        (("pairs", "steel", "oak"), True),
        (("pairs", "steel", "oak", "restitution"), True),
        (("pairs", "steel", "oak", "friction", "kinetic"), True),
        (("pairs", "steel", "ground", "restitution"), False),
        (("walls", 0, "from"), False),
        (("ground", "profile"), True),
    ],
)
def test_known_keys(path: tuple[str | int, ...], *, known: bool) -> None:
    assert is_known(path, DATA) is known
