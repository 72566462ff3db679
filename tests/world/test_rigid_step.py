"""How far blocks may go in a step while contacts are held: automatic steps shrink, those by hand are refused."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world.describe import describe
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.rigid_step import FEW, NATURAL, SHARE, USUAL_STEP
from blocksim.world.step import StepError

if TYPE_CHECKING:
    from collections.abc import Mapping

G = 9.81
RESTING = {"y": HEIGHT / 2}


def step_of(body: Mapping[str, object], **time: Any) -> float:
    tables = {"ground": time.pop("ground", {}), "friction": time.pop("friction", {})}
    scenario = scenario_of([body], time={"scheme": "nonsmooth", **time}, **tables)
    return float(build_nonsmooth(scenario).world.controls[0].step)


def wall_step(columns: int, rows: int) -> float:
    scenario = pushed_wall(columns, rows, time={"scheme": "nonsmooth"})
    return float(build_nonsmooth(scenario).world.controls[0].step)


def test_few_blocks_take_a_share_of_the_time_of_a_fall_over_their_sides_and_crowds_the_usual_step() -> None:
    natural = NATURAL / FEW * sqrt(HEIGHT / G)
    assert step_of(RESTING) == pytest.approx(natural, rel=0.05)
    assert USUAL_STEP / step_of(RESTING) == pytest.approx(13.0)  # whole, so that outputs fall on ends of steps
    large = {"y": 100 * HEIGHT / 2, "width": 100 * WIDTH, "height": 100 * HEIGHT}
    assert step_of(large) == pytest.approx(10.0 * natural, rel=0.5)
    assert build_nonsmooth(three_blocks(time={"scheme": "nonsmooth"})).world.controls[0].step == 0.25 * USUAL_STEP
    assert wall_step(4, 4) == wall_step(10, 8) == USUAL_STEP
    assert step_of(RESTING, end=1e-5) == 1e-5


def test_fast_blocks_shrink_the_automatic_step_to_a_share_of_the_smallest_side() -> None:
    few = SHARE / FEW
    assert step_of({**RESTING, "velocity": [50.0, 0.0]}) == pytest.approx(few * HEIGHT / 50.0, rel=1e-3)
    assert step_of({"y": 50.0}) * sqrt(2.0 * G * 50.0) == pytest.approx(few * HEIGHT, rel=1e-2)
    assert wall_step(40, 400) * sqrt(2.0 * G * 400 * 0.032) == pytest.approx(SHARE * 0.032, rel=2e-2)


def test_check_says_why_a_step_is_as_long_as_it_is() -> None:
    def why(body: Mapping[str, object], **time: Any) -> str:
        told = describe(scenario_of([body], time={"scheme": "nonsmooth", **time})).rigid
        return told.why if told else ""

    assert "L = 25 mm the smallest side" in why(RESTING)
    assert "at most at 50" in why({**RESTING, "velocity": [50.0, 0.0]})
    assert why(RESTING, step=1e-4) == "as given"


def test_only_slopes_that_friction_does_not_hold_shrink_the_step() -> None:
    friction = {"block_block": 0.5, "block_ground": 0.5}
    usual = step_of(RESTING)
    assert step_of(RESTING, ground={"tilt": "20 deg"}, friction=friction, end=10.0) == usual
    assert step_of(RESTING, ground={"tilt": "40 deg"}, friction=friction, end=100.0) < 0.3 * usual


def test_friction_that_matters_is_that_of_what_blocks_can_slide_on_for_long() -> None:
    friction = {"block_block": 0.1, "block_ground": 0.5}
    values: dict[str, Any] = {"ground": {"tilt": "20 deg"}, "friction": friction, "end": 100.0}
    usual = step_of(RESTING)
    assert step_of(RESTING, **values) == usual
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
    with pytest.raises(StepError, match="blocks could move farther than a tenth") as caught:
        build_nonsmooth(wall)
    assert caught.value.limit < step
    forced = wall.model_copy(update={"time": wall.time.model_copy(update={"force_step": True})})
    assert build_nonsmooth(forced).world.controls[0].step == step


def test_speed_at_the_start_counts_for_the_whole_step() -> None:
    thrown = {**RESTING, "velocity": [3.0, 0.0]}
    assert step_of(thrown, step=0.8e-3) == 0.8e-3
    for step in (0.9e-3, 1e-18):  # too long, and too short to be counted
        with pytest.raises(StepError):
            step_of(thrown, step=step)


HARMONIC = {"kind": "harmonic", "amplitude": "0.1 mm", "frequency": "100 Hz", "ramp": "50 ms"}
PULSE = {"kind": "pulse", "shape": "half-sine", "amplitude": "5 m/s^2", "duration": "5 ms"}


def shaken_step(motion: Mapping[str, object], gravity: float = 0.0, **time: Any) -> float:
    scenario = scenario_of([RESTING], motion=motion, gravity=gravity, time={"scheme": "nonsmooth", "end": 0.1, **time})
    return float(build_nonsmooth(scenario).world.controls[0].step)


@pytest.mark.parametrize("motion", [HARMONIC, PULSE])
def test_motions_are_resolved_by_automatic_steps_and_by_those_by_hand(motion: Mapping[str, object]) -> None:
    assert shaken_step(motion) == pytest.approx(5e-4, rel=1e-2)  # at the end of the ramp it is a little faster
    assert shaken_step(motion, gravity=G) == step_of(RESTING)
    assert shaken_step(motion, step=4e-4) == 4e-4
    with pytest.raises(StepError, match=r"a cycle of 0\.01 s: at most a twentieth of it, 0\.0005 s"):
        shaken_step(motion, step=6e-4)
    assert shaken_step(motion, step=6e-4, force_step=True) == 6e-4


def test_supports_in_motion_and_steep_ramps_of_it_shrink_the_automatic_step() -> None:
    fast = {**HARMONIC, "amplitude": "20 mm", "ramp": "1 ms"}
    assert shaken_step(fast) * 21.15 == pytest.approx(SHARE / FEW * HEIGHT, rel=1e-3)
    assert shaken_step({**HARMONIC, "ramp": "1 ms"}) < 2e-4
    with pytest.raises(StepError):
        shaken_step(fast, step=2e-4)
