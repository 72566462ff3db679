"""Probes and recorded contacts: statics and rigid motion in both schemes, and what explains the motion exactly."""

import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.simulation import Result, loop, simulate, simulate_into
from blocksim.simulation.files import prepare_folder
from blocksim.simulation.instruments import ProbeSeries
from blocksim.simulation.stores.hdf5 import read_probes
from blocksim.simulation.trajectory import SUPPORT, force_on_supports, forces_on_a
from tests.simulation.conftest import Shipped
from tests.simulation.sliding import interrupted_at

both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
WEIGHT = 1000 * 0.2 * 0.1 * 0.1 * 9.81  # N
OAK = {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}
PROBES: list[dict[str, Any]] = [
    {"kind": "force", "on": "supports", "name": "base"},
    {"kind": "force", "on": "2", "by": "1", "every": "2 ms"},
    {"kind": "point", "body": "2", "at": [0.1, 0.05], "every": "step"},
    {"kind": "joint", "bodies": ["1", "2"]},
    {"kind": "energy", "every": "7 ms"},
]


def scene(scheme: str, probes: list[dict[str, Any]], end: float = 0.3, **tables: Any) -> Scenario:
    data: dict[str, Any] = {
        "schema": 1,
        "name": "a",
        "materials": {"oak": OAK},
        "blocks": {"brick": {"width": 0.2, "height": 0.1, "length": 0.1, "material": "oak"}},
        "structures": [{"kind": "stack", "block": "brick", "count": 2}],
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "contact": {} if scheme == "nonsmooth" else {"stiffness_scale": 0.01},
        "time": {"scheme": scheme, "end": end, "stop_at_rest": False},
        "output": {"every": "10 ms"},
        "probes": probes,
    }
    return scenario_from_mapping({**data, **tables})


def probed(scheme: str, probes: list[dict[str, Any]], end: float = 0.3, **tables: Any) -> dict[str, ProbeSeries]:
    return simulate(scene(scheme, probes, end, **tables)).probes


def test_a_call_ends_early_where_sampling_takes_long_and_samples_stay_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    every_step = scene("nonsmooth", [{"kind": "energy", "every": "step"}], 0.02)
    steps: list[int] = []
    usual = simulate(every_step)
    monkeypatch.setattr(loop, "LONGEST_CALL", 0.0, raising=False)
    slow = simulate(every_step, on_progress=lambda progress: steps.append(progress.steps))
    assert set(np.diff(steps)) == {1}
    (one,), (other,) = usual.probes.values(), slow.probes.values()
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, other.columns[name])


@both
def test_base_shear_and_support_force_are_mass_times_acceleration_and_weight(scheme: str) -> None:
    motion = {"kind": "pulse", "shape": "rectangular", "amplitude": 1.5, "duration": 1.0, "start": 0.1}
    found = probed(scheme, PROBES[:2], motion=motion)
    base, upper = found["base"], found["force2"]
    assert (base.time[0], base.time[-1], len(base)) == (0.0, pytest.approx(0.3, abs=1e-4), 31)
    assert len(upper) == 151
    last = -5
    assert base["fx"][last:] == pytest.approx(-2 * WEIGHT * 1.5 / 9.81, rel=2e-3)
    assert base["fy"][last:] == pytest.approx(-2 * WEIGHT, rel=1e-3)
    assert upper["fx"][last:] == pytest.approx(WEIGHT * 1.5 / 9.81, rel=2e-3)
    assert upper["mobilised"][last:] == pytest.approx(1.5 / 9.81 / 0.6, rel=2e-3)
    # the weight and the inertia force meet the base where their moments balance: behind the centre by a/g of its height
    moved = 0.5 * 1.5 * (base.time[last:] - 0.1) ** 2
    assert base["x"][last:] - moved == pytest.approx(0.1 - 0.1 * 1.5 / 9.81, abs=2e-4)
    assert base["y"][last:] == pytest.approx(0.0, abs=1e-3)


@both
def test_a_sliding_block_mobilises_all_friction_and_its_joint_slips(scheme: str) -> None:
    motion = {"kind": "pulse", "shape": "rectangular", "amplitude": 3.0, "duration": 1.0}
    friction = {"block_block": 0.1, "block_ground": 0.9}
    # half off its seat a block leans on its springs, and slides down that slope: 0.5 % of its speed at a stiffness of
    # 0.01, 0.05 % here; and the springs of a shrinking face push along it, by 0.03 % of friction here
    contact = {"stiffness_scale": 0.1} if scheme == "explicit" else {}
    found = probed(scheme, PROBES[1:4], motion=motion, friction=friction, contact=contact)
    assert found["force1"]["mobilised"][-20:] == pytest.approx(1.0, abs=1e-6 if scheme == "nonsmooth" else 5e-4)
    slip = -0.5 * (3.0 - 0.981) * 0.3**2  # of the upper block, towards -x
    assert found["joint3"]["slip"][-1] == pytest.approx(slip, rel=5e-3)
    assert found["point2"]["relative_dx"][-1] == pytest.approx(slip, rel=5e-3)
    assert found["point2"]["dx"][-1] == pytest.approx(0.5 * 0.981 * 0.3**2, rel=5e-3)
    assert found["point2"]["vx"][-1] == pytest.approx(0.981 * 0.3, rel=5e-3)
    assert found["point2"]["relative_vx"][-1] == pytest.approx((0.981 - 3.0) * 0.3, rel=5e-3)
    assert abs(found["joint3"]["opening"][-1]) < 1e-4


@both
def test_a_point_of_a_turning_body_in_flight_follows_the_rigid_motion(scheme: str) -> None:
    at = (0.1, -0.05)
    body = {"block": "brick", "x": 0.0, "y": 2.0, "velocity": [1.0, 0.0], "spin": "3 rad/s", "name": "flying"}
    still = {"block": "brick", "x": 3.0, "y": 0.05, "name": "still"}
    probes = [{"kind": "point", "body": "flying", "at": list(at)}]
    series = probed(scheme, probes, structures=[], bodies=[body, still])["point1"]
    t, turned = series.time, 3.0 * series.time
    cosine, sine = np.cos(turned), np.sin(turned)
    assert series["rotation"] == pytest.approx(turned, abs=1e-9)
    assert series["x"] == pytest.approx(t + at[0] * cosine - at[1] * sine, abs=1e-9)
    assert series["y"] == pytest.approx(2.0 - 4.905 * t**2 + at[0] * sine + at[1] * cosine, abs=1e-3)
    assert series["vx"] == pytest.approx(1.0 - 3.0 * (at[0] * sine + at[1] * cosine), abs=1e-9)
    assert series["dx"] == pytest.approx(series["x"] - at[0], abs=1e-12)


@both
def test_ground_and_walls_have_forces_of_their_own(scheme: str) -> None:
    """A brick rests on the ground and is pressed against the wall at its right hand by the tilt."""
    names = ("ground", "wall 1", "wall 2", "walls", "supports", "1")
    found = probed(
        scheme,
        [{"kind": "force", "on": name, "name": name.replace(" ", "-")} for name in names],
        walls=[{"from": [0.2, 0.0], "to": [0.2, 0.4]}, {"from": [-1.0, 0.4], "to": [-1.0, 0.0]}],
        structures=[{"kind": "stack", "block": "brick", "count": 1}],
        ground={"tilt": "-45 deg"},
        friction={"block_block": 0.0, "block_ground": 0.0},
        end=0.5,
    )
    last = {name: (one["fx"][-1], one["fy"][-1]) for name, one in found.items()}
    pressed = WEIGHT * math.sqrt(0.5)
    assert last["ground"] == pytest.approx((0.0, -pressed), abs=0.02)
    assert last["wall-1"] == last["walls"] == pytest.approx((pressed, 0.0), abs=0.02)
    assert last["wall-2"] == (0.0, 0.0)
    assert last["supports"] == pytest.approx((pressed, -pressed), abs=0.02)
    assert last["1"] == pytest.approx((-pressed, pressed), abs=0.02)
    assert np.isnan(found["wall-2"]["x"]).all()


PULSE = {"kind": "pulse", "shape": "sine", "amplitude": 8.0, "duration": 0.05}


def test_samples_that_are_missing_before_a_checkpoint_are_reported(tmp_path: Path) -> None:
    scenario = scene("nonsmooth", PROBES, 0.05, motion=PULSE)
    interrupted_at(scenario, tmp_path / "parts", [40])
    with h5py.File(tmp_path / "parts" / "run.h5", "r+") as file:
        file["probes/point3/n_committed"][()] = 20
    with pytest.raises(InvalidInputError, match=r"samples of probe point3 are missing before step 40"):
        simulate_into(scenario, tmp_path / "parts", resume=True)


def test_the_tables_of_probes_are_files_of_the_run(tmp_path: Path) -> None:
    whole = simulate_into(scene("nonsmooth", PROBES, 0.02, motion=PULSE), tmp_path)
    table = (tmp_path / "probe-joint4.csv").read_text().splitlines()
    assert table[0] == "step,time_s,opening_mm,opening_first_mm,opening_last_mm,slip_mm,rotation_deg"
    last = [values[-1] for values in whole.probes["joint4"].table_values().values()]
    assert [float(cell) for cell in table[-1].split(",")[2:]] == last
    assert [*whole.probes["force2"].to_frame().columns[:3]] == ["time_s", "fx_N", "fy_N"]
    prepare_folder(tmp_path, overwrite=True)
    assert [*tmp_path.iterdir()] == []


def test_a_file_without_the_probes_is_no_run_of_the_scenario(tmp_path: Path) -> None:
    simulate_into(scene("nonsmooth", [], 0.02), tmp_path / "run")
    with pytest.raises(InvalidInputError, match="probes cannot be read"):
        read_probes(tmp_path / "run" / "run.h5", Model(scene("nonsmooth", PROBES, 0.02)))


@both
def test_samples_show_what_frames_show_at_the_step_of_an_event(scheme: str) -> None:
    push = {"at": "20 ms", "velocity": {"body": "2", "vx": 0.5}}
    rest = {"when": "rest", "velocity": {"body": "2", "vx": 0.25}}
    probes = [{"kind": "point", "body": "2"}, {"kind": "energy"}]
    time = {"scheme": scheme, "end": 0.6, "stop_at_rest": True}
    result = simulate(scene(scheme, probes, events=[push, rest], time=time))
    assert len(result.summary.events) == 2
    point, energy = result.probes["point1"], result.probes["energy2"]
    count = len(point)
    assert result.frames.step[:count].tolist() == point.step.tolist()
    assert point["vx"].tolist() == result.frames.vx[:count, 1].tolist()
    for name, values in result.frames.energy.items():
        assert energy[name].tolist() == values[:count].tolist()
    assert point["vx"].max() == pytest.approx(0.5, abs=0.01)


EVERY_STEP = 1e-9  # s; no step is shorter


def accelerations(result: Result) -> NDArray[np.float64]:
    """Return what contacts and weight make of every block at every frame: along x and y, and of its turning."""
    frames, contacts = result.frames, result.frames.contacts
    assert contacts is not None
    placed = Model(result.scenario).bodies
    inertia = np.array([(body.mass, body.mass, body.inertia) for body in placed])
    total = np.zeros((len(frames), len(placed), 3))
    forces = forces_on_a(contacts.rows)
    for side, sign in (("body_a", 1.0), ("body_b", -1.0)):
        here = contacts.rows[side] != SUPPORT
        frame, body, rows = contacts.frame[here], contacts.rows[side][here], contacts.rows[here]
        fx, fy = sign * forces[here].T
        rx, ry = rows["x"] - frames.x[frame, body], rows["y"] - frames.y[frame, body]
        np.add.at(total, (frame, body), np.stack([fx, fy, rx * fy - ry * fx], axis=-1))
    return np.asarray(total / inertia - [0.0, result.scenario.gravity.magnitude, 0.0])


def all_push(result: Result) -> NDArray[np.bool_]:
    """Return for every step whether all contacts at both of its ends have a normal force."""
    contacts = result.frames.contacts
    assert contacts is not None
    push = np.ones(len(result.frames), dtype=np.bool_)
    push[contacts.frame[contacts.rows["normal_force"] == 0.0]] = False
    return np.asarray(push[1:] & push[:-1])


def changes(result: Result) -> NDArray[np.float64]:
    """Return how velocities and spins change from frame to frame, divided by the time."""
    frames = result.frames
    rates = np.stack([frames.vx, frames.vy, frames.spin], axis=-1)
    return np.asarray(np.diff(rates, axis=0) / np.diff(frames.time)[:, None, None])


@pytest.mark.parametrize(
    ("model", "law", "scale"),
    [
        ("surface", "linear", 1e-5),
        ("particles", "linear", 1e-4),
        ("kernel", "linear", 1e-5),
        ("surface", "hertz-mindlin", 1e-3),
        *(pytest.param(model, "hertz-mindlin", 1e-3, marks=pytest.mark.long) for model in ("particles", "kernel")),
    ],
)
def test_contacts_and_weight_are_all_that_accelerates_blocks(soft: Shipped, model: str, law: str, scale: float) -> None:
    # so soft that blocks lie deep in one another; particles of 1 mm would lose one another
    deep = {"max_overlap": 5e-3, "particle_spacing": 4e-3 if model == "particles" else 1e-3}
    contact = {"model": model, "law": law, "stiffness_scale": scale, **deep}
    values = {f"contact__{key}": value for key, value in contact.items()}
    end = 0.03 if law != "linear" else {"surface": 0.25, "particles": 0.04, "kernel": 0.08}[model]
    scenario = soft("three_blocks_nominal", time__end=end, output__contacts=True, output__every=EVERY_STEP, **values)
    result = simulate(scenario)
    assert result.reason == "end of simulated time"  # the last frame of a run that failed is two steps late
    expected = accelerations(result)
    expected = 0.5 * (expected[1:] + expected[:-1])  # velocity Verlet: half a kick at both ends of a step
    found = changes(result)
    assert np.abs(found).max(axis=(0, 1)).min() > 1.0
    off, size = np.abs(found - expected), np.abs(found).max(axis=(0, 1))
    assert (off[..., :2].max(axis=(0, 1)) <= 1e-9 * size[:2]).all()
    # a couple is recorded as the place of the normal force; a contact whose dashpot has just taken all of it has none
    pushing = all_push(result) if model == "surface" else np.ones(len(off), dtype=np.bool_)
    assert pushing.mean() > 0.8
    assert off[pushing, :, 2].max() <= 1e-9 * size[2]
    assert off[..., 2].max() <= 1e-2 * size[2]


@pytest.mark.parametrize(("name", "scheme"), [("three_blocks_nominal", "explicit"), ("slope", "nonsmooth")])
def test_contacts_of_blocks_at_rest_hold_their_weight_and_are_counted(soft: Shipped, name: str, scheme: str) -> None:
    result = simulate(soft(name, time__scheme=scheme, output__contacts=True))
    contacts, placed, tilt = result.frames.contacts, Model(result.scenario).bodies, result.scenario.ground.tilt
    assert contacts is not None
    assert result.reason == "at rest"
    weight = sum(body.mass for body in placed if not body.fixed) * result.scenario.gravity.magnitude
    fixed = [body.fixed for body in placed]
    held = force_on_supports(contacts, (float(np.sin(tilt)), float(np.cos(tilt))), fixed)
    assert held[-1] == pytest.approx(weight, rel=1e-6)
    np.testing.assert_array_equal(np.diff(contacts.ends, prepend=0), result.frames.contact_count)
    rows = contacts.rows
    assert (rows["normal_force"] >= 0.0).all()
    np.testing.assert_allclose(np.hypot(rows["normal_x"], rows["normal_y"]), 1.0, rtol=1e-9)
    assert {SUPPORT} < set(rows["body_b"].tolist())
