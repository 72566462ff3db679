"""Compiled calls end soon enough for signals to be heard, and are not shorter than they need to be."""

import pytest

from blocksim.simulation.pace import CALL_SECONDS, MOST_GROWTH, Pace


@pytest.mark.parametrize("seconds_a_step", [1e-7, 1e-4, 0.5])
def test_calls_come_to_last_as_long_as_wanted(seconds_a_step: float) -> None:
    pace = Pace(bodies=4)
    for _ in range(20):
        pace.learn(pace.steps, pace.steps * seconds_a_step)
    assert pace.steps * seconds_a_step == pytest.approx(max(CALL_SECONDS, seconds_a_step), rel=0.01)


def test_quick_first_steps_do_not_make_a_call_endless() -> None:
    pace = Pace(bodies=4)
    before = pace.steps
    pace.learn(1, 0.0)
    assert pace.steps <= MOST_GROWTH * before


def test_there_is_always_a_step_to_take() -> None:
    assert Pace(bodies=10**9).steps == 1
