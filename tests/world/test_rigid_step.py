"""How far blocks may go in a step while contacts are held: automatic steps shrink, those by hand are refused."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.bench.scenes import pushed_wall
from blocksim.verification.scene import HEIGHT, scenario_of
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.rigid_step import SHARE, USUAL_STEP, StepTooLongError
from blocksim.world.step import UncountableStepsError

if TYPE_CHECKING:
    from collections.abc import Mapping

G = 9.81
RESTING = {"y": HEIGHT / 2}


def step_of(body: Mapping[str, object], **time: Any) -> float:
    tables = {"ground": time.pop("ground", {}), "friction": time.pop("friction", {})}
    scenario = scenario_of([body], time={"scheme": "nonsmooth", **time}, **tables)
    return float(build_nonsmooth(scenario).world.controls[0].step)


def test_slow_scenes_take_the_usual_step() -> None:
    assert step_of(RESTING) == USUAL_STEP
    assert step_of(RESTING, end=1e-4) == 1e-4


def test_fast_blocks_shrink_the_automatic_step_to_a_tenth_of_the_smallest_side() -> None:
    assert step_of({**RESTING, "velocity": [50.0, 0.0]}) == pytest.approx(SHARE * HEIGHT / 50.0, rel=1e-3)
    high = step_of({"y": 5.0})
    assert high * sqrt(2.0 * G * 5.0) == pytest.approx(SHARE * HEIGHT, rel=1e-2)


def test_only_slopes_that_friction_does_not_hold_shrink_the_step() -> None:
    friction = {"block_block": 0.5, "block_ground": 0.5}
    assert step_of(RESTING, ground={"tilt": "20 deg"}, friction=friction, end=10.0) == USUAL_STEP
    assert step_of(RESTING, ground={"tilt": "40 deg"}, friction=friction, end=10.0) < 0.5 * USUAL_STEP


def test_friction_that_matters_is_that_of_what_blocks_can_slide_on_for_long() -> None:
    friction = {"block_block": 0.1, "block_ground": 0.5}
    values: dict[str, Any] = {"ground": {"tilt": "20 deg"}, "friction": friction, "end": 10.0}
    assert step_of(RESTING, **values) == USUAL_STEP
    plank = {"x": 1.0, "y": HEIGHT / 2, "width": 1.0, "fixed": True}
    tables = {"ground": values["ground"], "friction": friction}
    scenario = scenario_of([RESTING, plank], time={"scheme": "nonsmooth", "end": 10.0}, **tables)
    assert build_nonsmooth(scenario).world.controls[0].step < 0.5 * USUAL_STEP


@pytest.mark.parametrize(("step", "substeps", "is_fine"), [(1e-3, 4, True), (5e-3, 4, False), (1.5e-3, 1, False)])
def test_step_by_hand_is_refused_where_a_fall_is_too_long_for_its_substeps(
    step: float, substeps: int, is_fine: bool
) -> None:
    wall = pushed_wall(40, 25, time={"scheme": "nonsmooth", "step": step, "substeps": substeps})
    if is_fine:
        assert build_nonsmooth(wall).world.controls[0].step == step
        return
    with pytest.raises(StepTooLongError, match="blocks could move farther than a tenth") as caught:
        build_nonsmooth(wall)
    assert caught.value.limit < step
    forced = wall.model_copy(update={"time": wall.time.model_copy(update={"force_step": True})})
    assert build_nonsmooth(forced).world.controls[0].step == step


def test_speed_at_the_start_counts_for_the_whole_step() -> None:
    thrown = {**RESTING, "velocity": [3.0, 0.0]}
    assert step_of(thrown, step=0.8e-3) == 0.8e-3
    with pytest.raises(StepTooLongError):
        step_of(thrown, step=0.9e-3)


@pytest.mark.parametrize("step", [1e-18])
def test_steps_that_cannot_be_counted_are_refused(step: float) -> None:
    with pytest.raises(UncountableStepsError):
        step_of(RESTING, step=step)
