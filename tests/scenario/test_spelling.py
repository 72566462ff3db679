"""Misspelt words."""

from pathlib import Path

import pytest

from blocksim.scenario.spelling import USUAL, meant_word, nearest


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


def test_symbols_of_papers_and_other_programs_lead_to_the_key_of_the_table() -> None:
    assert meant_word("vx", ["x", "y", "velocity"]) == "velocity"
    assert meant_word("e", ["young_modulus", "density"]) == "young_modulus"
    assert meant_word("e", ["model", "restitution"]) == "restitution"
    assert meant_word("vx", ["x", "y"]) is None


def test_words_of_other_programs_lead_to_keys_that_exist() -> None:
    keys = (Path(__file__).parents[2] / "scenarios/README.md").read_text("utf-8")
    known = {row.split("`")[1].rpartition(".")[2] for row in keys.splitlines() if row.startswith("| `")}
    assert {key for meant in USUAL.values() for key in meant} - {"speed", "restitution"} <= known
