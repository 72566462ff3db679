"""Bodies at time zero, and what pieces of ground and walls do to blocks that meet them."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from blocksim.kernels.common.arrays import REACHED
from blocksim.scenario import place_segments
from blocksim.verification.scene import HEIGHT, Simulation, scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from blocksim.kernels.common.arrays import Record, Records

SOFT = 1e-3  # of the material's stiffness
FRICTION = 0.3
FLAT: dict[str, object] = {"profile": [[-1.0, 0.0], [1.0, 0.0]]}
LYING = {"y": HEIGHT / 2}
THROWN = {"y": 0.03, "angle": 0.3, "velocity": [0.4, -0.5], "spin": 3.0}
MODELS = ["surface", "kernel", "particles"]
LAWS = ["linear", "hertz-mindlin"]


def scene_of(
    bodies: Sequence[Mapping[str, object]],
    *,
    model: str = "surface",
    law: str = "linear",
    restitution: float = 0.2,
    time: Mapping[str, object] | None = None,
    **tables: Any,
) -> Simulation:
    """Start soft blocks that rub alike against everything."""
    contact = {
        "model": model,
        "law": law,
        "restitution": restitution,
        "stiffness_scale": SOFT,
        "particle_spacing": 2e-3,
        "max_overlap": 2e-3,
    }
    tables.setdefault("friction", {"block_block": FRICTION, "block_ground": FRICTION})
    scenario = scenario_of(bodies, contact=contact, time={"stop_at_rest": False, **(time or {})}, **tables)
    return Simulation(build_world(scenario))


def slabs_of(**tables: Any) -> tuple[Records, tuple[Any, ...]]:
    """Return the slabs and the placed pieces that they stand for."""
    scenario = scenario_of([{"y": 10.0}], **tables)
    slabs: Any = build_world(scenario).bodies[1:-1]
    return slabs, place_segments(scenario)


def block_state(scene: Simulation) -> np.ndarray:
    """Return the state of the first block."""
    return np.asarray(scene.state()[0])


def corners(body: Record) -> np.ndarray:
    """Return the corners (4, 2)."""
    local = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * (body.half_x, body.half_y)
    c, s = cos(body.angle), sin(body.angle)
    return np.asarray(local @ np.array([[c, s], [-s, c]]) + (body.x, body.y))


PROFILES = st.lists(st.tuples(st.floats(0.01, 0.3), st.floats(-0.3, 0.3)), min_size=1, max_size=6)


@settings(max_examples=30)
@given(steps=PROFILES)
def test_upper_faces_of_slabs_are_the_line_of_the_profile(steps: list[tuple[float, float]]) -> None:
    points = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    slabs, pieces = slabs_of(ground={"profile": points.tolist()})
    assert len(slabs) == len(pieces)
    for slab, piece in zip(slabs, pieces, strict=True):
        along = np.array([cos(slab.angle), sin(slab.angle)])
        normal = np.array([-along[1], along[0]])
        upper = np.array([slab.x, slab.y]) + normal * slab.half_y
        for end, x, y in ((-1.0, piece.x0, piece.y0), (1.0, piece.x1, piece.y1)):
            reach = end * ((x, y) - upper) @ along
            assert (np.array([x, y]) - upper) @ normal == pytest.approx(0.0, abs=1e-9)
            extends = piece.extends_start if end < 0.0 else piece.extends_end
            beyond = 2.0 * slab.half_y if extends else 0.0
            assert slab.half_x - reach == pytest.approx(beyond, abs=1e-9)
        assert atan2(slab.sin, slab.cos) == pytest.approx(slab.angle, abs=1e-12)
        assert slab.radius == pytest.approx(hypot(slab.half_x, slab.half_y))


def test_slabs_can_be_touched_from_above_only_and_at_their_free_ends() -> None:
    slabs, pieces = slabs_of(ground={"profile": [[0.0, 0.0], [0.1, 0.1], [0.2, 0.0]]})
    assert [piece.touches_end for piece in pieces] == [False, True, False, False]
    assert slabs.faces.tolist() == [2] * 4
    assert slabs.corners.tolist() == [0, 4, 0, 0]
    assert not slabs.inverse_mass.any()
    assert not slabs.mass.any()
    assert (slabs.is_moved == 1).all()


def test_slabs_are_thicker_than_any_overlap_that_is_admitted() -> None:
    for limit in (None, 1e-3, 2e-2):
        contact = {} if limit is None else {"max_overlap": limit}
        slabs, _ = slabs_of(ground=FLAT, contact=contact)
        assert (2.0 * slabs.half_y >= 2.0 * (limit or 0.05 * HEIGHT)).all()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", ["surface", "kernel"])
@pytest.mark.parametrize("profile", [[[-1.0, 0.0], [1.0, 0.0]], [[-1.0, 0.0], [0.01, 0.0], [1.0, 0.0]]])
def test_level_profile_is_the_half_plane(model: str, law: str, profile: list[list[float]]) -> None:
    usual = scene_of([THROWN], model=model, law=law)
    pieces = scene_of([THROWN], model=model, law=law, ground={"profile": profile})
    for time in (0.02, 0.05, 0.1):
        assert block_state(pieces.to_time(time)) == pytest.approx(block_state(usual.to_time(time)), abs=1e-11)
    assert abs(usual.bodies[0].angle) < 0.1  # it has fallen flat, or nearly so


def turned(vector: Sequence[float], angle: float) -> list[float]:
    """Return a vector turned by an angle (rad)."""
    x, y = vector
    return [x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)]


SLIDING = {**LYING, "velocity": [0.4, 0.0]}


@pytest.mark.parametrize(("body", "restitution"), [(THROWN, 1.0), (SLIDING, 0.2)])
@pytest.mark.parametrize("model", ["surface", "kernel"])
@pytest.mark.parametrize("tilt", [0.3, -0.5])
def test_sloping_piece_is_tilted_gravity(model: str, tilt: float, body: Mapping[str, Any], restitution: float) -> None:
    level = scene_of([body], model=model, restitution=restitution, ground={"tilt": f"{tilt} rad"})
    place, velocity = turned((0.0, body["y"]), tilt), turned(body["velocity"], tilt)
    start = {**body, "x": place[0], "y": place[1], "velocity": velocity, "angle": body.get("angle", 0.0) + tilt}
    profile = [turned((-2.0, 0.0), tilt), turned((2.0, 0.0), tilt)]
    slope = scene_of([start], model=model, restitution=restitution, ground={"profile": profile})
    for time in (0.02, 0.05, 0.1):
        x, y, angle, vx, vy, spin = block_state(slope.to_time(time))
        seen = [*turned((x, y), -tilt), angle - tilt, *turned((vx, vy), -tilt), spin]
        assert seen == pytest.approx(block_state(level.to_time(time)), abs=1e-9)


def edge_at(drop: float) -> dict[str, object]:
    """Return level ground that falls by `drop` (m) a metre from x = 0 on."""
    return {"profile": [[-1.0, 0.0], [0.0, 0.0], [1.0, -drop]]}


@pytest.mark.parametrize(
    ("model", "drop"),
    [("surface", 0.0), ("surface", 0.02), ("surface", 0.5), ("kernel", 0.02), ("particles", 0.02)],
)
def test_block_sliding_over_an_edge_gets_no_kick(model: str, drop: float) -> None:
    scene = scene_of([{**LYING, "x": -0.01, "velocity": [1.0, 0.0]}], model=model, ground=edge_at(drop))
    while scene.bodies[0].x < -1e-4:
        scene.to_step(scene.steps + 1)
        block = scene.bodies[0]
        assert block.vx == pytest.approx(1.0 - FRICTION * 9.81 * scene.time, abs=2e-3)
        assert abs(block.vy) < 5e-3  # springs that carry the weight unload, no more
    assert scene.residual() < 1e-3


@pytest.mark.parametrize("model", ["surface", "kernel"])
def test_block_landing_on_a_peak_is_held_by_its_point(model: str) -> None:
    peak = {"profile": [[-1.0, -1.0], [0.0, 0.0], [1.0, -1.0]]}
    scene = scene_of([{"x": 5e-4, "y": HEIGHT / 2 + 1e-3}], model=model, restitution=0.0, ground=peak)
    scene.to_time(0.03)
    assert scene.bodies[0].y == pytest.approx(HEIGHT / 2, abs=2e-4)
    assert abs(scene.bodies[0].vy) < 1e-3
    assert scene.contacts > 0
    force = float(scene.contact_records.normal_force.sum())
    assert force == pytest.approx(float(scene.bodies[0].mass) * 9.81, rel=0.02)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(3))
def test_nothing_falls_through_a_valley(model: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    thrown = {
        "y": 0.06,
        "x": random.uniform(-0.02, 0.02),
        "angle": random.uniform(-pi, pi),
        "velocity": [random.uniform(-1.0, 1.0), -1.0],
        "spin": random.uniform(-20.0, 20.0),
    }
    scene = scene_of([thrown], model=model, ground={"profile": [[-0.2, 0.2], [0.0, 0.0], [0.2, 0.2]]})
    while scene.time < 0.2:
        scene.to_time(scene.time + 0.002)
        assert scene.status == REACHED
        heights = corners(scene.bodies[0])
        assert (heights[:, 1] - np.abs(heights[:, 0])).min() > -2e-3
    assert scene.contacts > 0


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("slope", [pi / 2, 1.0])
def test_wall_sends_a_block_back_with_the_restitution_asked(model: str, e: float, slope: float) -> None:
    """A block comes flat against a wall, smooth so that it does not turn."""
    out = np.array([-sin(slope), cos(slope)])  # of the wall, towards the block
    foot, top = np.array([0.5, 0.5]), np.array([0.5, 0.5]) + 0.2 * np.array([cos(slope), sin(slope)])
    middle = 0.5 * (foot + top) + (HEIGHT / 2 + 1e-4) * out
    body = {"x": middle[0], "y": middle[1], "angle": slope, "velocity": (-0.7 * out).tolist()}
    wall = {"from": foot.tolist(), "to": top.tolist()}
    scene = scene_of([body], model=model, restitution=e, walls=[wall], gravity=0.0, friction={"block_ground": 0.0})
    scene.to_time(0.01)
    assert scene.contacts == 0
    vx, vy = scene.bodies[0].vx, scene.bodies[0].vy
    assert out @ (vx, vy) == pytest.approx(0.7 * e, abs=0.007)
    assert scene.bodies[0].spin == pytest.approx(0.0, abs=0.05)
