"""Actuators: what they record and what they can exert; forces on walls and energies of cycles are case V26."""

from bisect import bisect_right
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Model, Scenario
from blocksim.scenario.models.actuators import PathTable, stretches_of
from blocksim.scenario.models.loads import Stretch
from blocksim.scenario.placement import smallest_width
from blocksim.simulation import simulate
from blocksim.simulation.schemes import build
from tests.simulation.test_probes import WEIGHT, both, scene

BRICK = {"block": "brick", "name": "b", "x": 0.0, "y": 0.05}
RAMP = {"kind": "ramp", "to": "2 mm", "rate": "20 mm/s"}


def pushed(scheme: str, end: float | None = None, **jack: Any) -> Scenario:
    return scene(
        scheme,
        [],
        structures=[],
        bodies=jack.pop("bodies", [BRICK]),
        friction={"block_ground": 0.5},
        contact={"restitution": 0.0} | ({} if scheme == "nonsmooth" else {"stiffness_scale": 0.01}),
        start={"settle": True},
        time={"scheme": scheme, "stop_at_rest": False} | ({} if end is None else {"end": end}),
        output={"every": "1 ms"},
        events=jack.pop("events", []),
        actuators=[{"name": "jack", "body": "b", "displacement": RAMP, **jack}],
    )


@both
def test_a_run_ends_when_the_head_stops_and_the_block_has_come_with_it(scheme: str) -> None:
    """0.1 s at full speed, and a fifth more for speeding up and slowing down."""
    jack = simulate(pushed(scheme)).probes["jack"]
    assert jack.time[-1] == pytest.approx(0.12, abs=1e-3)
    assert jack["head"][-1] == pytest.approx(2e-3, abs=1e-7)
    assert jack["displacement"][-1] == pytest.approx(2e-3, rel=0.01)
    middle = len(jack) // 2
    assert jack["force"][middle] == pytest.approx(0.5 * WEIGHT, rel=0.01)
    assert float(np.trapezoid(jack["force"], jack["displacement"])) == pytest.approx(jack["work"][-1], rel=0.01)


@both
def test_while_the_head_moves_evenly_the_spring_alone_carries_the_force(scheme: str) -> None:
    jack = simulate(pushed(scheme, stiffness=1e5)).probes["jack"]
    middle = len(jack) // 2
    lag = jack["head"][middle] - jack["displacement"][middle]
    assert lag == pytest.approx(jack["force"][middle] / 1e5, rel=1e-3)


@both
@pytest.mark.parametrize("degrees", [90, 20, -20, 180])
def test_the_force_of_an_even_push_is_that_of_weight_and_friction_in_every_direction(scheme: str, degrees: int) -> None:
    jack = simulate(pushed(scheme, direction=f"{degrees} deg")).probes["jack"]
    along, up = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    right = WEIGHT if degrees == 90 else 0.5 * WEIGHT / (abs(along) + 0.5 * up)
    even = (jack.time > 0.05) & (jack.time < 0.09)
    assert jack["force"][even] == pytest.approx(right, rel=1e-4)


@both
@pytest.mark.parametrize("is_fixed", [True, False])
def test_no_head_however_fast_drives_a_block_through_another(scheme: str, is_fixed: bool) -> None:
    bodies = [BRICK | {"guide": "no rotation"}, BRICK | {"name": "other", "x": 1.0, "fixed": is_fixed}]
    fast = {"kind": "table", "times": [0.0, 0.1, 0.102], "displacements": [0.0, 0.0, 2.0]}
    run = simulate(pushed(scheme, bodies=bodies, displacement=fast))
    assert run.status == "failed" or run.frames.x[-1][0] < run.frames.x[-1][1]


def test_rigid_overlaps_are_looked_at_before_a_head_has_gone_half_a_block() -> None:
    for speed in (10.0, 1000.0):  # m/s
        path = {"kind": "table", "times": [0.0, 0.1, 0.2], "displacements": [0.0, 0.0, 0.1 * speed]}
        scenario = pushed("nonsmooth", displacement=path)
        controls = build(Model(scenario)).world.controls[0]
        assert speed * controls.step * controls.check_every <= 0.5 * smallest_width(Model(scenario).bodies)


@both
def test_an_actuator_is_attached_once_the_block_has_settled(scheme: str) -> None:
    """It holds nothing then, although the block has sunk into its contacts."""
    jack = simulate(pushed(scheme, end=0.02, direction="90 deg", displacement={**RAMP, "start": "1 s"})).probes["jack"]
    assert np.abs(jack["force"]).max() < 0.02 * WEIGHT  # contacts of impulses give way by nanometres
    assert jack["displacement"][0] == pytest.approx(0.0, abs=1e-15)


def followed(one: Stretch, since: float) -> tuple[float, float, float]:
    """Return value, rate and acceleration so long (s) after the start of a stretch."""
    rate = one.rate + since * (one.acceleration + 0.5 * since * one.jerk)
    value = one.value + since * (one.rate + since * (0.5 * one.acceleration + since * one.jerk / 6.0))
    return value, rate, one.acceleration + since * one.jerk


def test_the_head_follows_a_table_without_a_jump_of_its_rate_or_acceleration() -> None:
    times, values = [1.0, 1.2, 1.3, 2.0, 4.0], [0.001, 0.002, 0.0, -0.003, -0.003]
    for last in (5, 2):
        path = PathTable(kind="table", times=tuple(times[:last]), displacements=tuple(values[:last]))
        pieces = stretches_of(path)
        assert all(one.start < other.start for one, other in pairwise(pieces))
        for one, other in pairwise(pieces):
            since = other.start - one.start
            value, rate, acceleration = followed(one, since)
            assert acceleration == pytest.approx(other.acceleration, abs=1e-9)
            assert other.rate == pytest.approx(rate, abs=1e-12)
            assert other.value == pytest.approx(value, abs=1e-12)
        assert (pieces[0].value, pieces[0].rate) == (0.001, 0.0)
        assert (pieces[-1].start, pieces[-1].value, pieces[-1].rate) == (times[last - 1], values[last - 1], 0.0)
        starts = [one.start for one in pieces]
        for time, value in zip(times[:last], values[:last], strict=True):
            one = pieces[bisect_right(starts, time) - 1]
            assert followed(one, time - one.start)[0] == pytest.approx(value, abs=5e-5)


@both
def test_an_actuator_that_pushes_does_not_pull_back(scheme: str) -> None:
    there_and_back = {"kind": "table", "times": [0, 0.05, 0.1]}
    for sense, sign in (("push", 1.0), ("pull", -1.0)):
        path = {**there_and_back, "displacements": [0.0, sign * 1e-3, 0.0]}
        jack = simulate(pushed(scheme, sense=sense, displacement=path)).probes["jack"]
        assert (sign * jack["force"]).min() == 0.0
        assert (sign * jack["force"]).max() > 0.4 * WEIGHT
        assert sign * jack["displacement"][-1] == pytest.approx(1e-3, rel=0.05)


def test_a_stiff_actuator_makes_the_step_shorter_in_both_schemes() -> None:
    for scheme in ("explicit", "nonsmooth"):
        steps = [simulate(pushed(scheme, end=1e-3, stiffness=k)).summary.time_step_s for k in (1e4, 1e9)]
        assert steps[1] < 0.5 * steps[0]


@both
def test_an_actuator_lets_go_at_an_event_and_the_block_slides_to_rest(scheme: str) -> None:
    release = [{"at": 0.05, "unload": ["jack"]}]
    run = simulate(pushed(scheme, end=0.1, events=release))
    jack = run.probes["jack"]
    after = jack.time > 0.051
    assert (jack["force"][after] == 0.0).all()
    assert jack["head"][-1] == pytest.approx(0.8e-3, rel=0.01)  # it stopped: 0.04 s at full speed
    assert jack["displacement"][-1] == pytest.approx(jack["head"][-1] + 0.02**2 / (2.0 * 0.5 * 9.81), rel=0.02)
    assert run.summary.energy_J.relative_residual < 1e-3
