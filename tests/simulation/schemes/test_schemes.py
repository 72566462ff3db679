"""Both schemes behind one interface, and the threads that share a scene: the same bits, however many there are."""

from __future__ import annotations

import errno
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.errors import InvalidInputError, OutputError
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.scenario import scenario_from_mapping
from blocksim.scenario.models import timeline
from blocksim.simulation import schemes, simulate
from blocksim.simulation.provenance import state_hash
from blocksim.simulation.schemes import (
    ALONE,
    BODIES_A_THREAD,
    SCHEMES,
    Team,
    build_scene,
    measure_row,
    scheme_of,
    team_for,
    useful_threads,
)
from blocksim.simulation.schemes.explicit import SURFACE_OF_OUTLINES
from blocksim.simulation.schemes.nonsmooth import IN_ROUNDS, OF_OUTLINES
from blocksim.world import build
from blocksim.world.build import arrays_of

if TYPE_CHECKING:
    from blocksim.scenario import Scenario

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
    return {scheme: bits(ALONE.advance(build_scene(wall(scheme)), last)[0]) for scheme, last in STEPS.items()}


def test_every_scheme_of_the_file_can_be_run() -> None:
    assert set(SCHEMES) == set(timeline.SCHEMES)
    for name, scheme in SCHEMES.items():
        scene = build_scene(three_blocks(time={"scheme": name}))
        assert scheme_of(scene) is scheme
        assert len(measure_row(ALONE.advance(scene, 0)[0])) == len(scheme.row_names)


@both
def test_threads_do_not_change_a_bit_of_a_collapse_nor_of_its_ledger(
    alone: dict[str, dict[str, bytes]], scheme: str
) -> None:
    """A team continues where it, one thread or another team has stopped."""
    scene, last = build_scene(wall(scheme)), STEPS[scheme]
    with Team(3) as together, Team(2) as couple:
        for team, step in ((together, 0), (together, 7), (couple, last // 3), (ALONE, last // 2), (together, last)):
            scene, status = team.advance(scene, step)
            assert status == 0
    assert scene.world.clock[0].rebuilds > 5
    assert bits(scene) == alone[scheme]


@pytest.mark.parametrize(("scheme", "threads"), [("explicit", 2), ("nonsmooth", 1)])
def test_more_room_for_pairs_keeps_impulses_and_tallies(
    alone: dict[str, dict[str, bytes]], monkeypatch: pytest.MonkeyPatch, scheme: str, threads: int
) -> None:
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 1)
    monkeypatch.setattr(build, "GROWTH", 1.05)
    scene = build_scene(wall(scheme))
    capacity = sum(array.size for array in arrays_of(scene))
    with Team(threads) as together:
        scene, _ = together.advance(scene, STEPS[scheme])
    assert sum(array.size for array in arrays_of(scene)) > capacity
    assert bits(scene) == alone[scheme]


def test_team_goes_from_one_scene_to_another_whatever_room_that_takes() -> None:
    few, many = (pushed_wall(8, 4, contact={"model": "kernel", "particle_spacing": d}) for d in (5e-3, 1e-3))
    with Team(2) as together:
        for scenario in (few, many):
            one, other = (team.advance(build_scene(scenario), 20)[0] for team in (together, ALONE))
            assert bits(one) == bits(other)


def test_threads_that_would_only_wait_are_not_used() -> None:
    assert [useful_threads(4, bodies) for bodies in (3, 199, 200, 399, 400, 10_000)] == [1, 1, 2, 3, 4, 4]
    few = build_scene(wall("explicit", 4, 4))
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


SETS = {name: changes for scheme in SCHEMES.values() for name, changes in scheme.kernel_sets.items()}
REBOUND: dict[str, Any] = {"time": {"scheme": "nonsmooth"}, "pairs": {"any": {"ground": {"restitution": 0.9}}}}


@pytest.mark.parametrize("name", [*SETS, "rebound of a pair"])
def test_only_scenes_with_outlines_or_impacts_in_rounds_have_the_kernels_for_them(name: str) -> None:
    changes = SETS.get(name, REBOUND)
    scenario = scenario_from_mapping({**schemes.SMALLEST_SCENE, **changes})
    found, scene = schemes.kernels_of(scenario), build_scene(scenario)
    assert found == (name if name in SETS else IN_ROUNDS["nonsmooth"])
    in_rounds = isinstance(scene, Nonsmooth) and scene.contacts.impact_lanes is not None
    assert in_rounds == (found in IN_ROUNDS.values())
    rectangles = {key: value for key, value in changes.items() if key != "blocks"}
    of_outlines = {
        OF_OUTLINES: "nonsmooth",
        SURFACE_OF_OUTLINES: "surface",
        IN_ROUNDS[OF_OUTLINES]: IN_ROUNDS["nonsmooth"],
    }
    plain = scenario_from_mapping({**schemes.SMALLEST_SCENE, **rectangles})
    assert schemes.kernels_of(plain) == of_outlines.get(name, found)


def test_full_disk_of_the_kernel_cache_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(schemes, "build_scene", fail)
    monkeypatch.setattr("blocksim.simulation.schemes.jit.cache_folder", lambda: "/disk/blocksim/0123")
    schemes.compile_kernels.cache_clear()
    told = r"^/disk/blocksim/0123: the compiled solver cannot be stored there: No space"
    with pytest.raises(OutputError, match=told):
        schemes.compile_kernels()
