"""A member of an ensemble ends as it would alone, to the last bit, whoever else there is; what fails, fails alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.errors import ExitCode
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import ensemble, simulate
from blocksim.simulation.ensemble import EnsembleEnd, MemberEnd, MemberFailure, run_ensemble, run_in_batches
from blocksim.simulation.schemes import build_stacks
from blocksim.world import build, memory
from blocksim.world.build import SceneStack
from blocksim.world.memory import SceneTooLargeError, scene_size
from blocksim.world.step import SkinTooSmallError, StepError
from tests.simulation.conftest import SCENARIOS

if TYPE_CHECKING:
    from collections.abc import Iterator

WALL = {"stiffness_scale": 1e-3}
SOFT = {"contact.stiffness_scale": 1e-3, "contact.restitution": 0.2, "time.end": 0.3}


def collapses(*changes: dict[str, Any]) -> list[Scenario]:
    return [load_scenario(SCENARIOS / "three_blocks_nominal.toml", {**SOFT, **change}) for change in changes]


def assert_same(end: EnsembleEnd, scenario: Scenario) -> None:
    alone = simulate(scenario)
    assert isinstance(end, MemberEnd)
    assert alone.final.equals(end.final)
    assert alone.summary.energy_J == end.ledger
    assert repr(alone.columns) == repr(end.columns)
    assert alone.summary.movement is not None
    assert end.observables.items() <= alone.summary.movement.row.items()  # one that ran alone lacks peaks
    assert (alone.summary.status, alone.summary.reason) == (end.outcome.status, end.outcome.reason)
    assert alone.summary.simulated_time_s == end.seconds == end.frames.time[-1]
    assert np.array_equal(alone.frames.x[-1:], end.frames.x)
    assert all(np.array_equal(alone.frames.energy[name][-1:], end.frames.energy[name]) for name in end.frames.energy)


def test_the_number_of_threads_and_the_size_of_batches_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = collapses(*({"friction.block_block": 0.2 + 0.01 * k, "time.end": 0.05} for k in range(7)))
    one = [end.columns for end in run_ensemble(scenarios, threads=1)]
    monkeypatch.setattr(ensemble, "BATCH", 3)
    monkeypatch.setattr(ensemble, "CHUNK", 1)
    assert [end.columns for end in run_ensemble(scenarios, threads=4)] == one
    monkeypatch.setattr(build, "MOST_BYTES", 2 * scene_size(4, 16, 8).bytes)
    stacks = [len(stack.placed) for stack in build_stacks(scenarios) if isinstance(stack, SceneStack)]
    assert stacks == [2, 2, 2, 1]  # no more memory than a stack may take
    assert [end.columns for end in run_ensemble(scenarios)] == one


def test_a_batch_of_everything_has_the_bits_of_runs_of_their_own() -> None:
    """Both schemes, all laws, all supports, fixed, driven and large blocks, starts at rest, events; one or several."""
    brick = {"block": "brick", "x": 0.3, "y": 0.1, "name": "one"}
    rigid: dict[str, Any] = {"time.scheme": "nonsmooth"}
    profile = {"ground": {"profile": [[0.0, 0.0], [0.1, 0.0], [0.3, -0.1]]}}
    shaken = {"motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 5.0}}
    jerk = {"motion": {"kind": "pulse", "shape": "rectangular", "duration": 1.0, "amplitude": 1.0}}
    steady = {"structures": [{"kind": "stack", "block": "brick", "count": 2}]}
    settled = {**steady, "start": {"settle": True}}
    driven = {"bodies": [{**brick, "motion": {"kind": "ramp", "distance": 0.3, "speed": 1.0}}]}
    eventful = {"bodies": [brick], "events": [{"at": 0.01, "fix": ["one"]}, {"at": 0.02, "remove": ["one"]}]}
    kinds: tuple[dict[str, Any], ...] = (
        {},
        {"contact.restitution": 0.0},
        {"contact.stiffness_scale": 2e-3, "time.end": 0.01},
        {"structures": [{"kind": "staircase", "block": "brick", "count": 4, "overlap": 0.011}]},
        rigid,
        {**rigid, "time.step": 5e-4, "contact.restitution": 0.6},
        {**rigid, "time.velocity_tolerance": 1e-5},
        {"contact.law": "hertz-mindlin", "contact.stiffness_scale": 0.01},
        {"bodies": [{**brick, "fixed": True}]},
        {"bodies": [{**brick, "velocity": [0.3, -0.2], "spin": 2.0}]},
        {"walls": [{"from": [0.15, 0.2], "to": [0.15, 0.0]}]},
        *({**scheme, **kind} for scheme in ({}, rigid) for kind in (profile, shaken, driven, eventful)),
    )
    release = {"ground.tilt": "50 deg", "start.release": "always"}
    settling = ({**settled, **release}, {**rigid, **settled}, {**rigid, **settled, **jerk})
    scenarios = [
        one
        for friction, some in ((0.25, (*kinds, *settling)), (0.35, kinds))
        for kind in some
        for one in collapses({"time.end": 0.03, "friction.block_block": friction, **kind})
    ]
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        assert_same(end, scenario)


@pytest.mark.long  # a minute of compiling
def test_models_with_particles_go_together_too() -> None:
    change = {"contact.model": "kernel", "contact.particle_spacing": 0.004, "time.end": 0.002}
    others = [{**change, **more} for more in ({"contact.model": "particles"}, {"contact.particle_spacing": 0.003}, {})]
    scenarios = collapses(change, {**change, "friction.block_block": 0.1}, *others)
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        assert_same(end, scenario)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_a_pair_list_that_fills_up_on_the_way_changes_no_bit(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = [pushed_wall(4, 5, contact=WALL, time={"scheme": scheme, "end": end}) for end in (0.05, 0.06)]
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 2)
    ends = run_ensemble(scenarios)
    monkeypatch.undo()
    for end, scenario in zip(ends, scenarios, strict=True):
        assert_same(end, scenario)


def test_members_that_cannot_be_built_or_fail_do_so_in_their_place_and_the_others_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quick = {"time.end": 0.01}
    scenarios = collapses(
        quick,
        {**quick, "time.step": 1e-2},
        {**quick, "contact.skin": 4e-6},
        {**quick, "time.scheme": "nonsmooth"},
        {"time.end": 1.0, "time.scheme": "nonsmooth", "time.step": 1.0},
        {**quick, "contact.max_overlap": 1e-9},
        {**quick, "contact.restitution": 0.1},
    )
    ends = [end for batch in run_in_batches(scenarios) for end in batch]
    errors = [type(end.error) if isinstance(end, MemberFailure) else None for end in ends]
    assert errors == [None, StepError, SkinTooSmallError, None, StepError, None, None]
    assert [end.outcome.status == "failed" for end in ends] == [False, True, True, False, True, True, False]
    assert "largest safe step" in ends[1].outcome.reason
    assert "max_overlap" in ends[5].outcome.reason
    assert ends[1].outcome.exit_code == ExitCode.INVALID_INPUT
    for number in (0, 3, 5, 6):
        assert_same(ends[number], scenarios[number])
    with pytest.raises(StepError):
        run_ensemble(scenarios)
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    (end,) = next(run_in_batches(scenarios[:1]))
    assert isinstance(end, MemberFailure)
    assert isinstance(end.error, SceneTooLargeError)


def test_batches_take_no_more_scenarios_than_they_run(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []

    def endless() -> Iterator[Scenario]:
        scenario = collapses({"time.end": 1e-3})[0]
        while True:
            taken.append(len(taken))
            yield scenario

    batches = run_in_batches(endless(), most=3)
    assert taken == []
    assert [len(next(batches)), len(next(batches))] == [3, 3]
    assert len(taken) <= 7
    monkeypatch.setattr(ensemble, "MOST_BODIES", 6)  # three a member
    assert len(next(run_in_batches(endless()))) == 2


def test_no_scenarios_give_no_ends_and_less_than_one_thread_or_member_is_refused() -> None:
    assert run_ensemble([]) == []
    for threads in (0, -1):
        with pytest.raises(ValueError, match=f"threads must be at least 1, not {threads}"):
            run_ensemble([], threads=threads)
    with pytest.raises(ValueError, match="members must be at least 1, not 0"):
        run_in_batches([], most=0)
