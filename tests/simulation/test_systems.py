"""A system that only tests know goes through everything that blocks go through, registered by a line a word."""

import csv
import math
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
from blocksim.simulation import run_ensemble
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
from tests.simulation.masses import MASSES, RADIUS, MassTable, ground, tie
from tests.view.report.folders import numbers

REGISTRATIONS: tuple[tuple[dict[Any, Any], Any, Any], ...] = (
    (SYSTEMS, "masses", MassTable),
    (INTERACTIONS, ("masses", "supports"), ground),
    (INTERACTIONS, ("masses", "blocks"), tie),
    (INTERACTIONS, ("masses", "masses"), None),
)
MATERIAL = {"density": 1000.0, "young_modulus": 1e6, "poisson_ratio": 0.3}
BLOCK = {"width": 0.1, "height": 0.1, "length": 0.1, "material": "any"}
THREE = {"x": 0.2, "y": 0.05, "count": 3, "spacing": 0.02}
END = 0.12  # s; the masses are on the ground after 0.1 s


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Register the system: one line for it, one for each pair."""
    for registry, key, entry in REGISTRATIONS:
        monkeypatch.setitem(registry, key, entry)


def scene(masses: dict[str, Any] | None = THREE, **changes: Any) -> Scenario:
    """Return a scenario of one block at rest and some masses that fall."""
    data: dict[str, Any] = {
        **SMALLEST_SCENE,
        "name": "toy",
        "materials": {"any": MATERIAL},
        "blocks": {"any": BLOCK},
        "bodies": [{"block": "any", "x": 0.0, "y": 0.05}],
        "time": {"end": END, "stop_at_rest": False},
        "output": {"every": 0.01},
        **changes,
    }
    return scenario_from_mapping(data if masses is None else {**data, "masses": [masses]})


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
    assert entries["masses_kinetic"] + entries["masses_potential"] + entries["masses_stored"] == pytest.approx(
        3 * 9.81 * 0.05, rel=1e-4
    )


def test_blocks_do_not_notice_a_system_that_does_not_touch_them() -> None:
    alone, together = blocksim.run(scene(None)), blocksim.run(scene())
    step = {"end": END, "stop_at_rest": False, "step": together.summary.time_step_s}
    alone = blocksim.run(scene(None, time=step))
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        np.testing.assert_array_equal(getattr(alone.frames, name), getattr(together.frames, name), err_msg=name)


def test_forces_between_systems_act_both_ways() -> None:
    tied = {**THREE, "count": 1, "y": 0.5, "tie": 1e3, "x": 0.3}
    flying = [{"block": "any", "x": 0.0, "y": 0.5, "velocity": [1.0, 0.0]}]
    result = blocksim.run(scene(tied, bodies=flying, gravity=0.0))
    (masses,) = result.frames.others
    mass = 1000.0 * 0.1**3
    momentum = mass * result.frames.vx[:, 0] + masses["vx"][:, 0] * masses["mass"][0]
    np.testing.assert_allclose(momentum, mass * 1.0, rtol=1e-12)
    assert np.ptp(masses["vx"]) > 0.5
    assert result.summary.energy_J.relative_residual < 1e-4


def test_resumed_runs_are_bit_identical(tmp_path: Path) -> None:
    whole = blocksim.run(scene(), out=tmp_path / "whole")
    cut = CheckpointPolicy(wall_time=1e-9)
    part = blocksim.run(scene(), out=tmp_path / "cut", precautions=cut)
    assert part.status == "interrupted"
    again = blocksim.run(scene(), out=tmp_path / "cut", resume=True)
    assert again.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert again.summary.energy_J == whole.summary.energy_J
    for one, other in zip(again.frames.tracks, whole.frames.tracks, strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_frames_are_kept_and_read_back_with_units(tmp_path: Path) -> None:
    result = blocksim.run(scene(), out=tmp_path / "run")
    (held,) = blocksim.run(scene()).frames.others
    (read,) = blocksim.open_run(tmp_path / "run").frames.others
    np.testing.assert_array_equal(read.values, held.values)
    assert read.names == ("m1", "m2", "m3")
    with h5py.File(tmp_path / "run" / "run.h5") as file:
        assert file["particles/masses/vy"].attrs["unit"] == "m s-1"
        assert file["particles/masses/mass"][:].tolist() == [1.0] * 3
        assert "masses_stored" in file["observables"]
    assert result.summary.energy_J.residual == blocksim.open_run(tmp_path / "run").summary.energy_J.residual


def test_a_changed_bit_of_the_system_is_found() -> None:
    frames = blocksim.run(scene()).frames
    (masses,) = frames.others
    values = masses.values.copy()
    values[3, 1, 2] = np.nextafter(values[3, 1, 2], 1.0)
    first = differences(frames, replace(frames, others=(replace(masses, values=values),))).first
    assert first is not None
    assert (first.frame, first.block, first.quantity) == (3, "m3", "masses y (m)")
    assert differences(frames, frames).is_none


def test_exports_have_a_table_and_cells_of_the_system(tmp_path: Path) -> None:
    frames = blocksim.run(scene()).frames
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


def test_ensembles_end_where_single_runs_end() -> None:
    scenarios = [scene(), scene({**THREE, "y": 0.03}), scene(None)]
    for one, end in zip(scenarios, run_ensemble(scenarios, threads=1), strict=True):
        single = blocksim.run(one)
        assert end.columns == single.columns
        assert end.ledger == single.summary.energy_J


def test_the_step_is_no_longer_than_the_system_admits() -> None:
    stiff = {**THREE, "stiffness": 1e10}
    assert blocksim.run(scene(stiff, time={"end": 1e-4})).summary.time_step_s == pytest.approx(1e-6)


def test_scenarios_round_trip_and_mistakes_are_located(tmp_path: Path) -> None:
    text = scenario_to_toml(scene())
    (tmp_path / "toy.toml").write_text(text)
    assert load_scenario(tmp_path / "toy.toml") == scene()
    assert load_scenario(tmp_path / "toy.toml", ["masses.0.y=70 mm"]).systems["masses"][0].y == 0.07  # type: ignore[attr-defined]
    assert json_schema()["properties"]["masses"]["items"]["properties"]["count"]["maximum"] == 1000
    for change, told in (
        (("count = 3", "count = 0"), "0 is not a whole number from 1 to 1000"),
        (("count = 3", "number = 3"), "unknown key"),
        (("y = 0.05, count", "count"), "this key is missing"),
        (("y = 0.05, count", "y = -1.0, count"), "-1 m is below the ground"),
        (('scheme = "explicit"', 'scheme = "nonsmooth"'), "masses need another scheme"),
    ):
        assert change[0] in text
        changed = text.replace(*change)
        if "nonsmooth" in changed:
            changed = changed.replace("safety = 0.05\n", "")
        with pytest.raises(ScenarioError) as error:
            scenario_from_text(tmp_path, changed)
        assert told in str(error.value)
        assert any(problem.line_number for problem in error.value.problems)


def scenario_from_text(folder: Path, text: str) -> Scenario:
    (folder / "changed.toml").write_text(text)
    return load_scenario(folder / "changed.toml")


def test_a_pair_that_is_not_modelled_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(INTERACTIONS, ("masses", "blocks"))
    with pytest.raises(InvalidInputError, match=r"^masses and blocks cannot be in one scene: .* not modelled"):
        blocksim.run(scene())


def test_a_number_that_is_not_finite_ends_the_run_and_names_the_system() -> None:
    one = build(scene())
    one.scene.systems[0].points.y[1] = np.nan
    after, code = ALONE.advance(one.scene, 100_000)
    told = diagnose(BY_CODE[code], code, after, one.placed)
    assert told.exit_code == ExitCode.NUMERICAL_FAILURE
    assert "(masses, step " in told.reason


def test_a_pair_cannot_get_other_functions_once_they_are_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    build(scene())
    monkeypatch.setitem(INTERACTIONS, ("masses", "blocks"), ground)
    with pytest.raises(ValueError, match="compiled with other functions"):
        build(scene())


def test_pictures_show_the_system(tmp_path: Path) -> None:
    frames = blocksim.run(scene()).frames
    masses = 1e3 * frames.others[0]["x"][0]
    extent = extent_of(frames, drawable_frames(frames))
    assert extent.left < -50.0
    assert extent.right > masses.max() + 1e3 * RADIUS
    draw_strip(frames, tmp_path / "with.png")
    draw_strip(replace(frames, others=()), tmp_path / "without.png")
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "without.png").read_bytes()
    animation = Animation(frames, Support(), Look())
    colour = [int(style.block_colour(1)[place : place + 2], 16) for place in (1, 3, 5)]
    first, last = (int((animation.picture(frame) == colour).all(axis=-1).sum()) for frame in (0, len(frames) - 1))
    assert min(first, last) > 30  # pixels of their colour, which the block does not have


def test_the_player_gets_every_element(tmp_path: Path) -> None:
    frames = blocksim.run(scene(), out=tmp_path / "toy").frames
    (packed,) = pack_frames(frames).data["systems"]
    (masses,) = frames.others
    assert (packed["name"], packed["count"], packed["corners"]) == ("masses", 3, 8)
    for axis in ("x", "y"):
        np.testing.assert_allclose(numbers(packed[axis]).reshape(-1, 3), 1e3 * masses[axis], rtol=1e-6)
    assert np.abs(np.hypot(*numbers(packed["shape"]).reshape(8, 2).T) - 1e3 * RADIUS).max() < 1e-6
    assert element_bytes(frames, drawable_frames(frames)) == 2 * 2 * 3
    told = dict(run_subject("r1", read_folder(tmp_path / "toy")).page["summary"])
    assert (told["blocks"], told["masses"]) == ("1", "3")


def test_the_player_gets_all_corners_of_elements_that_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = blocksim.run(scene()).frames

    def growing(track: Track, chosen: Indices) -> np.ndarray:
        corners = discs(track, chosen, np.full(len(track.names), RADIUS))
        return corners * (1.0 + np.asarray(chosen)[:, None, None, None])

    monkeypatch.setattr(player, "_outlines", lambda track, frame: 1e3 * growing(track, np.array([frame]))[0])
    (packed,) = pack_frames(frames).data["systems"]
    assert packed["shape"] is None
    wanted = 1e3 * growing(frames.others[0], np.arange(len(frames)))
    np.testing.assert_allclose(numbers(packed["x"]), wanted[..., 0].ravel(), rtol=1e-6)
    assert element_bytes(frames, drawable_frames(frames)) == 2 * 16 * 3


def test_check_counts_the_elements() -> None:
    few, many = describe(scene()), describe(scene({**THREE, "count": 1000, "spacing": 1e-3}))
    assert (few.systems, many.systems) == ({"masses": 3}, {"masses": 1000})
    cost = MASSES.cost
    frames = math.ceil(many.frames / chunk_rows(1000)) * chunk_rows(1000)  # run.h5 has room for whole chunks
    assert many.seconds - few.seconds == pytest.approx(997 * cost.seconds * many.steps)
    assert many.bytes - few.bytes == 997 * 8 * 4 * frames
    assert many.memory - few.memory == 997 * cost.memory


def test_threads_are_of_use_for_many_elements() -> None:
    one = build(scene()).scene
    assert [team_for(one, 4, elements).threads for elements in (0, 3, 250, 1000)] == [1, 1, 2, 4]


def test_check_refuses_what_a_run_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    assert describe(scene()).step > 0.0
    monkeypatch.delitem(INTERACTIONS, ("masses", "masses"))
    with pytest.raises(InvalidInputError, match="masses and masses cannot be in one scene"):
        describe(scene())
