"""Maps: cells where they belong, what agrees outlined, classes and colours."""

from dataclasses import replace

import numpy as np
import pytest

from blocksim.view.sweeps.data import Input, SweepData, percent
from blocksim.view.sweeps.outcome_map import (
    CLASS_COLOURS,
    OTHER_COLOUR,
    classes_of,
    edges_of,
    manners_of,
    outline_of,
    run_out_scale,
)
from tests.view.sweeps.made_up import grid, made_up


def test_case_that_failed_has_a_class_of_its_own() -> None:
    found = classes_of(made_up(grid(), failed=1))
    assert found.numbers[0] == found.numbers.max() == len(found.labels) - 1
    assert found.labels[-1].startswith("failed")


def test_edges_lie_midway_between_cells() -> None:
    assert edges_of(np.array([1.0, 2.0, 4.0]), is_log=False).tolist() == [0.5, 1.5, 3.0, 5.0]
    assert edges_of(np.array([1.0, 100.0]), is_log=True).tolist() == pytest.approx([0.1, 10.0, 1000.0])
    assert edges_of(np.array([3.0]), is_log=False).tolist() == [1.5, 4.5]
    low, high = edges_of(np.zeros(1), is_log=False)
    assert low < 0.0 < high


def test_outline_goes_once_around_cells_that_agree() -> None:
    edges = np.arange(4.0)
    middle = np.zeros((3, 3), dtype=bool)
    middle[1, 1] = True
    sides = {tuple(side) for side in outline_of(middle, edges, edges)}
    corners = [(1.0, 1.0), (2.0, 1.0), (1.0, 2.0), (2.0, 2.0)]
    a, b, c, d = corners
    assert sides == {(a, b), (a, c), (b, d), (c, d)}
    assert len(outline_of(np.ones((3, 3), dtype=bool), edges, edges)) == 12  # the border alone
    assert outline_of(np.zeros((3, 3), dtype=bool), edges, edges) == []


def test_measured_class_comes_first_and_rare_ones_are_taken_together() -> None:
    count = 8
    turns = np.column_stack([np.zeros(count), -90.0 * np.array([2, 2, 2, 1, 3, 4, 5, 6])])
    made = made_up((Input("gravity", "", np.arange(1.0, count + 1.0)),), failed=0)
    classes = classes_of(
        SweepData(made.title, "grid", made.inputs, made.blocks, made.x_mm, turns, made.finished, None, made.measured)
    )
    assert classes.labels[0] == "0°/−90° (measured): 12 %"
    assert classes.labels[1] == "0°/−180°: 38 %"
    assert classes.labels[-2] == "others: 12 %"
    assert classes.numbers.tolist()[:4] == [1.0, 1.0, 1.0, 0.0]
    assert classes.colours[: len(CLASS_COLOURS)] == CLASS_COLOURS
    assert classes.colours[-2] == OTHER_COLOUR


def test_shares_are_never_rounded_to_nothing_or_everything() -> None:
    assert [percent(share) for share in (0.0, 0.0004, 0.03, 0.9999, 1.0)] == ["0 %", "0.04 %", "3 %", "99 %", "100 %"]


def test_colours_change_at_round_run_outs_and_span_nearly_all() -> None:
    _, norm = run_out_scale(np.linspace(61.0, 79.0, 200))
    assert norm.boundaries.tolist() == [60.0, 62.5, 65.0, 67.5, 70.0, 72.5, 75.0, 77.5, 80.0]
    _, norm = run_out_scale(np.full(5, 70.0))
    assert norm.boundaries[0] <= 69.5
    assert norm.boundaries[-1] >= 70.5


def test_cases_are_classed_by_how_they_ended_where_that_is_known() -> None:
    made = replace(
        made_up((Input("gravity", "", np.arange(4.0)),), failed=1), manners=("fell", "fell", "stands", "fell")
    )
    found = manners_of(made)
    assert found.labels == ("stands: 25 %", "fell: 50 %", "failed: 25 %")
    assert found.numbers.tolist() == [2.0, 1.0, 0.0, 1.0]
