"""Misspelt words."""

import pytest

from blocksim.scenario.spelling import nearest, slips


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
