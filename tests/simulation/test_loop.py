"""The loop: frames at the nearest steps, how a run ends, energy that adds up; teams of threads that change no bit."""

import errno
import json
import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.errors import ExitCode, InvalidInputError, OutputError
from blocksim.kernels.common.arrays import NOT_FINITE, OVERLAP_LIMIT, REACHED
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.scenario import Model, Scenario
from blocksim.simulation import loop, run_ensemble, schemes, simulate, simulate_into
from blocksim.simulation.balance import FIRST_CHECK, EnergyLedger
from blocksim.simulation.checkpoint import CheckpointPolicy, read_checkpoint
from blocksim.simulation.instruments import Recorder
from blocksim.simulation.interruption import interruptible, stop_requests
from blocksim.simulation.loop import BY_CODE, RESIDUAL, Outcome, diagnose
from blocksim.simulation.observables import Response
from blocksim.simulation.provenance import state_hash
from blocksim.simulation.schemes import (
    ALONE,
    BODIES_A_THREAD,
    Team,
    build,
    measure_row,
    team_for,
    useful_threads,
)
from blocksim.world import build as world_build
from blocksim.world.build import arrays_of, build_world
from tests.simulation.conftest import Shipped
from tests.simulation.sliding import sliding


@pytest.mark.parametrize(
    ("every", "step", "expected"),
    [
        (1.0, 0.25, [0, 4, 8, 12]),
        (1.0, 0.4, [0, 2, 5, 8, 10, 12]),  # 2.5, 5, 7.5, 10, 12.5 steps
        (0.1, 1.0, [*range(13)]),
    ],
)
def test_frames_fall_on_the_nearest_steps(every: float, step: float, expected: list[int]) -> None:
    recorder = Recorder([], every, step)
    found = [0]
    while found[-1] < 12:
        found.append(recorder.next_step(found[-1]))
    assert found == expected
    recorder.steps = [0, 5, 10]
    assert [recorder.count_until(step) for step in (0, 4, 5, 9, 10)] == [1, 1, 2, 2, 3]


@pytest.mark.parametrize(("end", "step", "last"), [(1.0, 0.25, 4), (1.0, 0.3, 3), (1e-9, 1.0, 1)])
def test_last_step_is_the_nearest_and_at_least_one(end: float, step: float, last: int) -> None:
    assert loop.last_step_of(end, step) == last


@pytest.mark.parametrize("wanted", [0, 3])
def test_rare_output_does_not_make_the_loop_deaf(soft: Shipped, wanted: int) -> None:
    scenario = soft(time__end=20.0, time__stop_at_rest=False)
    world = build_world(Model(scenario))
    recorder = Recorder(Model(scenario).bodies, 100.0, float(world.controls[0].step))
    seen: list[int] = []
    control = loop.RunControl(lambda at: seen.append(at.steps), lambda: "enough" if len(seen) == wanted else "")
    ended = loop.run_loop(world, recorder, 20.0, control=control)
    assert (ended.outcome.status, ended.outcome.reason, ended.outcome.exit_code) == ("interrupted", "enough", 75)
    assert len(seen) == wanted
    assert recorder.steps == sorted({0, *seen[-1:]})
    assert all(np.diff([0, *seen, recorder.next_step(0)]) > 0)


ENTRIES = dict.fromkeys(sorted(set(EnergyLedger.model_fields) - {"start", "in_play"}), 0.0)


@pytest.mark.parametrize("name", ENTRIES)
def test_every_entry_is_in_the_residual(name: str) -> None:
    some = EnergyLedger(**{**ENTRIES, name: 4.0}, start=7.0, in_play=2.0)
    assert (some.residual, some.relative_residual) == (-3.0, 1.5)


@pytest.mark.parametrize("code", [REACHED, OVERLAP_LIMIT])
@pytest.mark.parametrize(("created", "is_sound"), [(0.04, True), (0.06, False)])
def test_a_run_whose_impacts_create_energy_fails_and_did_not_fall_although_its_ledger_is_closed(
    code: int, created: float, *, is_sound: bool
) -> None:
    ledger = EnergyLedger(kinetic=1.0 + created, potential=0.0, impacts=-created, start=1.0, in_play=1.0)
    assert ledger.relative_residual < 1e-12
    outcome = loop.after_a_fall(loop.outcome_of(code, ledger), code, ledger, Response.FELL)
    assert (outcome.status == "finished") == is_sound
    assert is_sound or code == OVERLAP_LIMIT or outcome.reason.startswith("impacts created more than 5% of the energy")


def test_where_a_run_fails_depends_on_nothing_that_watches_it(soft: Shipped, tmp_path: Path) -> None:
    wild: dict[str, Any] = {"time__force_step": True, "time__step": 6e-4, "contact__max_overlap": 1.0}
    wild["time__end"] = 20.0
    often = CheckpointPolicy(checkpoint_steps=1)
    one = simulate(soft(**wild))
    other = simulate_into(soft(**wild, output__every=0.0137), tmp_path / "run", precautions=often)
    assert (one.status, one.summary.exit_code, one.summary.steps) == ("failed", 76, FIRST_CHECK)
    assert one.reason.startswith("energy residual above 5% of the energy in play (the fastest is block ")
    assert (other.reason, other.summary.final_state_sha256) == (one.reason, one.summary.final_state_sha256)
    last = max(read_checkpoint(path).head.position.step for path in (tmp_path / "run").glob("checkpoint.*"))
    assert json.loads((tmp_path / "run" / "run.json").read_text())["last_checkpoint"] == last
    assert 0 < last < FIRST_CHECK  # the last one whose energy added up
    members = run_ensemble([soft(**wild), soft(), soft(**wild)])
    assert [end.outcome.status for end in members] == ["failed", "finished", "failed"]
    assert (members[0].outcome.reason, members[0].columns) == (one.reason, one.columns)


def test_overlap_of_rigid_contacts_names_its_pair() -> None:
    result = simulate(sliding({"time": {"scheme": "nonsmooth"}, "contact": {"max_overlap": 1e-12}}, end=0.01))
    assert result.summary.exit_code == ExitCode.NUMERICAL_FAILURE
    assert result.reason.startswith("an overlap exceeds contact.max_overlap (")  # as given: no step is too long for it
    assert "(block below and the ground by " in result.reason or "(block below and block above by " in result.reason
    assert f"mm, step {result.summary.steps})" in result.reason


def test_what_failed_is_named_and_runs_that_did_not_fail_keep_their_words() -> None:
    scenario = sliding({})
    scene, placed = build(Model(scenario)), Model(scenario).bodies
    told = diagnose(RESIDUAL, REACHED, scene, placed).reason
    assert told.endswith("(the fastest is block above with 1 m/s, step 0)")
    for outcome in (BY_CODE[REACHED], Outcome("interrupted", "stopped by SIGTERM", ExitCode.STOPPED_EARLY)):
        assert diagnose(outcome, OVERLAP_LIMIT, scene, placed) == outcome
    scene.world.bodies[1].vy = np.nan
    assert diagnose(BY_CODE[NOT_FINITE], NOT_FINITE, scene, placed).reason.endswith("(block above, step 0)")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP, signal.SIGUSR1])
def test_signal_becomes_a_request_and_the_handler_comes_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_requests() as is_stopped:
        assert not is_stopped()
        os.kill(os.getpid(), number)
        assert is_stopped()
        assert is_stopped.reason() == f"stopped by {number.name}"
    assert signal.getsignal(number) is before


def test_second_signal_stops_at_once_but_only_when_the_first_was_heard() -> None:
    with stop_requests() as requests:
        for _ in range(2):  # a terminal and a launcher may both send one
            os.kill(os.getpid(), signal.SIGTERM)
        assert requests.reason() == "stopped by SIGTERM"
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize(("number", "own"), [(signal.SIGINT, lambda *_: None), (signal.SIGHUP, signal.SIG_IGN)])
def test_signals_of_which_somebody_else_takes_care_are_left_alone(number: signal.Signals, own: Any) -> None:
    """A program that has blocksim in it, and nohup, which wants a lost connection to be ignored."""
    before = signal.signal(number, own)
    try:
        with stop_requests() as is_stopped:
            os.kill(os.getpid(), number)
            assert not is_stopped()
            assert signal.getsignal(number) is own
    finally:
        signal.signal(number, before)


def test_runs_in_other_threads_leave_signals_alone() -> None:
    answers: list[bool] = []

    def ask() -> None:
        with stop_requests() as is_stopped:
            answers.append(is_stopped())

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert answers == [False]


def test_being_terminated_is_like_ctrl_c_during_a_study() -> None:
    with pytest.raises(KeyboardInterrupt), interruptible():
        os.kill(os.getpid(), signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL


COLUMNS, ROWS = 12, 18
RIGID: dict[str, object] = {"scheme": "nonsmooth", "step": 1e-3}
STEPS = {"explicit": 1500, "nonsmooth": 300}
both = pytest.mark.parametrize("scheme", STEPS)


def wall(scheme: str, columns: int = COLUMNS, rows: int = ROWS, end: float = 0.3) -> Scenario:
    """Return a wall that falls to pieces within a tenth of a second."""
    time = RIGID if scheme == "nonsmooth" else {"safety": 0.1}
    contact = {} if scheme == "nonsmooth" else {"stiffness_scale": 2e-4}
    return pushed_wall(columns, rows, contact=contact, time={"end": end, **time})


def bits(scene: Any) -> dict[str, bytes]:
    """Return everything that moves, presses or is tallied."""
    bodies, is_rigid = scene.world.bodies[:-1], isinstance(scene, Nonsmooth)
    names = ("x", "y", "angle", "vx", "vy", "spin") if is_rigid else bodies.dtype.names
    found = {name: bodies[name].tobytes() for name in names}
    if is_rigid:
        rows = scene.contacts.constraints[: int(scene.contacts.stepping[0].constraint_count)]
        found |= {name: rows[name].tobytes() for name in ("normal_one", "normal_two", "shear")}
    return {**found, "ledger": measure_row(scene).tobytes()}


@pytest.fixture(scope="module")
def alone() -> dict[str, dict[str, bytes]]:
    """Return the walls as one thread leaves them."""
    return {scheme: bits(ALONE.advance(build(Model(wall(scheme))), last)[0]) for scheme, last in STEPS.items()}


@both
def test_threads_and_more_room_for_pairs_change_no_bit_of_a_collapse_nor_of_its_ledger(
    alone: dict[str, dict[str, bytes]], monkeypatch: pytest.MonkeyPatch, scheme: str
) -> None:
    """A team continues where it, one thread or another team has stopped."""
    monkeypatch.setattr(world_build, "PAIRS_PER_BODY", 1)
    monkeypatch.setattr(world_build, "GROWTH", 1.05)
    scene, last = build(Model(wall(scheme))), STEPS[scheme]
    capacity = sum(array.size for array in arrays_of(scene))
    with Team(3) as together, Team(2) as couple:
        for team, step in ((together, 0), (together, 7), (couple, last // 3), (ALONE, last // 2), (together, last)):
            scene, status = team.advance(scene, step)
            assert status == 0
    assert sum(array.size for array in arrays_of(scene)) > capacity
    assert scene.world.clock[0].rebuilds > 5
    assert bits(scene) == alone[scheme]


def test_team_goes_from_one_scene_to_another_whatever_room_that_takes() -> None:
    few, many = (pushed_wall(8, 4, contact={"model": "kernel", "particle_spacing": d}) for d in (5e-3, 1e-3))
    with Team(2) as together:
        for scenario in (few, many):
            one, other = (team.advance(build(Model(scenario)), 20)[0] for team in (together, ALONE))
            assert bits(one) == bits(other)


def test_threads_that_would_only_wait_are_not_used() -> None:
    assert [useful_threads(4, bodies) for bodies in (3, 199, 200, 399, 400, 10_000)] == [1, 1, 2, 3, 4, 4]
    few = build(Model(wall("explicit", 4, 4)))
    assert team_for(few, 4).threads == 1
    assert state_hash(team_for(few, 4).advance(few, 10)[0]) == state_hash(few)
    assert BODIES_A_THREAD == 100  # the README says from how many blocks on threads help


def test_threads_that_there_are_not_are_refused_and_nothing_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    for threads in (0, -1):
        with pytest.raises(ValueError, match=f"threads must be at least 1, not {threads}"):
            simulate(wall("explicit"), threads=threads)

    def refuse(*_: object) -> None:
        message = "can't start new thread"
        raise RuntimeError(message)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", refuse)
    with pytest.raises(InvalidInputError, match="2 threads cannot be started here: can't start new thread"):
        Team(2).__enter__()


def test_full_disk_of_the_kernel_cache_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(schemes, "build", fail)
    monkeypatch.setattr("blocksim.simulation.schemes.jit.cache_folder", lambda: "/disk/blocksim/0123")
    schemes.compile_kernels.cache_clear()
    told = r"^/disk/blocksim/0123: the compiled solver cannot be stored there: No space"
    with pytest.raises(OutputError, match=told):
        schemes.compile_kernels()
