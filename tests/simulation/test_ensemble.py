from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.errors import ExitCode
from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import ensemble, simulate
from blocksim.simulation.ensemble import Ensemble, EnsembleEnd, MemberEnd, MemberFailure, run_ensemble, run_in_batches
from blocksim.simulation.schemes import build_stacks
from blocksim.world import build, memory
from blocksim.world.build import SceneStack
from blocksim.world.memory import SceneTooLargeError, scene_size
from blocksim.world.step import SkinTooSmallError, StepError

if TYPE_CHECKING:
    from collections.abc import Iterator

SCENARIOS = Path(__file__).parents[2] / "scenarios"
WALL = {"stiffness_scale": 1e-3}
SOFT = {"contact.stiffness_scale": 1e-3, "contact.restitution": 0.2, "time.end": 0.3}


def collapses(*changes: dict[str, Any]) -> list[Scenario]:
    return [load_scenario(SCENARIOS / "three_blocks_nominal.toml", {**SOFT, **change}) for change in changes]


def assert_same(end: MemberEnd, scenario: Scenario) -> None:
    alone = simulate(scenario)
    assert alone.final.equals(end.final)
    assert alone.summary.energy_J == end.ledger
    assert alone.columns == end.columns
    assert alone.summary.movement is not None
    assert end.observables.items() <= alone.summary.movement.row.items()  # one that ran alone lacks peaks
    assert (alone.summary.status, alone.summary.reason) == (end.outcome.status, end.outcome.reason)
    assert alone.summary.simulated_time_s == end.seconds == end.frames.time[-1]
    assert np.array_equal(alone.frames.x[-1:], end.frames.x)
    assert all(np.array_equal(alone.frames.energy[name][-1:], end.frames.energy[name]) for name in end.frames.energy)


DIFFERENT: tuple[dict[str, Any], ...] = (
    {},
    {"friction.block_block": 0.2},
    {"contact.restitution": 0.0},
    {"contact.stiffness_scale": 2e-3},
    {"time.end": 0.01},
    {"contact.law": "hertz-mindlin", "contact.stiffness_scale": 0.01, "time.end": 0.05},
    {"structures": [{"kind": "staircase", "block": "brick", "count": 3, "overlap": 0.011}]},
)


def test_the_number_of_threads_and_the_size_of_batches_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = [{"friction.block_block": 0.2 + 0.01 * k, "time.end": 0.05} for k in range(7)]
    scenarios = collapses(*changes)
    one = [end.final for end in run_ensemble(scenarios, threads=1)]
    monkeypatch.setattr(ensemble, "BATCH", 3)
    monkeypatch.setattr(ensemble, "CHUNK", 1)
    four = [end.final for end in run_ensemble(scenarios, threads=4)]
    assert all(a.equals(b) for a, b in zip(one, four, strict=True))


def test_a_batch_of_everything_has_the_bits_of_runs_of_their_own() -> None:
    """Both schemes, all laws, walls, profiles, supports that move, fixed and large blocks, one member or several."""
    brick = {"block": "brick", "x": 0.3, "y": 0.1}
    kinds: tuple[dict[str, Any], ...] = (
        {},
        {"contact.restitution": 0.0},
        {"contact.stiffness_scale": 2e-3, "time.end": 0.01},
        {"structures": [{"kind": "staircase", "block": "brick", "count": 4, "overlap": 0.011}]},
        {"time.scheme": "nonsmooth"},
        {"time.scheme": "nonsmooth", "time.step": 5e-4, "contact.restitution": 0.6},
        {"contact.law": "hertz-mindlin", "contact.stiffness_scale": 0.01},
        {"bodies": [{**brick, "fixed": True}]},
        {"bodies": [{**brick, "velocity": [0.3, -0.2], "spin": 2.0}]},
        {"walls": [{"from": [0.15, 0.2], "to": [0.15, 0.0]}]},
        {"ground": {"profile": [[0.0, 0.0], [0.1, 0.0], [0.3, -0.1]]}, "time.scheme": "nonsmooth"},
        {"ground": {"profile": [[0.0, 0.0], [0.1, 0.0], [0.3, -0.1]]}},
        {"motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 5.0}},
        {"motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 5.0}, "time.scheme": "nonsmooth"},
    )
    scenarios = [
        one
        for number in range(2)
        for kind in kinds
        for one in collapses({"time.end": 0.03, "friction.block_block": 0.25 + 0.1 * number, **kind})
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


def test_a_member_whose_pair_list_is_full_gets_more_room(monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = collapses({"time.end": 0.02}, {"time.end": 0.03})
    monkeypatch.setattr(build, "LEAST_PAIRS", 1)
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 0)
    calls: list[int] = []
    alone = Ensemble._run_alone

    def counted(self: Ensemble, m: int, start: float) -> EnsembleEnd:
        calls.append(m)
        return alone(self, m, start)

    monkeypatch.setattr(Ensemble, "_run_alone", counted)
    ends = run_ensemble(scenarios)
    assert calls == [0, 1]
    monkeypatch.undo()
    for end, scenario in zip(ends, scenarios, strict=True):
        assert_same(end, scenario)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_a_pair_list_that_fills_up_on_the_way_changes_no_bit(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = [pushed_wall(4, 5, contact=WALL, time={"scheme": scheme, "end": end}) for end in (0.05, 0.06)]
    alone = [simulate(scenario) for scenario in scenarios]
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 2)
    for end, single in zip(run_ensemble(scenarios), alone, strict=True):
        assert end.columns == single.columns
        assert end.ledger == single.summary.energy_J
        assert single.summary.movement is not None
        assert end.observables.items() <= single.summary.movement.row.items()


def test_members_that_cannot_be_built_fail_in_their_place_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = {"time.end": 0.01}
    scenarios = collapses(
        quick,
        {**quick, "time.step": 1e-2},
        {**quick, "contact.skin": 4e-6},
        {**quick, "time.scheme": "nonsmooth"},
        {"time.end": 1.0, "time.scheme": "nonsmooth", "time.step": 1.0},
        {**quick, "contact.restitution": 0.1},
    )
    ends = [end for batch in run_in_batches(scenarios) for end in batch]
    errors = [type(end.error) if isinstance(end, MemberFailure) else None for end in ends]
    assert errors == [None, StepError, SkinTooSmallError, None, StepError, None]
    assert [end.outcome.status for end in ends] == ["failed" if error else "finished" for error in errors]
    assert "largest safe step" in ends[1].outcome.reason
    assert ends[1].outcome.exit_code == ExitCode.INVALID_INPUT
    for end, scenario in zip(ends, scenarios, strict=True):
        if isinstance(end, MemberEnd):
            assert_same(end, scenario)
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


def test_a_stack_takes_no_more_memory_than_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = collapses(*({"friction.block_block": 0.3, "time.end": 1e-3 * k} for k in range(1, 6)))
    whole = [end.columns for end in run_ensemble(scenarios)]
    one = next(iter(build_stacks(scenarios[:1])))
    assert isinstance(one, SceneStack)
    monkeypatch.setattr(build, "MOST_BYTES", 2 * scene_size(4, 16, 8).bytes)
    assert [len(stack.placed) for stack in build_stacks(scenarios) if isinstance(stack, SceneStack)] == [2, 2, 1]
    assert [end.columns for end in run_ensemble(scenarios)] == whole


def test_a_member_that_fails_says_so_and_the_others_go_on() -> None:
    def fall(overlap: float) -> Scenario:
        return scenario_from_mapping(
            {
                "schema": 1,
                "name": "fall",
                "materials": {"any": {"density": 2700.0, "young_modulus": 69e9, "poisson_ratio": 0.3}},
                "blocks": {"any": {"width": 0.03, "height": 0.03, "length": 0.03, "material": "any"}},
                "bodies": [{"block": "any", "x": 0.0, "y": 0.02, "velocity": [0.0, -1.0]}],
                "contact": {"stiffness_scale": 1e-3, "max_overlap": overlap},
                "time": {"end": 0.02},
            }
        )

    ends = run_ensemble([fall(1e-6), fall(1e-3)])
    assert [end.outcome.status for end in ends] == ["failed", "finished"]
    assert "max_overlap" in ends[0].outcome.reason


def test_no_scenarios_give_no_ends() -> None:
    assert run_ensemble([]) == []


@pytest.mark.parametrize("threads", [0, -1])
def test_less_than_one_thread_is_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads must be at least 1, not {threads}"):
        run_ensemble([], threads=threads)


def test_batches_without_members_are_refused() -> None:
    with pytest.raises(ValueError, match="members must be at least 1, not 0"):
        run_in_batches([], most=0)
