"""Worlds at time zero: pieces of ground and walls, particles of boundaries, corners, and what a run is built with."""

import itertools
import math
from collections.abc import Mapping, Sequence
from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from blocksim.kernels.common.arrays import (
    BODY as BODY_RECORD,
    GROUP,
    REACHED,
    Record,
    Records,
    zeros,
)
from blocksim.kernels.common.tolerances import CONE_TOLERANCE
from blocksim.scenario import Model, Scenario, place_segments, scenario_from_mapping
from blocksim.scenario.geometry import centre_outline, regular
from blocksim.verification.scene import HEIGHT, SteppedScene, scenario_of
from blocksim.world import memory
from blocksim.world.bodies import cone_of, corner_rows, division
from blocksim.world.build import (
    MOST_LARGE,
    SceneStack,
    build_stacks,
    build_world,
    cell_radius,
    member,
    with_more_room,
)
from blocksim.world.memory import SceneTooLargeError
from blocksim.world.nonsmooth import NONSMOOTH, build_nonsmooth
from tests.golden import Golden

SOFT = 1e-3  # of the material's stiffness
FRICTION = 0.3
LYING = {"y": HEIGHT / 2}
THROWN = {"y": 0.03, "angle": 0.3, "velocity": [0.4, -0.5], "spin": 3.0}
MODELS = ["surface", "kernel", "particles"]


def scene_of(
    bodies: Sequence[Mapping[str, object]],
    *,
    model: str = "surface",
    law: str = "linear",
    restitution: float = 0.2,
    time: Mapping[str, object] | None = None,
    **tables: Any,
) -> SteppedScene:
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
    return SteppedScene(build_world(Model(scenario)))


def slabs_of(**tables: Any) -> tuple[Records, tuple[Any, ...]]:
    scenario = scenario_of([{"y": 10.0}], **tables)
    slabs: Any = build_world(Model(scenario)).bodies[1:-1]
    return slabs, place_segments(scenario)


def block_state(scene: SteppedScene) -> np.ndarray:
    return np.asarray(scene.state()[0])


def corners(body: Record) -> np.ndarray:
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


def turned(vector: Sequence[float], angle: float) -> list[float]:
    x, y = vector
    return [x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)]


SLIDING = {**LYING, "velocity": [0.4, 0.0]}


@pytest.mark.parametrize(("tilt", "body", "restitution"), [(0.3, THROWN, 1.0), (-0.5, SLIDING, 0.2)])
@pytest.mark.parametrize("model", ["surface", "kernel"])
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


@pytest.mark.parametrize(("model", "drop"), [("surface", 0.02), ("surface", 0.5), ("particles", 0.02)])
def test_block_sliding_over_an_edge_gets_no_kick(model: str, drop: float) -> None:
    edge = {"profile": [[-1.0, 0.0], [0.0, 0.0], [1.0, -drop]]}
    scene = scene_of([{**LYING, "x": -0.01, "velocity": [1.0, 0.0]}], model=model, ground=edge)
    while scene.bodies[0].x < -1e-4:
        scene.to_step(scene.steps + 1)
        block = scene.bodies[0]
        assert block.vx == pytest.approx(1.0 - FRICTION * 9.81 * scene.time, abs=2e-3)
        assert abs(block.vy) < 5e-3  # springs that carry the weight unload, no more
    assert scene.residual() < 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_nothing_falls_through_a_valley(model: str) -> None:
    random = np.random.default_rng(1)
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
        assert scene.code == REACHED
        heights = corners(scene.bodies[0])
        assert (heights[:, 1] - np.abs(heights[:, 0])).min() > -2e-3
    assert scene.contact_count > 0


WITH_PARTICLES = ["kernel", "particles"]


def dense(bodies: Sequence[Mapping[str, object]], model: str, spacing: float, **tables: Any) -> Scenario:
    return scenario_of(bodies, contact={"model": model, "particle_spacing": spacing}, **tables)


def test_round_off_in_the_division_adds_no_particle() -> None:
    assert division(0.3, 0.1) == 3  # 0.3/0.1 is just below 3, 0.1 * 3 just above 0.3
    assert [division(side, 1e-3) for side in (0.032, 0.025)] == [32, 25]


TRIANGLE = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.3]]


def blocks_of(*, ground: dict[str, object] | None = None, **blocks: dict[str, object]) -> Scenario:
    """Return blocks high up and apart; a triangle, a brick and a hexagon, two of each, unless told."""
    tables = blocks or {
        "triangle": {"outline": TRIANGLE, "depth": 0.1},
        "brick": {"width": 0.2, "height": 0.1, "length": 0.1},
        "hexagon": {"sides": 6, "radius": 0.2, "depth": 0.1},
    }
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "shapes",
            "materials": {"stone": {"density": 2000.0, "young_modulus": 1e9, "poisson_ratio": 0.2}},
            "blocks": {name: {**table, "material": "stone"} for name, table in tables.items()},
            "bodies": [{"block": name, "x": float(i), "y": 2.0} for i, name in enumerate([*tables, *tables])],
            "time": {"scheme": "nonsmooth", "end": 1.0},
            **({} if ground is None else {"ground": ground}),
        }
    )


@pytest.mark.parametrize("outline", [TRIANGLE, regular(16, 0.1), [[0, 0], [1, 0], [1.01, 0.02], [0.5, 0.3], [0, 0.1]]])
def test_other_faces_are_as_far_as_is_told_along_a_face(outline: list[list[float]]) -> None:
    rows = np.array(corner_rows(centre_outline([(x, y) for x, y in outline])))
    for k, (x, y, nx, ny, distance, half, middle, clear, far, *_) in enumerate(rows):
        assert nx * y - ny * x == pytest.approx(middle - half)
        others = np.delete(rows, k, axis=0)
        for end, depth in itertools.product(np.linspace(0.0, 1.0, 9) * half, (0.0, 0.01 * half)):
            for along in (middle - half + end, middle + half - end):
                place = (distance - depth) * np.array([nx, ny]) + along * np.array([-ny, nx])
                least = (others[:, 4] - others[:, 2:4] @ place).min()
                assert least >= clear * end - depth - 1e-12
                beyond = np.delete(rows, [k, k - 1, (k + 1) % len(rows)], axis=0)
                assert np.all(beyond[:, 4] - beyond[:, 2:4] @ place >= far - depth - 1e-12)
        assert clear > 0.0


def test_members_of_a_stack_have_corners_of_their_own() -> None:
    """Of one shape where they have equally many corners; rectangles are in a stack without any."""
    wedges = [blocks_of(wedge={"outline": [[0.0, 0.0], [0.4, 0.0], [0.1, h]], "depth": 0.1}) for h in (0.2, 0.3)]
    hexagon = blocks_of(hexagon={"sides": 6, "radius": 0.2, "depth": 0.1})
    brick = blocks_of(brick={"width": 0.2, "height": 0.1, "length": 0.1})
    stacks = [
        one for one in build_stacks([*map(Model, (*wedges, hexagon, brick))], NONSMOOTH) if isinstance(one, SceneStack)
    ]
    assert [stack.numbers for stack in stacks] == [[0, 1], [2], [3]]
    assert stacks[-1].scenes.world.corners is None
    for m, wedge in enumerate(wedges):
        alone = build_nonsmooth(Model(wedge)).world.corners
        assert member(stacks[0].scenes, m).world.corners.tobytes() == alone.tobytes()


def test_faces_of_blunt_and_sharp_shapes_are_parallel_within_less_than_those_of_rectangles() -> None:
    def even(sides: int) -> tuple[tuple[float, float], ...]:
        return tuple((math.cos(2.0 * math.pi * k / sides), math.sin(2.0 * math.pi * k / sides)) for k in range(sides))

    assert cone_of(even(4)) == cone_of(even(6)) == CONE_TOLERANCE
    assert cone_of(even(16)) == pytest.approx(math.sin(math.pi / 16))
    assert cone_of(((0.0, 0.0), (1.0, -0.05), (1.0, 0.05))) == pytest.approx(math.sin(math.atan(0.05)))


HIGH, HILL = [{"y": 10.0}], {"profile": [[0.0, 0.0], [0.1, 0.1], [0.2, 0.0]]}
DROP: dict[str, object] = {"profile": [[-1.0, 0.5], [0.0, 0.0], [3.0, 0.0]]}
BRICKS = [{"x": 0.1 * i, "y": 0.2} for i in range(1, 10)]
PLANK = {"x": 0.0, "y": 1.0, "width": 3.2}
SHAKING = {"kind": "harmonic", "amplitude": 0.01, "frequency": 5.0, "direction": "30 deg"}
MOVED = [{"y": 0.5, "fixed": True}, {"x": 0.2, "y": 0.5}, {"x": 0.4, "y": 0.7, "fixed": True}]
LIKE = [{"y": 0.5}, {"y": 0.5, "x": 0.2, "width": 0.064}, {"y": 0.5, "x": 0.4, "width": 0.064}]
SCENES = {
    "a hill": scenario_of(HIGH, ground=HILL),
    "a hill, overlaps of 20 mm": scenario_of(HIGH, ground=HILL, contact={"max_overlap": 2e-2}),
    "a wall, solid at its right": scenario_of(HIGH, walls=[{"from": [1.0, 1.0], "to": [1.0, 0.0]}]),
    "bricks and a plank": scenario_of([*BRICKS[:4], PLANK, *BRICKS[4:]]),
    "fixed blocks on a shaken support": scenario_of(MOVED, motion=SHAKING, time={"end": 2.0}),
    **{f"{model}, blocks on a hill": dense(LIKE, model, 8e-3, ground=HILL) for model in WITH_PARTICLES},
    "polygons": blocks_of(ground=DROP),
}
PLACE = ["x", "y", "half_x", "half_y", "radius", "inner_radius", "mass", "inertia", "contact_class", "is_moved"]
SHOWN = [*PLACE, "faces", "corners", "first_corner", "corner_count", "first_particle", "particle_count"]
LISTS = {
    "corners": ("x", "y", "nx", "ny", "distance", "half"),
    "particles": ("x", "y", "nx", "ny", "length", "share"),
    "moved": ("body", "x", "y"),
}


def printed(rows: Records | None, names: Sequence[str]) -> list[str]:
    """Return a line for each record, of which the first names all numbers."""
    if rows is None or not rows.size:
        return []
    texts = [", ".join(f"{round(float(row[name]), 12) + 0.0:.9g}" for name in names) for row in rows]
    return [", ".join(names), *texts]


def test_scenes_are_the_arrays_that_were_read(golden: Golden) -> None:
    texts = []
    for name, scenario in SCENES.items():
        is_rigid = scenario.time.has_rigid_contacts
        world = build_nonsmooth(Model(scenario)).world if is_rigid else build_world(Model(scenario))
        slots = [world.candidates.shape[1], world.contacts.shape[1], world.points.size] if world.contacts.size else []
        controls = world.controls[0]
        grid = f"{controls.cell_radius:.9g} m, cells of {controls.cell_width:.9g} m, large {world.large.tolist()}"
        lists = [line for key, names in LISTS.items() for line in printed(getattr(world, key), names)]
        texts.append("\n".join([name, f"grid {grid}, slots of a pair {slots}", *printed(world.bodies, SHOWN), *lists]))
    golden("\n\n".join(texts))


BODY = {"x": 0.1, "y": 0.2}


def scenario(body: Mapping[str, object] | None = None, *more: Mapping[str, object], **tables: Any) -> Scenario:
    return scenario_of([{**BODY, **(body or {})}, *more], **tables)


def test_rest_is_looked_for_only_where_it_may_stop_the_run() -> None:
    assert build_world(Model(scenario(time={"stop_at_rest": False}))).controls[0].rest_checks == 0
    controls = build_world(Model(scenario(time={"rest_hold": 0.02}))).controls[0]
    held = controls.rest_checks * controls.check_every * controls.step
    assert 0.02 <= held < 0.0203
    assert build_world(Model(scenario(time={"rest_hold": 0.0}))).controls[0].rest_checks == 1


@pytest.mark.parametrize("more", [0, GROUP - 2, GROUP - 1, 3 * GROUP])
def test_every_group_of_bodies_has_a_tally_of_its_own(more: int) -> None:
    world = build_world(Model(scenario(None, *({**BODY, "x": 0.1 * i} for i in range(2, 2 + more)))))
    assert world.ledger.size > (world.bodies.size - 1) // GROUP


def test_more_room_than_there_is_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    world = build_world(Model(scenario()))
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    with pytest.raises(SceneTooLargeError):
        with_more_room(world)


def radii(*values: float) -> Records:
    """Return bodies of these half diagonals, and a half-plane."""
    bodies = zeros(len(values) + 1, BODY_RECORD)
    bodies.radius[:-1] = values
    return bodies


def test_few_bodies_that_are_much_larger_stay_out_of_the_grid() -> None:
    assert cell_radius(radii(*[1.0] * 8, 50.0)) == 1.0
    assert cell_radius(radii(*[1.0] * 7, 50.0, 60.0)) == 50.0  # more than one in eight are not few
    assert cell_radius(radii(*[1.0] * 2000, *[50.0] * MOST_LARGE)) == 1.0
    assert cell_radius(radii(*[1.0] * 2000, *[50.0] * (MOST_LARGE + 1))) == 50.0
