"""A system that only tests know goes through everything that blocks go through, registered by a line a word."""

import csv
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import blocksim
from blocksim.analysis.bits import differences
from blocksim.errors import ExitCode, InvalidInputError, ScenarioError
from blocksim.scenario import Scenario, json_schema, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.models.base import SYSTEMS
from blocksim.simulation import Frames, Result, run_ensemble
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.loop import BY_CODE, diagnose
from blocksim.simulation.schemes import ALONE, SMALLEST_SCENE, build, team_for
from blocksim.simulation.stores.exports import write_frames_csv, write_vtkhdf
from blocksim.simulation.trajectory import data_set, tidy_table
from blocksim.view import style
from blocksim.view.animation import Animation, Look
from blocksim.view.report import player
from blocksim.view.report.player import element_bytes, pack_frames
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.run_data import Support, drawable_frames, extent_of
from blocksim.view.strip import draw_strip
from blocksim.world.describe import describe
from blocksim.world.free_memory import chunk_rows
from blocksim.world.systems import INTERACTIONS
from blocksim.world.systems.system import Indices, Track, discs
from tests.simulation.masses import MASSES, RADIUS, MassTable, ground
from tests.view.report.folders import numbers

REGISTRATIONS: tuple[tuple[dict[Any, Any], Any, Any], ...] = (
    (SYSTEMS, "masses", MassTable),
    (INTERACTIONS, ("masses", "supports"), ground),
    (INTERACTIONS, ("masses", "blocks"), None),
    (INTERACTIONS, ("masses", "masses"), None),
)
BLOCK = {"width": 0.1, "height": 0.1, "length": 0.1, "material": "any"}
THREE = {"x": 0.2, "y": 0.05, "count": 3, "spacing": 0.02}
END = 0.12  # s; the masses are on the ground after 0.1 s


@pytest.fixture(scope="module", autouse=True)
def registered() -> Iterator[None]:
    """Register the system: one line for it, one for each pair."""
    with pytest.MonkeyPatch.context() as patch:
        for registry, key, entry in REGISTRATIONS:
            patch.setitem(registry, key, entry)
        yield


def scene(masses: dict[str, Any] | None = THREE, **changes: Any) -> Scenario:
    """Return a scenario of one block at rest and some masses that fall."""
    data: dict[str, Any] = {
        **SMALLEST_SCENE,
        "name": "toy",
        "materials": {"any": {"density": 1000.0, "young_modulus": 1e6, "poisson_ratio": 0.3}},
        "blocks": {"any": BLOCK},
        "bodies": [{"block": "any", "x": 0.0, "y": 0.05}],
        "time": {"end": END, "stop_at_rest": False},
        "output": {"every": 0.01},
        **changes,
    }
    return scenario_from_mapping(data if masses is None else {**data, "masses": [masses]})


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Return the run of a block and three masses, in a folder."""
    return blocksim.run(scene(), out=tmp_path_factory.mktemp("masses") / "toy")


@pytest.fixture
def frames(run: Result) -> Frames:
    return run.frames


def test_masses_fall_bounce_and_keep_their_energy() -> None:
    result = blocksim.run(scene(time={"end": 0.25, "stop_at_rest": False}))
    (masses,) = result.frames.others
    time, y = result.frames.time, masses["y"][:, 0]
    in_flight = time < 0.1
    np.testing.assert_allclose(y[in_flight], 0.05 - 0.5 * 9.81 * time[in_flight] ** 2, atol=1e-12)
    assert y[-2] > 0.0 > y.min()  # thrown up again
    assert masses["vy"].max() == pytest.approx((2 * 9.81 * 0.05) ** 0.5, rel=0.1)
    assert result.summary.energy_J.relative_residual < 1e-4
    entries = result.summary.energy_J.model_dump()
    total = sum(entries[f"masses_{name}"] for name in ("kinetic", "potential", "stored"))
    assert total == pytest.approx(3 * 9.81 * 0.05, rel=1e-4)


def test_blocks_do_not_notice_a_system_that_does_not_touch_them(run: Result) -> None:
    step = {"end": END, "stop_at_rest": False, "step": run.summary.time_step_s}
    alone = blocksim.run(scene(None, time=step)).frames
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(run.frames, name), err_msg=name)


def test_runs_that_continue_and_members_of_ensembles_end_where_single_runs_end(run: Result, tmp_path: Path) -> None:
    cut = CheckpointPolicy(wall_time=1e-9)
    assert blocksim.run(scene(), out=tmp_path / "cut", precautions=cut).status == "interrupted"
    again = blocksim.run(scene(), out=tmp_path / "cut", resume=True)
    assert again.summary.final_state_sha256 == run.summary.final_state_sha256
    assert again.summary.energy_J == run.summary.energy_J
    assert differences(again.frames, run.frames).is_none
    scenarios = [scene(), scene({**THREE, "y": 0.03}), scene(None)]
    for scenario, end in zip(scenarios, run_ensemble(scenarios, threads=1), strict=True):
        single = blocksim.run(scenario)
        assert (end.columns, end.ledger) == (single.columns, single.summary.energy_J)


def test_frames_are_kept_and_read_back_with_units(run: Result) -> None:
    assert run.folder is not None
    (held,) = blocksim.run(scene()).frames.others
    read = blocksim.open_run(run.folder)
    (masses,) = read.frames.others
    np.testing.assert_array_equal(masses.values, held.values)
    assert masses.names == ("m1", "m2", "m3")
    with h5py.File(run.folder / "run.h5") as file:
        assert file["particles/masses/vy"].attrs["unit"] == "m s-1"
        assert file["particles/masses/mass"][:].tolist() == [1.0] * 3
        assert "masses_stored" in file["observables"]
    assert run.summary.energy_J.residual == read.summary.energy_J.residual


def test_a_changed_bit_of_the_system_is_found(frames: Frames) -> None:
    (masses,) = frames.others
    values = masses.values.copy()
    values[3, 1, 2] = np.nextafter(values[3, 1, 2], 1.0)
    first = differences(frames, replace(frames, others=(replace(masses, values=values),))).first
    assert first is not None
    assert (first.frame, first.block, first.quantity) == (3, "m3", "masses y (m)")
    assert differences(frames, frames).is_none


def test_exports_have_a_table_and_cells_of_the_system(frames: Frames, tmp_path: Path) -> None:
    write_frames_csv(tmp_path / "toy.csv", frames)
    with (tmp_path / "toy_masses.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", "mass", "x_mm", "y_mm", "vy_mm_s", "height_mm"]
    assert [float(row["y_mm"]) for row in rows] == (1e3 * frames.others[0]["y"]).ravel().tolist()
    assert write_vtkhdf(tmp_path / "toy.vtkhdf", frames, scene()) == len(frames)
    with h5py.File(tmp_path / "toy.vtkhdf") as file:
        group = file["VTKHDF"]
        assert group["Types"][:].tolist() == [9, 7, 7, 7, 9]
        assert group["CellData/block"][:].tolist() == [1, 0, 0, 0, 0]
        heights = group["CellData/height_mm"][:].reshape(-1, 5)[:, 1:4]
    np.testing.assert_array_equal(heights, 1e3 * (frames.others[0]["y"] - 0.05))
    assert tidy_table(frames, "masses").shape == (3 * len(frames), 6)
    assert data_set(frames, "toy")["masses_vy"].shape == (len(frames), 3)


def test_the_step_is_no_longer_than_the_system_admits_and_threads_are_of_use_for_many_elements() -> None:
    stiff = {**THREE, "stiffness": 1e10}
    assert blocksim.run(scene(stiff, time={"end": 1e-4})).summary.time_step_s == pytest.approx(1e-6)
    one = build(scene()).scene
    assert [team_for(one, 4, elements).threads for elements in (0, 3, 250, 1000)] == [1, 1, 2, 4]


def test_scenarios_round_trip_and_mistakes_are_located(tmp_path: Path) -> None:
    path, text = tmp_path / "toy.toml", scenario_to_toml(scene())
    path.write_text(text)
    assert load_scenario(path) == scene()
    assert load_scenario(path, ["masses.0.y=70 mm"]).systems["masses"][0].y == 0.07  # type: ignore[attr-defined]
    assert json_schema()["properties"]["masses"]["items"]["properties"]["count"]["maximum"] == 1000
    for old, new, told in (
        ("count = 3", "count = 0", "0 is not a whole number from 1 to 1000"),
        ("count = 3", "number = 3", "unknown key"),
        ("y = 0.05, count", "count", "this key is missing"),
        ("y = 0.05, count", "y = -1.0, count", "-1 m is below the ground"),
        ('scheme = "explicit"', 'scheme = "nonsmooth"', "masses need another scheme"),
    ):
        assert old in text
        changed = text.replace(old, new)
        path.write_text(changed.replace("safety = 0.05\n", "") if "nonsmooth" in changed else changed)
        with pytest.raises(ScenarioError) as error:
            load_scenario(path)
        assert told in str(error.value)
        assert any(problem.line_number for problem in error.value.problems)


def test_a_pair_that_is_not_modelled_or_gets_other_functions_once_compiled_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    build(scene())
    monkeypatch.setitem(INTERACTIONS, ("masses", "supports"), lambda: float)
    with pytest.raises(ValueError, match="compiled with other functions"):
        build(scene())
    monkeypatch.delitem(INTERACTIONS, ("masses", "blocks"))
    for use in (blocksim.run, describe):
        with pytest.raises(InvalidInputError, match=r"^masses and blocks cannot be in one scene: .* not modelled"):
            use(scene())


def test_a_number_that_is_not_finite_ends_the_run_and_names_the_system() -> None:
    one = build(scene())
    one.scene.systems[0].points.y[1] = np.nan
    after, code = ALONE.advance(one.scene, 100_000)
    told = diagnose(BY_CODE[code], code, after, one.placed)
    assert told.exit_code == ExitCode.NUMERICAL_FAILURE
    assert "(masses, step " in told.reason


def test_pictures_show_the_system(frames: Frames, tmp_path: Path) -> None:
    extent = extent_of(frames, drawable_frames(frames))
    assert extent.left < -50.0
    assert extent.right > 1e3 * (frames.others[0]["x"][0].max() + RADIUS)
    draw_strip(frames, tmp_path / "with.png")
    draw_strip(replace(frames, others=()), tmp_path / "without.png")
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "without.png").read_bytes()
    animation = Animation(frames, Support(), Look())
    colour = [int(style.block_colour(1)[place : place + 2], 16) for place in (1, 3, 5)]
    first, last = (int((animation.picture(frame) == colour).all(axis=-1).sum()) for frame in (0, len(frames) - 1))
    assert min(first, last) > 30  # pixels of their colour, which the block does not have


def test_the_player_gets_every_element_and_all_corners_of_those_that_grow(
    run: Result, frames: Frames, monkeypatch: pytest.MonkeyPatch
) -> None:
    (packed,) = pack_frames(frames).data["systems"]
    (masses,) = frames.others
    assert (packed["name"], packed["count"], packed["corners"]) == ("masses", 3, 8)
    for axis in ("x", "y"):
        np.testing.assert_allclose(numbers(packed[axis]).reshape(-1, 3), 1e3 * masses[axis], rtol=1e-6)
    assert np.abs(np.hypot(*numbers(packed["shape"]).reshape(8, 2).T) - 1e3 * RADIUS).max() < 1e-6
    assert element_bytes(frames, drawable_frames(frames)) == 2 * 2 * 3
    assert run.folder is not None
    told = dict(run_subject("r1", read_folder(run.folder)).page["summary"])
    assert (told["blocks"], told["masses"]) == ("1", "3")

    def growing(track: Track, chosen: Indices) -> np.ndarray:
        corners = discs(track, chosen, np.full(len(track.names), RADIUS))
        return corners * (1.0 + np.asarray(chosen)[:, None, None, None])

    monkeypatch.setattr(player, "_outlines", lambda track, frame: 1e3 * growing(track, np.array([frame]))[0])
    (packed,) = pack_frames(frames).data["systems"]
    assert packed["shape"] is None
    wanted = 1e3 * growing(masses, np.arange(len(frames)))
    np.testing.assert_allclose(numbers(packed["x"]), wanted[..., 0].ravel(), rtol=1e-6)
    assert element_bytes(frames, drawable_frames(frames)) == 2 * 16 * 3


def test_check_counts_the_elements() -> None:
    few, many = describe(scene()), describe(scene({**THREE, "count": 1000, "spacing": 1e-3}))
    assert (few.systems, many.systems) == ({"masses": 3}, {"masses": 1000})
    assert few.step > 0.0
    cost = MASSES.cost
    frames = math.ceil(many.frames / chunk_rows(1000)) * chunk_rows(1000)  # run.h5 has room for whole chunks
    assert many.seconds - few.seconds == pytest.approx(997 * cost.seconds * many.steps)
    assert many.bytes - few.bytes == 997 * 8 * 4 * frames
    assert many.memory - few.memory == 997 * cost.memory
