"""Output times fall on the nearest steps and are never skipped."""

import pytest

from blocksim.simulation.instruments import Recorder


def steps_of(recorder: Recorder, last: int) -> list[int]:
    done, found = 0, [0]
    while done < last:
        done = recorder.next_step(done)
        found.append(done)
    return found


@pytest.mark.parametrize(
    ("every", "step", "expected"),
    [
        (1.0, 0.25, [0, 4, 8, 12]),
        (1.0, 0.4, [0, 2, 5, 8, 10, 12]),  # 2.5, 5, 7.5, 10, 12.5 steps
        (0.1, 1.0, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]),
    ],
)
def test_frames_fall_on_the_nearest_steps(every: float, step: float, expected: list[int]) -> None:
    assert steps_of(Recorder([], every, step), 12) == expected


def test_frames_do_not_drift_over_a_long_run() -> None:
    recorder = Recorder([], 1e-3, 2.984e-7)
    steps = steps_of(recorder, 7_000_000)
    assert all(abs(step * 2.984e-7 - k * 1e-3) < 2.984e-7 for k, step in enumerate(steps))


def test_frames_until_a_step_are_those_up_to_it_and_at_it() -> None:
    recorder = Recorder((), 1.0, 0.2)
    recorder.steps = [0, 5, 10]
    assert [recorder.count_until(step) for step in (0, 4, 5, 9, 10)] == [1, 1, 2, 2, 3]
