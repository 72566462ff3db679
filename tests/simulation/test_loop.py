"""The loop is heard between outputs too, and stops where it should."""

from pathlib import Path

import pytest

from blocksim.scenario import load_scenario, place_bodies
from blocksim.simulation import loop, simulate
from blocksim.simulation.instruments import Recorder
from blocksim.simulation.loop import CALL_SECONDS, MOST_GROWTH, steps_of_call
from blocksim.world.build import build_world
from tests.simulation.conftest import Shipped


def test_rare_output_does_not_make_the_loop_deaf(soft: Shipped) -> None:
    scenario = soft(time__end=20.0, time__stop_at_rest=False)
    world = build_world(scenario)
    recorder = Recorder(place_bodies(scenario), 100.0, float(world.controls[0].step))
    seen: list[loop.Progress] = []
    control = loop.RunControl(seen.append, lambda: "enough" if len(seen) == 3 else "")
    ended = loop.run_loop(world, recorder, 20.0, control=control)
    assert (ended.outcome.status, ended.outcome.reason, ended.outcome.exit_code) == ("interrupted", "enough", 75)
    assert len(seen) == 3
    assert recorder.steps == [0, seen[-1].steps]
    assert 0 < seen[0].steps < seen[1].steps < seen[2].steps < recorder.next_step(0)


def test_stop_before_the_first_step_leaves_one_frame(soft: Shipped) -> None:
    scenario = soft()
    world = build_world(scenario)
    recorder = Recorder(place_bodies(scenario), 1e-3, float(world.controls[0].step))
    ended = loop.run_loop(world, recorder, 1.0, control=loop.RunControl(stop=lambda: "at once"))
    assert ended.outcome.status == "interrupted"
    assert recorder.steps == [0]


@pytest.mark.parametrize(("end", "step", "last"), [(1.0, 0.25, 4), (1.0, 0.3, 3), (1e-9, 1.0, 1)])
def test_last_step_is_the_nearest_and_at_least_one(end: float, step: float, last: int) -> None:
    assert loop.last_step_of(end, step) == last


def test_loss_of_energy_fails_a_run(soft: Shipped, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("blocksim.simulation.balance.RESIDUAL_LIMIT", 1e-30)
    scenario = soft(time__end=0.25)
    world = build_world(scenario)
    recorder = Recorder(place_bodies(scenario), 1e-2, float(world.controls[0].step))
    ended = loop.run_loop(world, recorder, 0.25)
    assert (ended.outcome.status, ended.outcome.exit_code) == ("failed", 76)
    assert "the fastest is block " in ended.outcome.reason


def test_body_that_hangs_in_the_air_does_not_rest_however_slowly_it_falls() -> None:
    shipped = Path(__file__).parents[2] / "scenarios" / "bounce.toml"
    slow = {"gravity": 0.001, "time.stop_at_rest": True, "time.end": 0.08, "contact.stiffness_scale": 0.001}
    assert simulate(load_scenario(shipped, slow)).reason == "end of simulated time"


@pytest.mark.parametrize("seconds_a_step", [1e-7, 1e-4, 0.5])
def test_calls_come_to_last_as_long_as_wanted(seconds_a_step: float) -> None:
    steps = 25_000
    for _ in range(20):
        steps = steps_of_call(steps, steps, steps * seconds_a_step)
    assert steps * seconds_a_step == pytest.approx(max(CALL_SECONDS, seconds_a_step), rel=0.01)


def test_quick_first_steps_do_not_make_a_call_endless() -> None:
    assert steps_of_call(25_000, 1, 0.0) <= MOST_GROWTH * 25_000


def test_there_is_always_a_step_to_take() -> None:
    assert steps_of_call(1, 1, 1e6) == 1
