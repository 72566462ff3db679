"""Misspelt words."""

from pathlib import Path

import pytest

from blocksim.scenario.spelling import USUAL, meant_word, nearest, slips


@pytest.mark.parametrize(
    ("left", "right", "count"),
    [
        ("mm", "mm", 0),
        ("mn", "mm", 1),
        ("MPA", "MPa", 0),
        ("widht", "width", 1),
        ("", "abc", 3),
        ("abcd", "bcde", 2),
    ],
)
def test_slips_count_letters_replaced_added_dropped_or_swapped(left: str, right: str, count: int) -> None:
    assert slips(left, right) == slips(right, left) == count


def test_nearest_prefers_a_word_of_the_same_length() -> None:
    assert nearest("mn", ["m", "min", "mm"], most=1) == "mm"
    assert nearest("mn", ["kPa"], most=1) is None


def test_symbols_of_papers_and_other_programs_lead_to_the_key_of_the_table() -> None:
    assert meant_word("vx", ["x", "y", "velocity"]) == "velocity"
    assert meant_word("e", ["young_modulus", "density"]) == "young_modulus"
    assert meant_word("e", ["model", "restitution"]) == "restitution"
    assert meant_word("vx", ["x", "y"]) is None


def test_words_of_other_programs_lead_to_keys_that_exist() -> None:
    keys = (Path(__file__).parents[2] / "scenarios/README.md").read_text("utf-8")
    known = {row.split("`")[1].rpartition(".")[2] for row in keys.splitlines() if row.startswith("| `")}
    assert {key for meant in USUAL.values() for key in meant} - {"speed", "restitution"} <= known
