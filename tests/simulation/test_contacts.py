"""Recorded contacts explain the motion to the last digit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.scenario import place_bodies
from blocksim.simulation import Result, simulate
from blocksim.simulation.trajectory import SUPPORT, force_on_supports, forces_on_a
from tests.simulation.conftest import Shipped

EVERY_STEP = 1e-9  # s; no step is shorter


def accelerations(result: Result) -> NDArray[np.float64]:
    """Return what contacts and weight make of every block at every frame: along x and y, and of its turning."""
    frames, contacts = result.frames, result.frames.contacts
    assert contacts is not None
    placed = place_bodies(result.scenario)
    inertia = np.array([(body.mass, body.mass, body.inertia) for body in placed])
    total = np.zeros((len(frames), len(placed), 3))
    forces = forces_on_a(contacts.rows)
    for side, sign in (("body_a", 1.0), ("body_b", -1.0)):
        here = contacts.rows[side] != SUPPORT
        frame, body, rows = contacts.frame[here], contacts.rows[side][here], contacts.rows[here]
        fx, fy = sign * forces[here].T
        rx, ry = rows["x"] - frames.x[frame, body], rows["y"] - frames.y[frame, body]
        np.add.at(total, (frame, body), np.stack([fx, fy, rx * fy - ry * fx], axis=-1))
    return np.asarray(total / inertia - [0.0, result.scenario.gravity, 0.0])


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
    end = 0.03 if law != "linear" else 0.1 if model == "particles" else 0.25
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


@pytest.mark.parametrize("restitution", [0.2, 1.0])  # with 1.0 impacts follow one another within a substep
def test_impulses_and_weight_are_all_that_accelerates_blocks_without_springs(
    soft: Shipped, restitution: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "blocksim.world.nonsmooth.is_cut_at_impacts", lambda *_: False
    )  # no step is cut: a frame has the impulses of the last part
    values = {"time__end": 0.5, "time__substeps": 1, "output__contacts": True, "output__every": EVERY_STEP}
    result = simulate(soft("three_blocks_nonsmooth", contact__restitution=restitution, **values))
    found, expected = changes(result), accelerations(result)[1:]
    # velocities live half a step before positions; blocks in flight are shown half a kick later
    half_kick = 0.5 * result.scenario.gravity
    off = np.abs(found - expected)
    assert off[..., 1].max() <= half_kick * (1.0 + 1e-6)
    assert off[..., 0].max() <= 1e-9 * np.abs(found[..., 0]).max()
    assert off[..., 2].max() <= 1e-3 * np.abs(found[..., 2]).max()  # arms are those of the middle of the step
    assert (off[..., 1] > 1e-6).any(axis=1).mean() < 0.1


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
@pytest.mark.parametrize("name", ["three_blocks_nominal", "slope"])
def test_contacts_of_blocks_at_rest_hold_their_weight_are_counted_and_keep_within_the_cone(
    soft: Shipped, name: str, scheme: str
) -> None:
    result = simulate(soft(name, time__scheme=scheme, output__contacts=True))
    contacts, placed, tilt = result.frames.contacts, place_bodies(result.scenario), result.scenario.ground.tilt
    assert contacts is not None
    assert result.reason == "at rest"
    weight = sum(body.mass for body in placed if not body.fixed) * result.scenario.gravity
    fixed = [body.fixed for body in placed]
    held = force_on_supports(contacts, (float(np.sin(tilt)), float(np.cos(tilt))), fixed)
    assert held[-1] == pytest.approx(weight, rel=1e-6)
    np.testing.assert_array_equal(np.diff(contacts.ends, prepend=0), result.frames.contact_count)
    rows = contacts.rows
    assert (rows["normal_force"] >= 0.0).all()
    np.testing.assert_allclose(np.hypot(rows["normal_x"], rows["normal_y"]), 1.0, rtol=1e-9)
    if name == "three_blocks_nominal":
        # N: springs of 950 kN/m push along a face of 32 mm or more that slip shrinks, see kernels/explicit/bearing.py
        push = 0.5 * 9.5e5 * rows["overlap"] ** 2 / 0.032 if scheme == "explicit" else 0.0
        assert (np.abs(rows["shear_force"]) <= 0.38 * rows["normal_force"] * (1.0 + 1e-9) + push).all()
        assert {SUPPORT} < set(rows["body_b"].tolist())
        assert contacts.at(len(contacts) - 1)["y"].min() == pytest.approx(0.0, abs=1e-5)
