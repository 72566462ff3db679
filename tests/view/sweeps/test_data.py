"""What pictures know of a sweep: names that fit, axes that can be read, classes of outcomes, blocks worth drawing."""

import numpy as np
import pytest

from blocksim.view.sweeps.data import Input, InputUnit, SweepData, outcome_label, short_names, value_axis
from tests.view.sweeps.made_up import made_up


def test_outcomes_are_quarters_of_a_turn_and_none_where_a_case_failed() -> None:
    sweep = made_up((Input("gravity", "", np.arange(4.0)),), failed=1)
    turns = np.array([[np.nan, np.nan], [0.4, -89.0], [0.0, 44.0], [-0.2, -181.0]])
    other = SweepData(sweep.title, "grid", sweep.inputs, sweep.blocks, sweep.x_mm, turns, sweep.finished)
    assert other.outcomes == [None, (0, -90), (0, 0), (0, -180)]


def test_classes_of_many_blocks_are_counted() -> None:
    assert outcome_label((0, -90)) == "0°/−90°"
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


@pytest.mark.parametrize(
    ("values", "unit", "label", "shown", "is_log"),
    [
        ([0.001, 0.1, 1.0], "", "key", [0.001, 0.1, 1.0], True),
        ([0.2, 0.3, 0.4], "", "key", [0.2, 0.3, 0.4], False),
        ([0.009, 0.010, 0.011], "m", "key (mm)", [9.0, 10.0, 11.0], False),
        ([0.0099995, 0.01, 0.0100005], "m", "key − 10 mm (nm)", [-500.0, 0.0, 500.0], False),
        ([60e9, 70e9], "Pa", "key (GPa)", [60.0, 70.0], False),
        ([0.0, np.pi / 6.0], "rad", "key (°)", [0.0, 30.0], False),
        ([-2e6, 2e6], "N/m", "key (10^6 N/m)", [-2.0, 2.0], False),
        ([3.0, 3.0], "", "key", [3.0, 3.0], False),
        ([0.0, 0.0], "s", "key (s)", [0.0, 0.0], False),
    ],
)
def test_axis_shows_values_so_that_they_can_be_read(
    values: list[float], unit: str, label: str, shown: list[float], is_log: bool
) -> None:
    axis = value_axis(np.array(values), "key", unit)
    assert (axis.label, axis.is_log) == (label, is_log)
    assert axis.scale(np.array(values)).tolist() == pytest.approx(shown, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "typed", "label", "shown"),
    [
        ([0.09, 0.1, 0.12], InputUnit("cm", 0.01), "key (cm)", [9.0, 10.0, 12.0]),
        ([0.1, 3.1], InputUnit("mm", 0.001), "key (mm)", [100.0, 3100.0]),  # over decades
        ([0.9995, 1.0, 1.0005], InputUnit("cm", 0.01), "key − 100 cm (cm)", [-0.05, 0.0, 0.05]),
        ([0.0099995, 0.01, 0.0100005], InputUnit("mm", 0.001), "key − 10 mm (nm)", [-500.0, 0.0, 500.0]),
    ],
)
def test_axis_keeps_the_typed_unit(values: list[float], typed: InputUnit, label: str, shown: list[float]) -> None:
    axis = value_axis(np.array(values), "key", "m", typed=typed)
    assert axis.label == label
    assert axis.scale(np.array(values)).tolist() == pytest.approx(shown)


def test_keys_get_the_shortest_ends_that_tell_them_apart() -> None:
    keys = ["friction.block_block.static", "friction.block_ground.static", "contact.restitution", "gravity"]
    assert short_names(keys) == ["block_block.static", "block_ground.static", "contact.restitution", "gravity"]
    assert short_names(["a", "b.a"]) == ["a", "b.a"]
    assert short_names(["time.end", "structures.0.rows"]) == ["time.end", "structures.0.rows"]  # of what, too
