from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import ensemble, simulate
from blocksim.simulation.ensemble import Ensemble, MemberEnd, run_ensemble
from blocksim.simulation.stacking import stack
from blocksim.world.build import build_world, empty_lists

if TYPE_CHECKING:
    from blocksim.kernels.arrays import World

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SOFT = {"contact.stiffness_scale": 1e-3, "contact.restitution": 0.2, "time.end": 0.3}


def collapses(*changes: dict[str, Any]) -> list[Scenario]:
    return [load_scenario(SCENARIOS / "three_blocks_nominal.toml", {**SOFT, **change}) for change in changes]


def assert_same(end: MemberEnd, scenario: Scenario) -> None:
    alone = simulate(scenario)
    assert alone.final.equals(end.final)
    assert alone.summary.energy_J == end.ledger
    assert (alone.summary.status, alone.summary.reason) == (end.outcome.status, end.outcome.reason)


DIFFERENT: tuple[dict[str, Any], ...] = (
    {},
    {"friction.block_block": 0.2},
    {"contact.restitution": 0.0},
    {"contact.stiffness_scale": 2e-3},
    {"time.end": 0.01},
    {"contact.law": "hertz-mindlin", "contact.stiffness_scale": 0.01, "time.end": 0.05},
    {"structures": [{"kind": "staircase", "block": "brick", "count": 3, "overlap": 0.011}]},
)


def test_members_end_with_the_bits_of_runs_of_their_own() -> None:
    scenarios = collapses(*DIFFERENT)
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        assert_same(end, scenario)


def test_the_number_of_threads_and_the_size_of_batches_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = [{"friction.block_block": 0.2 + 0.01 * k, "time.end": 0.05} for k in range(7)]
    scenarios = collapses(*changes)
    one = [end.final for end in run_ensemble(scenarios, threads=1)]
    monkeypatch.setattr(ensemble, "BATCH", 3)
    monkeypatch.setattr(ensemble, "CHUNK", 1)
    four = [end.final for end in run_ensemble(scenarios, threads=4)]
    assert all(a.equals(b) for a, b in zip(one, four, strict=True))


def test_scenes_of_different_shapes_come_back_in_order() -> None:
    stairs = [{"structures": [{"kind": "staircase", "block": "brick", "count": n, "overlap": 0.03}]} for n in (2, 4, 2)]
    scenarios = collapses(*({**change, "time.end": 0.005} for change in stairs))
    ends = run_ensemble(scenarios)
    assert [len(end.final) for end in ends] == [2, 4, 2]
    for end, scenario in zip(ends, scenarios, strict=True):
        assert_same(end, scenario)


@pytest.mark.long  # a minute of compiling
def test_models_with_particles_go_together_too() -> None:
    change = {"contact.model": "kernel", "contact.particle_spacing": 0.004, "time.end": 0.002}
    scenarios = collapses(change, {**change, "friction.block_block": 0.1})
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        assert_same(end, scenario)


def test_a_member_whose_pair_list_is_full_gets_more_room(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = collapses({"time.end": 0.02})[0]

    def cramped(given: Scenario) -> World:
        world = build_world(given)
        return world._replace(**empty_lists(1, world.candidates.shape[1], world.before))

    monkeypatch.setattr(ensemble, "build_scene", cramped)
    calls: list[int] = []
    alone = Ensemble._run_alone

    def counted(self: Ensemble[World], scene: World, last_step: int, start: float) -> tuple[World, int, float]:
        calls.append(last_step)
        return alone(self, scene, last_step, start)

    monkeypatch.setattr(Ensemble, "_run_alone", counted)
    (end,) = run_ensemble([scenario])
    assert len(calls) == 1
    assert_same(end, scenario)


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


def test_stacked_arrays_start_on_a_cache_line() -> None:
    worlds = [build_world(scenario) for scenario in collapses({}, {})]
    stacked = stack(worlds)
    arrays = [array for array in stacked if array is not None and array.size]
    assert all(array.ctypes.data % 64 == 0 for array in arrays)
    assert np.array_equal(stacked.bodies[1], worlds[1].bodies)
