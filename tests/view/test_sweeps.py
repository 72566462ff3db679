"""What pictures know of a sweep: names that fit, axes that can be read, series, cells, classes, blocks to draw."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.view.kinds import RUN_KINDS, SWEEP_KINDS, run_kind
from blocksim.view.sweeps.data import (
    MOST_ROWS,
    Input,
    InputUnit,
    SweepData,
    choose_movers,
    outcome_label,
    percent,
    short_names,
    value_axis,
)
from blocksim.view.sweeps.lines import is_smooth, series_of
from blocksim.view.sweeps.outcome_map import (
    CLASS_COLOURS,
    OTHER_COLOUR,
    classes_of,
    manners_of,
    run_out_scale,
)
from blocksim.view.sweeps.scatter import MOST_INPUTS, limits_of, variables_of
from tests.view.drawings import series
from tests.view.made_up import boxes_of, overlapping
from tests.view.made_up_sweeps import REPEATS, grid, made_up, samples

GRAVITY = Input("gravity", "m/s^2", np.array([9.81, 1.0, 5.0, 9.81, 1.0, 5.0]))
RESTITUTION = Input("contact.restitution", "", np.repeat([0.1, 0.5], 3))
ONE = Input("gravity", "", np.array([3.0, 1.0, 2.0]))


def turned(turns: NDArray[np.float64]) -> SweepData:
    """Return a sweep with these turns (cases, 2), in degrees."""
    return replace(made_up((Input("gravity", "", np.arange(1.0, len(turns) + 1.0)),)), rotation_deg=turns, inside=None)


def test_outcomes_are_quarters_of_a_turn_and_none_where_a_case_failed() -> None:
    sweep = turned(np.array([[np.nan, np.nan], [0.4, -89.0], [0.0, 44.0], [-0.2, -181.0]]))
    assert replace(sweep, finished=np.arange(4) > 0).outcomes == [None, (0, -90), (0, 0), (0, -180)]


def test_classes_of_many_blocks_are_counted() -> None:
    assert outcome_label((0, 90, 0, 0, 0, -90, 0)) == "2 of 7 turned"


@pytest.mark.parametrize(
    ("key", "unit", "value", "expected"),
    [
        ("gravity", "m/s^2", 9.81, "9.81 m/s^2"),
        ("gravity", "", 5.0, "5"),
        ("structures.0.overlap", "m", 0.009, "9 mm"),
        ("ground.tilt", "rad", np.radians(-5.0), "−5 °"),
    ],
)
def test_values_are_reported_in_the_unit_in_which_they_are_best_read(
    key: str, unit: str, value: float, expected: str
) -> None:
    assert Input(key, unit, np.array([0.1 * value, value])).label(value) == expected


CM, MM = InputUnit("cm", 0.01), InputUnit("mm", 0.001)


@pytest.mark.parametrize(
    ("values", "unit", "typed", "label", "shown", "is_log"),
    [
        ([0.001, 0.1, 1.0], "", None, "key", [0.001, 0.1, 1.0], True),
        ([0.2, 0.3, 0.4], "", None, "key", [0.2, 0.3, 0.4], False),
        ([0.009, 0.010, 0.011], "m", None, "key (mm)", [9.0, 10.0, 11.0], False),
        ([0.0099995, 0.01, 0.0100005], "m", None, "key − 10 mm (nm)", [-500.0, 0.0, 500.0], False),
        ([60e9, 70e9], "Pa", None, "key (GPa)", [60.0, 70.0], False),
        ([0.0, np.pi / 6.0], "rad", None, "key (°)", [0.0, 30.0], False),
        ([-2e6, 2e6], "N/m", None, "key (10^6 N/m)", [-2.0, 2.0], False),
        ([3.0, 3.0], "", None, "key", [3.0, 3.0], False),
        ([0.0, 0.0], "s", None, "key (s)", [0.0, 0.0], False),
        ([0.09, 0.1, 0.12], "m", CM, "key (cm)", [9.0, 10.0, 12.0], False),
        ([0.1, 3.1], "m", MM, "key (mm)", [100.0, 3100.0], True),
        ([0.9995, 1.0, 1.0005], "m", CM, "key − 100 cm (cm)", [-0.05, 0.0, 0.05], False),
        ([0.0099995, 0.01, 0.0100005], "m", MM, "key − 10 mm (nm)", [-500.0, 0.0, 500.0], False),
    ],
)
def test_axis_shows_values_so_that_they_can_be_read_and_in_the_typed_unit(
    values: list[float], unit: str, typed: InputUnit | None, label: str, shown: list[float], is_log: bool
) -> None:
    axis = value_axis(np.array(values), "key", unit, typed=typed)
    assert (axis.label, axis.is_log) == (label, is_log)
    assert axis.scale(np.array(values)).tolist() == pytest.approx(shown, abs=1e-6)


def test_keys_get_the_shortest_ends_that_tell_them_apart() -> None:
    keys = ["friction.block_block.static", "friction.block_ground.static", "contact.restitution", "gravity"]
    assert short_names(keys) == ["block_block.static", "block_ground.static", "contact.restitution", "gravity"]
    assert short_names(["a", "b.a"]) == ["a", "b.a"]
    assert short_names(["time.end", "structures.0.rows"]) == ["time.end", "structures.0.rows"]  # of what, too


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        (made_up((ONE,)), {"": [1.0, 2.0, 3.0]}),
        (made_up((GRAVITY, RESTITUTION)), {f"contact.restitution = {e}": [1.0, 5.0, 9.81] for e in (0.1, 0.5)}),
        (made_up((GRAVITY, RESTITUTION), "list"), {"": [1.0, 1.0, 5.0, 5.0, 9.81, 9.81]}),  # go together
        (made_up((ONE,), failed=1), {"": [1.0, 2.0]}),
        (
            made_up((GRAVITY, RESTITUTION), failed=1),
            {"contact.restitution = 0.1": [1.0, 5.0], "contact.restitution = 0.5": [1.0, 5.0, 9.81]},
        ),
    ],
)
def test_each_value_of_a_second_key_has_a_series_in_the_order_of_the_first(
    sweep: SweepData, expected: dict[str, list[float]]
) -> None:
    found = list(series_of(sweep))
    assert {one.label: one.values.tolist() for one in found} == expected
    assert all(len(one.x_mm) == len(one.values) for one in found)


def test_places_go_with_their_values() -> None:
    (found,) = series_of(made_up((ONE,)))
    assert found.x_mm[:, 1].tolist() == [60.0, 75.0, 90.0]


def test_only_smooth_series_are_joined() -> None:
    assert is_smooth(np.array([70.0, 70.5, 71.0, 70.9]))
    assert is_smooth(np.array([70.0, 70.001, 70.0, 70.002]))
    assert not is_smooth(np.array([70.0, 73.0, 70.0, 73.0]))


def test_blocks_that_stay_are_left_out_and_many_are_cut() -> None:
    chosen = {count: choose_movers(np.ptp(series(count).x_mm, axis=0)) for count in (1, 3, 60)}
    assert chosen == {1: [0], 3: [1, 2], 60: list(range(60 - MOST_ROWS, 60))}


def test_measured_class_comes_first_and_rare_ones_are_taken_together() -> None:
    turns = -90.0 * np.array([2, 2, 2, 1, 3, 4, 5, 6])
    classes = classes_of(turned(np.column_stack([np.zeros(8), turns])))
    assert classes.labels[:2] == ("0°/−90° (measured): 12 %", "0°/−180°: 38 %")
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


def test_words_are_spread_so_that_dots_do_not_hide_each_other() -> None:
    *_, word, block = variables_of(made_up(samples(2), "sobol"))
    assert word.levels == ("explicit", "nonsmooth")
    assert len(np.unique(word.values)) == 50
    assert np.round(word.values).tolist() == [number % 2 for number in range(50)]
    assert block.repeats is not None
    assert block.repeats.tolist() == REPEATS.tolist()


def test_many_inputs_are_cut() -> None:
    assert len(variables_of(made_up(samples(20), "sobol"))) == MOST_INPUTS + 1


def test_axis_leaves_out_the_rarest_run_outs_but_nothing_measured() -> None:
    x = np.append(np.linspace(60.0, 80.0, 999), 1000.0)
    low, high = limits_of(x, np.array([50.0, 85.0]))
    assert 49.0 > low > 45.0
    assert 85.0 < high < 90.0
    low, high = limits_of(np.full(3, 70.0), np.empty(0))
    assert low < 70.0 < high


LONE = (Input("gravity", "m/s^2", np.linspace(1.0, 10.0, 8)),)
MEMBER = tuple(Input(one.key, one.unit, one.values[:1]) for one in samples()[:1])
SWEEPS = {
    "one key": (made_up(LONE), "lines"),
    "a word alone": (made_up(samples()[3:], "list"), "histogram"),
    "one key, drawn": (made_up(samples(1)[:1], "lhs"), "lines"),
    "grid": (made_up(grid()), "map"),
    "grid, some failed": (made_up(grid(), failed=5), "map"),
    "grid without measurements": (made_up(grid(), measured=False), "map"),
    "grid in columns": (made_up(grid(3)), "map"),
    "grid with too many columns": (made_up(grid(6)), "matrix"),
    "two keys, drawn": (made_up(samples(2)[:2], "sobol"), "map"),
    "drawn": (made_up(samples(4), "sobol", failed=3), "matrix"),
    "one member": (made_up(MEMBER, "sobol"), "lines"),
    "two keys of one member": (made_up(tuple(Input(str(i), "", np.ones(1)) for i in range(2)), "grid"), "lines"),
}
ODD = ("a word alone", "grid, some failed", "grid without measurements", "drawn", "one member")  # in all their kinds
DRAWN = [
    (name, kind)
    for name, (sweep, own) in SWEEPS.items()
    for kind in SWEEP_KINDS
    if (kind == own or name in ODD) and not SWEEP_KINDS[kind].refusal(sweep)
]


def test_kinds_are_found_and_misspelt_ones_told() -> None:
    assert [run_kind(name) for name in RUN_KINDS] == list(RUN_KINDS.values())
    with pytest.raises(InvalidInputError, match="--kind histroy: unknown kind for a run, did you mean 'history'"):
        run_kind("histroy")
    with pytest.raises(InvalidInputError, match="choose strip, final, history"):
        run_kind("pie chart")


@pytest.mark.parametrize(("sweep", "kind"), SWEEPS.values(), ids=SWEEPS)
def test_a_sweep_gets_the_picture_that_suits_it(sweep: SweepData, kind: str) -> None:
    assert next(name for name, picture in SWEEP_KINDS.items() if picture.suits(sweep)) == kind


@pytest.mark.parametrize(("name", "kind"), DRAWN)
def test_every_kind_draws_what_it_does_not_refuse(caught: list[Figure], name: str, kind: str) -> None:
    SWEEP_KINDS[kind].draw(SWEEPS[name][0], Path("picture.svg"))
    assert overlapping(caught[0]) == []
    assert "made up" in [text for text, _ in boxes_of(caught[0])]
