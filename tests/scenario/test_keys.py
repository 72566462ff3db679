"""Dotted keys and words that are misspelt, pairs of materials, and values that are hardly meant."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import GROUND, Document, Model, resolve_pair, scenario_from_mapping
from blocksim.scenario.document import Span, locate
from blocksim.scenario.overrides import format_key, is_known, parse_key
from blocksim.scenario.spelling import USUAL, meant_word, nearest
from tests.golden import Golden
from tests.scenario.conftest import MATERIAL, SCENARIOS, data_of
from tests.soils import column, scene

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


MATERIALS = {"oak": MATERIAL, "steel": MATERIAL, "sand": MATERIAL, "S235.JR": MATERIAL}
QUANTITIES = ("restitution", "normal_stiffness", "shear_stiffness_ratio", "shear_damping_ratio")


def test_the_nearest_key_decides_and_is_named(golden: Golden) -> None:
    told = []
    for name, case in tomllib.loads(Path(__file__).with_name("pairs.toml").read_text()).items():
        made = scenario_from_mapping(data_of(materials=MATERIALS, **case.get("tables", {})))
        pair = resolve_pair(made, case["one"], case.get("other", GROUND), ground=case.get("ground", False))
        values = {"friction": pair.friction.static} | {quantity: getattr(pair, quantity) for quantity in QUANTITIES}
        told.append(f"{name}: {', '.join(f'{key} = {value} ({pair.rules[key]})' for key, value in values.items())}")
    golden("\n".join(told))


THREE_BLOCKS = SCENARIOS / "three_blocks.toml"
APART = THREE_BLOCKS.with_name("bounce.toml")  # one block, of any size


VALUES: dict[str, list[dict[str, Any]]] = tomllib.loads(Path(__file__).with_name("plausible.toml").read_text())


def test_values_that_are_hardly_meant_are_warned_of(golden: Golden) -> None:
    scenarios = [
        *((values, Document.read(THREE_BLOCKS).with_values(values).build()) for values in VALUES["three_blocks"]),
        *(
            (values, Document.read(APART).with_values({**values, "bodies.0.y": 500}).build())
            for values in VALUES["bounce"]
        ),
        *((values, Document.read(APART).with_values(values).build()) for values in VALUES["after_end"]),
        *((values, scene({**column(0.1, 0.05, 0.005), **values})) for values in VALUES["soil"]),
    ]
    golden("\n\n".join("\n".join([json.dumps(values), *Model(one).implausible_values]) for values, one in scenarios))


def test_a_drawing_in_mm_that_is_read_in_m_is_warned_of(tmp_path: Path) -> None:
    squares = [[[0, 25 * i], [50, 25 * i], [50, 25 + 25 * i], [0, 25 + 25 * i]] for i in range(3)]
    drawing = {"type": "MultiPolygon", "coordinates": [[[*one, one[0]]] for one in squares]}
    (tmp_path / "wall.geojson").write_text(json.dumps(drawing))
    for unit, count in ({}, 1), ({"unit": "1 mm"}, 0):
        structure = {"kind": "polygons", "table": "wall.geojson", "block": "stone", **unit}
        stone = {"blocks.stone": {"depth": 0.1, "material": "aluminium"}, "structures": [structure], "bodies": []}
        found = Model(replace(Document.read(APART).with_values(stone), folder=tmp_path).build()).implausible_values
        assert found == ['structures.0: blocks of 55.9 m; for a drawing in mm add unit = "1 mm"'] * count
