"""Lines: a sweep taken apart into series."""

import numpy as np

from blocksim.view.sweeps.found import Input
from blocksim.view.sweeps.lines import series_of
from tests.view.sweeps.made_up import made_up

GRAVITY = Input("gravity", "m/s^2", np.array([9.81, 1.0, 5.0, 9.81, 1.0, 5.0]))
RESTITUTION = Input("contact.restitution", "", np.repeat([0.1, 0.5], 3))


def test_one_key_gives_one_series_in_the_order_of_its_values() -> None:
    (series,) = series_of(made_up((Input("gravity", "", np.array([3.0, 1.0, 2.0])),)))
    assert series.values.tolist() == [1.0, 2.0, 3.0]
    assert series.x_mm[:, 1].tolist() == [60.0, 75.0, 90.0]
    assert series.label == ""


def test_second_key_gives_a_series_for_each_of_its_values() -> None:
    found = list(series_of(made_up((GRAVITY, RESTITUTION))))
    assert [one.label for one in found] == ["contact.restitution = 0.1", "contact.restitution = 0.5"]
    assert all(one.values.tolist() == [1.0, 5.0, 9.81] for one in found)


def test_keys_that_go_together_are_one_series() -> None:
    (series,) = series_of(made_up((GRAVITY, RESTITUTION), "list"))
    assert len(series.values) == 6


def test_failed_cases_are_left_out() -> None:
    (series,) = series_of(made_up((Input("gravity", "", np.array([1.0, 2.0, 3.0])),), failed=1))
    assert series.values.tolist() == [2.0, 3.0]
