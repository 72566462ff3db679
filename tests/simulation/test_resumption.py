"""Runs that are interrupted and go on leave the bits of one that is not, or say why not; checkpoints are whole."""

import json
import re
import shutil
from hashlib import sha256
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.kernels.common.arrays import CACHE_LINE
from blocksim.scenario import Model, Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import Result, simulate, simulate_into
from blocksim.simulation.checkpoint import (
    DIGEST_BYTES,
    NEVER,
    CheckpointPolicy,
    CheckpointWriter,
    Past,
    Position,
    find_resumption,
    origin_of,
    read_checkpoint,
    restore_scene,
    write_checkpoint,
)
from blocksim.simulation.provenance import code_hashes
from blocksim.simulation.schemes import ALONE, AnyScene, Team, build
from blocksim.world.build import arrays_of
from tests.simulation.sliding import MODELS, assert_same, interrupted_at, sliding
from tests.sizes import in_all

SHARED = {"surface-linear", "outlines", "nonsmooth"}


@pytest.fixture
def two_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let as many threads work as are asked for, however few blocks there are."""

    def team(_: AnyScene, threads: int, _elements: int) -> Team:
        return Team(threads)

    monkeypatch.setattr("blocksim.simulation.schemes.team_for", team)


def points(whole: Result, seed: str, count: int) -> list[int]:
    """Return steps, in order, somewhere in a run while blocks slide: friction takes energy around them."""
    taken = np.diff(whole.frames.energy["friction"]) > 0.0
    edges = zip(whole.frames.step[:-1][taken].tolist(), whole.frames.step[1:][taken].tolist(), strict=True)
    steps = [step for first, last in edges for step in range(first + 1, last)]
    assert len(steps) > whole.summary.steps // 4
    return sorted(np.random.default_rng([*map(ord, seed)]).choice(steps, count, replace=False).tolist())


def sliding_seen(name: str) -> Scenario:
    return sliding({**MODELS[name], "output": {"contacts": True}}, end=0.02)


@pytest.mark.usefixtures("two_threads")
@pytest.mark.parametrize("count", [3, pytest.param(in_all(50), marks=pytest.mark.long)])
@pytest.mark.parametrize("name", MODELS)
def test_resumed_run_has_the_bits_of_a_continuous_one(tmp_path: Path, name: str, count: int) -> None:
    """Also where two threads have run the parts and one goes on: kernels of particles are not compiled for teams."""
    scenario = sliding_seen(name)
    whole = simulate_into(scenario, tmp_path / "whole")
    steps = points(whole, name, count)
    stopped = interrupted_at(scenario, tmp_path / "parts", steps, 2 if name in SHARED else 1)
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert stopped == steps
    assert resumed.summary.resumed_from == tuple(steps)
    assert whole.frames.contacts is not None
    assert len(whole.frames.contacts.rows) > 10
    assert_same(whole, resumed)


@pytest.mark.parametrize("name", ["surface-linear", "particles-hertz", "nonsmooth"])
def test_lists_that_have_grown_come_back_as_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr("blocksim.world.build.LEAST_PAIRS", 1)
    monkeypatch.setattr("blocksim.world.build.PAIRS_PER_BODY", 0)
    monkeypatch.setattr("blocksim.world.nonsmooth.ROOM", 1)
    scenario = sliding(MODELS[name], end=0.01)
    whole = simulate_into(scenario, tmp_path / "whole")
    interrupted_at(scenario, tmp_path / "parts", [whole.summary.steps // 2])
    stored = read_checkpoint(tmp_path / "parts" / "checkpoint.0").head.arrays
    assert [kind.shape for kind in stored] != [array.shape for array in arrays_of(build(Model(scenario)))]
    assert_same(whole, simulate_into(scenario, tmp_path / "parts", resume=True))


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run with two checkpoints that was interrupted; not to be changed."""
    folder = tmp_path_factory.mktemp("interrupted") / "begun"
    interrupted_at(sliding({}), folder, [500, 1000])
    assert (folder / "checkpoint.1").is_file()
    return folder


@pytest.fixture
def begun(interrupted: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(interrupted, tmp_path / "begun"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Return that run without an interruption."""
    whole = simulate_into(sliding({}), tmp_path_factory.mktemp("whole") / "run", resume=True)
    assert whole.summary.warnings == ()
    return whole


def newest(folder: Path) -> Path:
    return max(folder.glob("checkpoint.*"), key=lambda path: read_checkpoint(path).head.position.step)


def test_damaged_checkpoint_falls_back_to_the_older_one_and_none_that_is_whole_is_told(
    begun: Path, tmp_path: Path, whole: Result
) -> None:
    path = newest(begun)
    path.write_bytes(path.read_bytes()[:-1])
    shutil.copytree(begun, tmp_path / "none")
    resumed = simulate_into(sliding({}), begun, resume=True)
    assert resumed.summary.resumed_from == (500,)
    assert f"{path}: not a complete checkpoint" in resumed.summary.warnings[0]
    assert_same(whole, resumed)
    for one in (tmp_path / "none").glob("checkpoint.*"):
        one.write_bytes(b"")
    before = {one.name: one.read_bytes() for one in (tmp_path / "none").iterdir()}
    assert "no checkpoint is complete; --overwrite starts again" in refusal(tmp_path / "none", sliding({}))
    assert {one.name: one.read_bytes() for one in (tmp_path / "none").iterdir()} == before


def refusal(folder: Path, scenario: Scenario) -> str:
    with pytest.raises(InvalidInputError) as caught:
        simulate_into(scenario, folder, resume=True)
    return str(caught.value)


def test_other_scenario_or_code_is_refused_with_what_differs(begun: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = sliding({"contact": {"law": "hertz-mindlin"}}, end=0.07)
    told = "of another scenario: contact.law linear -> hertz-mindlin, time.end 0.05 -> 0.07; --overwrite"
    assert told in refusal(begun, other)
    new = {**code_hashes(), "kernels": "new", "world": "new"}
    monkeypatch.setattr("blocksim.simulation.provenance.code_hashes", lambda: new)
    assert "it differs in blocksim/kernels, blocksim/world; --overwrite" in refusal(begun, sliding({}))
    monkeypatch.setattr("blocksim.simulation.provenance.code_version", lambda: "99.1")
    assert re.search(r"version of the code: blocksim [\d.]+ -> 99\.1; --overwrite", refusal(begun, sliding({})))
    for path in begun.glob("checkpoint.*"):
        path.unlink()
    assert "scenario.toml: of another scenario: contact.law linear" in refusal(begun, other)


def test_missing_frames_are_no_ground_to_go_on(begun: Path, tmp_path: Path) -> None:
    simulate_into(sliding({}, end=0.002), tmp_path / "shorter")
    shutil.copy(tmp_path / "shorter" / "run.h5", begun / "run.h5")
    assert re.search(r"run\.h5: holds \d of the \d+ frames before step 1000", refusal(begun, sliding({})))


@pytest.mark.parametrize("name", ["particles/blocks/vy", "observables/friction", "contacts/normal_force"])
def test_frame_that_was_changed_before_the_run_continues_is_found(tmp_path: Path, name: str) -> None:
    scenario = sliding_seen("surface-linear")
    interrupted_at(scenario, tmp_path, [1000])
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        place = (4, 0) if file[name].ndim == 2 else 4
        file[name][place] = np.nextafter(file[name][place], np.inf)
    assert "run.h5: changed after the interruption: the " in refusal(tmp_path, scenario)


def test_changed_frame_after_the_checkpoint_is_reported_when_it_is_repeated(begun: Path) -> None:
    newest(begun).unlink()  # as if it had been killed before it wrote this one
    with h5py.File(begun / "run.h5", "r+") as file:
        steps = file["particles/blocks/step"][:]
        place = int(np.flatnonzero(steps > 500)[0])
        file["particles/blocks/y"][place, 0] *= 1 + 1e-15
    resumed = simulate_into(sliding({}), begun, resume=True)
    (told,) = resumed.summary.warnings
    assert told.startswith(f"{begun}/run.h5: the frame of step {steps[place]} differs from the recomputed one")


def test_times_of_all_parts_are_summed_and_told(begun: Path) -> None:
    before = json.loads((begun / "run.json").read_text())
    scenario = load_scenario(begun / "scenario.toml")
    checkpoint = find_resumption(begun, scenario).checkpoint
    assert checkpoint is not None
    resumed = simulate_into(scenario, begun, resume=True)
    told = json.loads((begun / "run.json").read_text())
    assert told["resumed_from"] == [500, 1000]
    assert told["solver_seconds"] > before["solver_seconds"] > 0.0
    assert told["total_seconds"] > checkpoint.head.position.total_seconds > 0.0
    assert before["last_checkpoint"] == 1000
    assert told["last_checkpoint"] is None
    left = {"scenario.toml", "final.csv", "joints.csv", "run.h5", "run.json", "done.json"}
    assert {path.name for path in begun.iterdir()} == left
    assert resumed.reason == "end of simulated time"
    with pytest.raises(OutputExistsError, match="contains another run"):
        simulate_into(sliding({}, end=0.07), begun, resume=True)


SCENARIO = sliding({})


def at(step: int) -> Position:
    return Position(
        step=step, frames=3, frames_sha256="", start_energy=0.1 + 0.2, solver_seconds=1.5, total_seconds=2.5, threads=2
    )


@pytest.mark.parametrize("name", ["surface-linear", "particles-linear", "nonsmooth"])
def test_scene_comes_back_to_the_last_bit_in_arrays_of_the_same_types(tmp_path: Path, name: str) -> None:
    scenario = sliding(MODELS[name])
    scene, _ = ALONE.advance(build(Model(scenario)), 20)
    scene.world.bodies[0].torque = -0.0
    scene.world.bodies[0].fx = np.nan
    write_checkpoint(tmp_path / "checkpoint.0", scene, at(100), origin_of(scenario))
    stored = read_checkpoint(tmp_path / "checkpoint.0")
    back = restore_scene(stored, build(Model(scenario)))
    assert stored.head.position == at(100)
    assert type(back) is type(scene)
    for one, other in zip(arrays_of(back), arrays_of(scene), strict=True):
        assert (type(one), one.dtype, one.shape) == (type(other), other.dtype, other.shape)
        assert one.size == 0 or one.ctypes.data % CACHE_LINE == 0
        for field in one.dtype.names or (...,):
            assert np.ascontiguousarray(one[field]).tobytes() == np.ascontiguousarray(other[field]).tobytes()
    if name != "surface-linear":
        with pytest.raises(InvalidInputError, match="do not fit this scene"):
            restore_scene(stored, build(Model(SCENARIO)))


@pytest.fixture
def written(tmp_path: Path) -> Path:
    write_checkpoint(tmp_path / "checkpoint.0", build(Model(SCENARIO)), at(100), origin_of(SCENARIO))
    return tmp_path / "checkpoint.0"


def test_every_flipped_bit_is_seen_and_what_is_cut_or_no_checkpoint(written: Path) -> None:
    whole = written.read_bytes()
    others = (b"", b"{}\n", b'{"format": "blocksim checkpoint 1"}\n', b"\x80\x04pickle\n")
    cuts = [whole[:size] for size in (0, 1, 31, 32, 33, 5000)]
    places = np.random.default_rng(1).integers(0, len(whole), 50).tolist()
    flips = [whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :] for place in places]
    for content in (*cuts, *flips, *(one + sha256(one).digest() for one in others)):
        written.write_bytes(content)
        with pytest.raises(InvalidInputError, match=r"checkpoint\.0: not a complete checkpoint"):
            read_checkpoint(written)


def forged(path: Path, old: bytes, new: bytes) -> Path:
    """Change a checkpoint so that its checksum is right."""
    content = path.read_bytes()[:-DIGEST_BYTES]
    assert old in content
    content = content.replace(old, new, 1)
    path.write_bytes(content + sha256(content).digest())
    return path


def test_array_that_claims_to_fill_all_memory_is_refused(written: Path) -> None:
    first = next(line for line in written.read_bytes().split(b"\x93NUMPY") if b"'shape': (" in line)
    shape = first[first.index(b"'shape': (") :].split(b"}")[0]
    with pytest.raises(InvalidInputError, match="not a complete checkpoint"):
        read_checkpoint(forged(written, shape, b"'shape': (9" + b"9" * (len(shape) - 13) + b",)"))


@pytest.mark.parametrize("shape", ["[-1,-4]", "[4294967296,4294967296]"])
def test_shapes_that_no_array_has_are_refused(written: Path, shape: str) -> None:
    old = f",{json.dumps(read_checkpoint(written).head.arrays[0].shape)}]".encode()
    stored = read_checkpoint(forged(written, old, f",{shape}]".encode()))
    with pytest.raises(InvalidInputError, match="does not fit this scene"):
        restore_scene(stored, build(Model(SCENARIO)))


def test_checkpoint_larger_than_the_memory_is_not_read(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("blocksim.world.free_memory.available_bytes", lambda: 2 * written.stat().st_size)
    with pytest.raises(InvalidInputError, match="of memory are free"):
        read_checkpoint(written)


def steps_in(folder: Path) -> dict[str, int]:
    return {path.name: read_checkpoint(path).head.position.step for path in folder.glob("checkpoint.*")}


def test_two_are_kept_by_turns_after_the_frames(tmp_path: Path) -> None:
    seen: list[int] = []  # checkpoints that are there when frames go to the disk
    scene = build(Model(SCENARIO))
    writer = CheckpointWriter(
        tmp_path, origin_of(SCENARIO), lambda: seen.append(len(list(tmp_path.glob("checkpoint.*"))))
    )
    for step in (10, 20, 30):
        writer.write(scene, at(step))
    assert steps_in(tmp_path) == {"checkpoint.0": 30, "checkpoint.1": 20}
    writer.write(scene, at(30))  # is there already
    assert seen == [0, 1, 2]


@pytest.mark.parametrize("name", ["checkpoint.0", "checkpoint.1"])
def test_the_one_that_a_run_continues_from_is_replaced_last(tmp_path: Path, name: str) -> None:
    past = Past(resumed_from=(7,), checkpoint=tmp_path / name, step=7)
    CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, past=past).write(build(Model(SCENARIO)), at(10))
    (written,) = steps_in(tmp_path)
    assert written != name
    assert read_checkpoint(tmp_path / written).head.position.resumed_from == (7,)


def test_steps_and_simulated_time_are_due_at_their_multiples_and_wall_time_stops_the_loop_nowhere(
    tmp_path: Path,
) -> None:
    periods = CheckpointPolicy(checkpoint_steps=10, checkpoint_time=1.4).periods(0.1)
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, periods)
    assert periods == (10, 14)
    assert [writer.next_step(done) for done in (0, 9, 10, 14, 20)] == [10, 10, 14, 20, 28]
    assert [done for done in range(1, 30) if writer.is_due(done)] == [10, 14, 20, 28]
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, seconds=60.0)
    assert writer.next_step(5) == NEVER
    assert not writer.is_due(5)
    writer.seconds = 0.0
    assert writer.is_due(5)


both_schemes = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
PROBES: list[dict[str, Any]] = [
    {"kind": "force", "on": "supports", "name": "base", "every": "0.1 ms"},
    {"kind": "force", "on": "2", "by": "1", "name": "joint-force", "every": "2 ms"},
    {"kind": "point", "body": "2", "at": [0.1, 0.05], "name": "corner", "every": "0.7 ms"},
    {"kind": "point", "body": "3", "name": "middle", "every": "step"},
    {"kind": "joint", "bodies": ["1", "2"], "name": "joint"},
    {"kind": "energy", "name": "energy"},
]
LOADS: list[dict[str, Any]] = [
    {"kind": "force", "name": "push", "body": "2", "magnitude": 30.0, "history": {"kind": "ramp", "end": 0.01}},
    {"kind": "pressure", "name": "water", "body": "1", "face": "left", "water_level": 0.08},
    {"kind": "horizontal", "name": "seismic", "magnitude": 0.2},
]
EVENTS = [
    {"at": 0.008, "unload": ["push"], "remove": ["post"]},
    {"at": 0.012, "free": ["ram"], "unload": ["water"]},
    {"at": 0.010, "velocity": {"body": "3", "vx": 0.5}},
    {"at": 0.016, "fix": ["3"]},
]


def all_together(scheme: str, **changes: Any) -> Scenario:
    """Return a stack that settles, is loaded, pushed and shaken."""
    ramp = {"kind": "ramp", "distance": 0.1, "speed": 1.0, "direction": "180 deg"}
    step, stiffness = ({"step": 1e-4}, {}) if scheme == "nonsmooth" else ({}, {"stiffness_scale": 0.01})
    data = {
        "schema": 1,
        "name": "together",
        "materials": {"stone": {"density": 2000.0, "young_modulus": "1 GPa", "poisson_ratio": 0.2}},
        "blocks": {"brick": {"width": 0.2, "height": 0.1, "length": 0.1, "material": "stone"}},
        "structures": [{"kind": "stack", "block": "brick", "count": 3}],
        "bodies": [
            {"block": "brick", "name": "post", "x": -0.25, "y": 0.05, "fixed": True},
            {"block": "brick", "name": "ram", "x": 0.32, "y": 0.15, "motion": ramp},
        ],
        "motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 20.0, "ramp": 0.01},
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "contact": {"restitution": 0.0, **stiffness},
        "time": {"scheme": scheme, "end": 0.02, "stop_at_rest": False, **step},
        "output": {"every": 0.001, "contacts": True},
        "start": {"settle": True},
        "loads": LOADS,
        "events": EVENTS,
        "probes": PROBES,
        "actuators": [{"name": "jack", "body": "1", "displacement": {"kind": "ramp", "to": "1 mm", "rate": "0.1 m/s"}}],
    }
    return scenario_from_mapping({**data, **changes})


@both_schemes
def test_interruptions_at_and_beside_events_change_no_byte_nor_do_probes_and_contacts(
    scheme: str, tmp_path: Path
) -> None:
    scenario = all_together(scheme)
    whole = simulate_into(scenario, tmp_path / "whole")
    assert whole.summary.settled is not None
    assert [event.time_s for event in whole.summary.events] == sorted(event.time_s for event in whole.summary.events)
    first, _, third, _ = (event.step for event in whole.summary.events)
    steps = [first - 1, first, (third + whole.summary.steps) // 2]
    assert interrupted_at(scenario, tmp_path / "parts", steps) == steps
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert_same(resumed, whole)
    assert resumed.summary.events == whole.summary.events
    assert resumed.summary.movement == whole.summary.movement
    assert resumed.summary.warnings == ()
    for name in ("jack", *(probe["name"] for probe in PROBES)):
        table = f"probe-{name}.csv"
        assert table in resumed.summary.sha256
        assert (tmp_path / "parts" / table).read_bytes() == (tmp_path / "whole" / table).read_bytes()
    unrecorded = simulate(all_together(scheme, probes=[], output={"every": 0.001}))
    assert unrecorded.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert unrecorded.frames.x.tobytes() == whole.frames.x.tobytes()
