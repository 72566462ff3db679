"""Lines: a sweep taken apart into series, and drawn so that points are joined only where that is honest."""

import numpy as np
import pytest

from blocksim.view.sweeps.data import MOST_ROWS, Input, SweepData, choose_movers
from blocksim.view.sweeps.lines import is_smooth, series_of
from tests.view.drawings import series
from tests.view.sweeps.made_up import made_up

GRAVITY = Input("gravity", "m/s^2", np.array([9.81, 1.0, 5.0, 9.81, 1.0, 5.0]))
RESTITUTION = Input("contact.restitution", "", np.repeat([0.1, 0.5], 3))
ONE = Input("gravity", "", np.array([3.0, 1.0, 2.0]))


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
