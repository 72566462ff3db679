"""What counts as standing, and which values a search tries, from the answers alone: no simulation."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given, strategies as st

from blocksim.study.criterion import DEFAULT, read_criterion
from blocksim.study.limit_plan import Change, SearchRange, changes_in, next_near, next_values
from tests.golden import Golden


def searched(span: SearchRange, answer: Callable[[float], str], tolerance: float) -> dict[float, str]:
    known: dict[float, str] = {}
    while values := next_values(span, known, tolerance):
        assert not set(values) & known.keys(), "no value is tried twice"
        known |= {value: answer(value) for value in values}
    return known


@given(st.floats(20.01, 39.99), st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_one_change_is_bracketed_as_narrowly_as_wanted(limit: float, tolerance: float) -> None:
    known = searched(SearchRange(20.0, 40.0, 9), lambda value: "stands" if value < limit else "falls", tolerance)
    (change,) = changes_in(known)
    assert change.low < limit <= change.high
    assert change.high - change.low <= tolerance * change.high
    assert (change.below, change.above) == ("stands", "falls")


def test_structures_that_stand_again_beyond_a_range_of_falling_have_all_changes_found() -> None:
    ends = (0.7362, 1.7066, 1.8733)  # g: a block under a one-sine pulse, Zhang and Makris
    known = searched(SearchRange(0.2, 2.2, 41), lambda value: str(sum(value >= end for end in ends) % 2), 1e-3)
    assert [math.isclose(one.low, end, rel_tol=1e-3) for one, end in zip(changes_in(known), ends, strict=True)]
    assert len(changes_in(known)) == len(ends)


@pytest.mark.parametrize("is_log", [False, True])
def test_an_island_between_two_values_of_the_scan_is_found_where_rotations_peak_beside_it(is_log: bool) -> None:
    span = SearchRange(0.264, 0.748, 9, is_log)
    known: dict[int | float, str] = {}
    while values := next_values(span, known, 1e-3, {value: 1.0 / (0.01 + abs(value - 0.47)) for value in known}):
        known |= {value: "falls" if 0.4613 < value < 0.4815 else "stands" for value in values}
    assert [round(one.low, 3) for one in changes_in(known)] == pytest.approx([0.461, 0.481], abs=1e-3)
    assert len(known) < 45
    alone = searched(span, lambda value: "falls" if 0.4613 < value < 0.4815 else "stands", 1e-3)
    assert len(changes_in(alone)) == 0


def test_whole_numbers_and_ratios_are_tried_where_they_are_asked_for() -> None:
    known = searched(SearchRange(1.0, 12.0, 4, is_whole=True), lambda value: str(value > 4), 1e-3)
    assert changes_in(known) == [Change(4.0, 5.0, "False", "True")]
    assert all(value.is_integer() for value in known)
    assert SearchRange(1e-3, 1e3, 7, is_log=True).grid() == [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3]


def test_a_change_at_zero_and_none_at_all_end_and_an_undecided_range_has_a_bracket_at_either_side() -> None:
    assert len(searched(SearchRange(-10.0, 10.0, 9), lambda value: str(value > 0.0), 1e-3)) < 60
    assert len(searched(SearchRange(0.0, 1.0, 9), lambda _: "falls", 1e-3)) == 9

    def undecided(value: float) -> str:
        return "stands" if value < 2.0 else "undecided" if value < 3.0 else "falls"

    changes = changes_in(searched(SearchRange(0.0, 10.0, 11), undecided, 1e-2))
    assert [(one.below, one.above) for one in changes] == [("stands", "undecided"), ("undecided", "falls")]


@given(st.floats(20.01, 39.99), st.floats(20.0, 40.0), st.floats(0.01, 1.0))
def test_a_change_near_a_value_is_found_wherever_it_is_in_the_range(limit: float, about: float, width: float) -> None:
    span, near = SearchRange(20.0, 40.0, 9), Change(about - width, about + width, "stands", "falls")
    known: dict[float, str] = {}
    while values := next_near(span, known, near, 1e-3):
        assert not set(values) & known.keys(), "no value is tried twice"
        known |= {value: "stands" if value < limit else "falls" for value in values}
    (change,) = changes_in(known)
    assert change.low < limit <= change.high
    assert change.high - change.low <= 1e-3 * change.high
    assert len(known) < 30


def test_a_change_that_is_not_in_the_range_is_not_looked_for_without_end() -> None:
    span, near = SearchRange(20.0, 40.0, 9), Change(30.0, 31.0, "stands", "falls")
    for answer in ("stands", "falls", "undecided"):
        known: dict[float, str] = {}
        while values := next_near(span, known, near, 1e-3):
            known |= dict.fromkeys(values, answer)
        assert changes_in(known) == []
        assert len(known) < 12


ROW = {"status": "finished", "reason": "at rest", "outcome": "slid", "displacement_mm": 4.9, "turn_deg": 30.0}
CONDITIONS = f"""{DEFAULT}; outcome != fell; outcome = slid | stands; outcome == slid; moved < 5 mm; moved < 0.0049 m;
    moved <= 0.491 cm; turned < 0.5 rad; turned<31deg; moved > 4 mm; moved < 5 mm, turned < 10 deg; moved < 4 mm"""


def test_conditions_are_judged_in_the_units_that_were_typed(golden: Golden) -> None:
    """By what is at rest and what moves on at its end; a run that failed neither stands nor falls."""
    told = []
    for text in map(str.strip, CONDITIONS.split(";")):
        rows = (ROW, {**ROW, "moves_on": True}, {"status": "invalid"})
        told.append(f"{text}: {', '.join(read_criterion(text).verdict(row) for row in rows)}")
    golden("\n".join(told))
