"""What pictures know of a sweep: names that fit, classes of outcomes, blocks worth drawing."""

import numpy as np

from blocksim.view.sweeps.found import FoundSweep, Input, short_names, told_outcome
from tests.view.sweeps.made_up import made_up


def test_keys_get_the_shortest_ends_that_tell_them_apart() -> None:
    keys = ["friction.block_block.static", "friction.block_ground.static", "contact.restitution", "gravity"]
    assert short_names(keys) == ["block_block.static", "block_ground.static", "restitution", "gravity"]
    assert short_names(["a", "b.a"]) == ["a", "b.a"]


def test_outcomes_are_quarters_of_a_turn_and_none_where_a_case_failed() -> None:
    sweep = made_up((Input("gravity", "", np.arange(4.0)),), failed=1)
    turns = np.array([[np.nan, np.nan], [0.4, -89.0], [0.0, 44.0], [-0.2, -181.0]])
    other = FoundSweep(sweep.title, "grid", sweep.inputs, sweep.blocks, sweep.x_mm, turns, sweep.finished)
    assert other.outcomes == [None, (0, -90), (0, 0), (0, -180)]


def test_classes_of_many_blocks_are_counted() -> None:
    assert told_outcome((0, -90)) == "0°/−90°"
    assert told_outcome((0, 90, 0, 0, 0, -90, 0)) == "2 of 7 turned"


def test_blocks_that_stay_are_not_worth_drawing() -> None:
    assert made_up((Input("gravity", "", np.arange(4.0)),)).moving == [1]


def test_values_are_reported_with_their_units_and_words_as_they_are() -> None:
    assert Input("gravity", "m/s^2", np.array([9.81])).told(9.81) == "9.81 m/s^2"
    assert Input("time.scheme", "", np.array([0.0, 1.0]), ("explicit", "nonsmooth")).told(1.0) == "nonsmooth"
