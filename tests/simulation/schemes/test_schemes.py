"""Both schemes behind one interface: the same commands run them, and nothing mixes them up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.scenario.models import timeline
from blocksim.simulation import read_result, run_ensemble, simulate, simulate_into
from blocksim.simulation.schemes import ALONE, SCHEMES, Team, build_scene, build_stacks, measure_row, scheme_of
from blocksim.world import build
from blocksim.world.build import SceneStack, arrays_of, member, only_stack
from blocksim.world.nonsmooth import build_nonsmooth

if TYPE_CHECKING:
    from pathlib import Path

    from blocksim.scenario import Scenario

RIGID: dict[str, object] = {"scheme": "nonsmooth", "step": 1e-3}
STEPS = 300


def collapse(**time: object) -> Scenario:
    return three_blocks(time={**RIGID, **time})


def wall() -> Scenario:
    return pushed_wall(12, 18, time={**RIGID, "end": 0.3})


def same_bits(one: Nonsmooth, other: Nonsmooth) -> bool:
    """Compare everything that moves, presses or is tallied."""
    rows, count = ("normal_one", "normal_two", "shear"), int(one.contacts.stepping[0].constraint_count)
    bodies = (np.array_equal(one.world.bodies[name], other.world.bodies[name]) for name in ("x", "y", "angle", "vx"))
    impulses = (
        np.array_equal(one.contacts.constraints[name][:count], other.contacts.constraints[name][:count])
        for name in rows
    )
    return all([*bodies, *impulses, np.array_equal(measure_row(one), measure_row(other))])


def test_every_scheme_of_the_file_can_be_run() -> None:
    assert set(SCHEMES) == set(timeline.SCHEMES)
    for name, scheme in SCHEMES.items():
        scene = build_scene(three_blocks(time={"scheme": name}))
        assert scheme_of(scene) is scheme
        assert len(measure_row(ALONE.advance(scene, 0)[0])) == len(scheme.row_names)


@pytest.fixture(scope="module")
def alone() -> Nonsmooth:
    """Return the wall as one thread leaves it."""
    return ALONE.advance(build_nonsmooth(wall()), STEPS)[0]


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_do_not_change_a_bit_of_a_collapse_nor_of_its_ledger(alone: Nonsmooth, threads: int) -> None:
    with Team(threads) as together:
        scene, status = build_nonsmooth(wall()), 0
        for last in (0, 7, STEPS // 2, STEPS):
            scene, status = together.advance(scene, last)
    assert status == 0
    assert scene.world.clock[0].rebuilds > 5
    assert same_bits(scene, alone)


def test_one_thread_takes_over_from_a_team_and_a_team_from_one(alone: Nonsmooth) -> None:
    with Team(3) as together, Team(2) as couple:
        scene, _ = together.advance(build_nonsmooth(wall()), STEPS // 3)
        scene, _ = ALONE.advance(scene, STEPS // 2)
        scene, _ = couple.advance(scene, STEPS)
    assert same_bits(scene, alone)


@pytest.mark.parametrize("threads", [1, 2])
def test_more_room_for_pairs_keeps_impulses_and_tallies(
    alone: Nonsmooth, monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 1)
    monkeypatch.setattr(build, "GROWTH", 1.05)
    scene = build_nonsmooth(wall())
    capacity = scene.contacts.constraints.size
    with Team(threads) as together:
        scene, _ = together.advance(scene, STEPS)
    assert scene.contacts.constraints.size > capacity
    assert same_bits(scene, alone)


def test_outputs_do_not_change_a_bit(alone: Nonsmooth) -> None:
    result = simulate(wall())
    assert result.summary.steps == STEPS
    assert np.array_equal(result.frames.x[-1], alone.world.bodies.x[:-1])


def test_energies_of_frames_and_summary_are_those_of_the_scheme(tmp_path: Path) -> None:
    kept = simulate_into(collapse(end=0.3, stop_at_rest=False), tmp_path / "run")
    found = read_result(tmp_path / "run")
    assert tuple(found.frames.energy) == SCHEMES["nonsmooth"].ledger
    total = np.sum([*found.frames.energy.values()], axis=0)
    assert total == pytest.approx(np.full(len(found.frames), total[0]), rel=1e-12)
    assert found.frames.energy["impacts"][-1] == kept.summary.energy_J.impacts > 0.0
    assert kept.summary.energy_J.relative_residual < 1e-12
    assert kept.summary.energy_J.dashpot == kept.summary.energy_J.stored_normal == 0.0
    assert np.array_equal(found.frames.x, kept.frames.x)


def test_ensemble_of_both_schemes_ends_as_single_runs_do() -> None:
    soft = {"stiffness_scale": 1e-3}
    changes: list[Any] = [RIGID, {**RIGID, "velocity_tolerance": 1e-5}, {}, {**RIGID, "end": 0.1}]
    scenarios = [three_blocks(soft, {"end": 0.2, **change}) for change in changes]
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        single = simulate(scenario)
        assert single.final.equals(end.final)
        assert single.summary.energy_J == end.ledger


def test_members_of_a_stack_are_the_scenes_that_would_be_built_alone() -> None:
    scenarios = [collapse(step=step) for step in (1e-3, 5e-4, 2e-4)]
    stack = only_stack(build_stacks(scenarios))
    assert all(array.ctypes.data % 64 == 0 for array in arrays_of(stack.scenes) if array.size)
    for m, scenario in enumerate(scenarios):
        one, alone = member(stack.scenes, m), build_nonsmooth(scenario)
        assert isinstance(one, Nonsmooth)
        for a, b in zip(arrays_of(one), arrays_of(alone), strict=True):
            assert (type(a), a.dtype, a.shape) == (type(b), b.dtype, b.shape)
            assert np.array_equal(a, b)


def test_scenes_of_other_schemes_and_shapes_come_in_stacks_of_their_own() -> None:
    scenarios = [collapse(), wall(), three_blocks(), collapse(step=5e-4)]
    stacks = [one for one in build_stacks(scenarios) if isinstance(one, SceneStack)]
    assert [stack.numbers for stack in stacks] == [[0, 3], [1], [2]]
    assert [len(stack.placed) for stack in stacks] == [2, 1, 1]
