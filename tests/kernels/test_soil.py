"""Soil: the path of a particle, its touches, lists, gradients and forces, and the rows of a geostatic start."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import TEAM_SIZE, Floats, Integers, zeros
from blocksim.kernels.common.jit import config, entry_kernel
from blocksim.kernels.common.simd import fields_0, split
from blocksim.kernels.common.tolerances import DECAY
from blocksim.kernels.soil import contact
from blocksim.kernels.soil.arrays import CLUSTER, GROUP, NEIGHBOURS, STATE, Soils
from blocksim.kernels.soil.contact import from_body, is_near
from blocksim.kernels.soil.neighbours import places_of
from blocksim.kernels.soil.step import correction, forces_on, raw_gradient, renew_lists, stress_group
from blocksim.kernels.soil.stress import ROWS, invariants, share_of_row, strain
from blocksim.kernels.sph.functions import wendland_slope
from blocksim.scenario import Model, geometry
from blocksim.simulation.schemes import build
from blocksim.world.systems.soil_arrays import build_soils
from blocksim.world.systems.soils import SMOOTHING
from tests.soils import BLOCKS, FAR, LEFT, SMOOTH_WALLS, Soil, column, right, scene

STEP = 1e-5  # s


def kind_of(material: str = "rods") -> Any:
    scenario = scene(column(0.04, 0.04, 0.005, material=material))
    return build_soils(Model(scenario)).kinds[0]


def state_under(pressure: float) -> Any:
    state = zeros(1, STATE)[0]
    state.sxx = state.syy = state.szz = -pressure
    return state


def deviator_of(state: Any) -> tuple[float, float]:
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    return total, deviator


def test_soil_without_cohesion_takes_no_tension_and_clay_only_up_to_the_apex() -> None:
    for material in ("rods", "clay"):
        kind, state = kind_of(material), state_under(0.0)
        for _ in range(2000):
            strain(state, kind, 1.0, 0.0, 0.0, 1.0, STEP)
        total, deviator = deviator_of(state)
        assert total == pytest.approx(kind.cohesion / kind.slope, abs=1e-9)
        assert deviator == pytest.approx(0.0, abs=1e-9)


def test_opened_soil_closes_with_little_pressure_and_is_as_dense_as_before() -> None:
    kind, state = kind_of(), state_under(0.0)
    for rate in (1.0, -1.0):
        for _ in range(200):
            lost = strain(state, kind, rate, 0.0, 0.0, rate, STEP)
            assert lost >= 0.0
    closed, _ = deviator_of(state)
    assert 0.0 < -closed / 3.0 < 0.05 * kind.bulk * 0.004  # a strain of 0.004 away and back
    assert state.opening < 0.05 * 0.004
    for _ in range(50):
        strain(state, kind, -1.0, 0.0, 0.0, -1.0, STEP)
    assert state.opening == 0.0
    before, _ = deviator_of(state)
    strain(state, kind, -1.0, 0.0, 0.0, -1.0, STEP)
    after, _ = deviator_of(state)
    assert (before - after) / 3.0 == pytest.approx(kind.bulk * 2.0 * STEP, rel=1e-6)  # stiff again


SPACING = 0.005


@pytest.fixture
def soils() -> Soils:
    """Return two soils of 54 and 63 particles in disorder, with velocities and stresses at random, and their lists."""
    clay = {**column(0.045, 0.03, SPACING, material="clay"), "name": "upper", "y": [0.03, 0.065]}
    built: Any = build(Model(scene(column(0.045, 0.03, SPACING), clay)))
    found: Soils = built.systems[0]
    built.world.team[TEAM_SIZE] = 1
    random = np.random.default_rng(5)
    for name, size in (("x", 1e-3), ("y", 1e-3), ("vx", 1.0), ("vy", 1.0)):
        found.points[name] += size * random.uniform(-1.0, 1.0, found.points.size)
    for name in ("sxx", "syy", "szz", "sxy"):
        found.states[name] = -1e3 * random.uniform(0.9, 1.0, found.points.size)
    found.states["sxy"] *= 0.1
    found.points.y[7] += 0.5  # one that is alone
    renew_lists(found, built.world, 0)
    return found


def distances(soils: Soils) -> Any:
    x, y = soils.points["x"], soils.points["y"]
    return np.hypot(x[:, None] - x, y[:, None] - y)


def lists_of(soils: Soils) -> list[Any]:
    """Return the list of every cluster."""
    found = []
    for c in range(-(-soils.points.size // CLUSTER)):
        g = CLUSTER * c // GROUP
        begin = int(soils.lengths[GROUP // CLUSTER * g : c].sum())
        found.append(soils.lists[g, begin : begin + int(soils.lengths[c])])
    return found


def test_lists_hold_all_that_are_near_to_any_particle_of_a_cluster_and_each_once(soils: Soils) -> None:
    assert soils.points.size % CLUSTER != 0  # the last cluster is not full
    near = distances(soils) < soils.controls.reach[0] + soils.controls.skin[0]
    for c, listed in enumerate(lists_of(soils)):
        wanted = near[CLUSTER * c : CLUSTER * (c + 1)].any(axis=0)
        assert sorted(listed.tolist()) == np.flatnonzero(wanted).tolist()


def test_a_list_without_room_is_noticed(soils: Soils) -> None:
    soils.points["x"], soils.points["y"] = 0.0, np.linspace(0.0, SPACING, soils.points.size)
    built: Any = build(Model(scene(column(0.04, 0.03, SPACING))))
    built.world.team[TEAM_SIZE] = 1
    renew_lists(soils, built.world, 0)
    assert soils.points.size > CLUSTER * NEIGHBOURS
    assert soils.controls.is_full[0] == 1


@entry_kernel
def write_gradients(soils: Soils, c: int, near: Integers, found: Floats) -> None:
    """Write the gradients, the corrections and the forces of the particles of a cluster."""
    places = places_of(soils, c)
    x, y, vx, vy = fields_0(None, soils.points, places)
    gradient = raw_gradient(soils.controls[0], soils.points, near, x, y, vx, vy, 0.0)
    by = correction(soils.controls[0], soils.points, near, x, y, vx, vy, 0.0)
    forces = forces_on(soils, near, places)
    for lane in range(CLUSTER):
        i = places[lane]
        for k in range(4):
            found[i, k] = split(gradient[k])[lane]
            found[i, 7 + k] = split(forces[k])[lane]
        for k in range(3):
            found[i, 4 + k] = split(by[k])[lane]


def fields(soils: Soils) -> Any:
    """Return velocity gradients (n, 2, 2), corrections (n, 2, 2) and forces (n, 4) of all particles."""
    n = soils.points.size
    found = np.empty((n, 11))
    for c, near in enumerate(lists_of(soils)):
        write_gradients(soils, c, near, found)
    corrected = soils.kinds["is_corrected"][soils.states["kind"]] == 1
    xx, xy, yy = np.where(corrected[:, None], found[:, 4:7], [1.0, 0.0, 1.0]).T
    by = np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)
    return found[:, :4].reshape(n, 2, 2), by, soils.kinds["volume"][soils.states["kind"]][:, None] * found[:, 7:]


def test_a_corrected_gradient_is_exact_for_linear_fields_at_surfaces_too(soils: Soils) -> None:
    soils.points["vx"] = 3.0 * soils.points["x"] - 2.0 * soils.points["y"]
    soils.points["vy"] = 0.5 * soils.points["x"] + 4.0 * soils.points["y"]
    raw, by, _ = fields(soils)
    upper = (soils.kinds["is_corrected"][soils.states["kind"]] == 1) & (soils.points["y"] < 0.5)
    found = (raw @ by)[upper]
    np.testing.assert_allclose(found, np.broadcast_to([[3.0, -2.0], [0.5, 4.0]], found.shape), rtol=1e-9)


def test_forces_are_the_adjoint_of_the_gradient_and_give_no_momentum(soils: Soils) -> None:
    for g in range(soils.tallies.size):
        stress_group(soils, g, 0.0)  # no strain; what neighbours feel is made
    raw, by, found = fields(soils)
    state = soils.states
    stress = np.stack([np.stack([state["sxx"], state["sxy"]], 1), np.stack([state["sxy"], state["syy"]], 1)], 1)
    velocity = np.stack([soils.points["vx"], soils.points["vy"]], 1)
    volume = soils.kinds["volume"][state["kind"]]
    power = np.einsum("n,nab,nab->", volume, stress, raw @ by)
    assert np.sum(found[:, :2] * velocity) == pytest.approx(-power, rel=1e-12)
    for forces in (found[:, :2], found[:, 2:]):
        assert np.abs(forces.sum(axis=0)).max() < 1e-13 * np.abs(forces).sum()
    assert np.sum(found[:, 2:] * velocity) < 0.0  # viscosity takes energy


def weight_of_row(k: int) -> float:
    """Return half of sum V f d (x) d across a face, of the particles of a row k spacings away."""
    total = 0.0
    for along in range(-4, 5):
        away = math.hypot(k, along)
        total -= wendland_slope(away, SMOOTHING) / away * k * k
    return total


def test_the_decay_from_row_to_row_is_that_of_the_kernel_on_its_lattice() -> None:
    one, two, three = (weight_of_row(k) for k in (1, 2, 3))
    assert three == 0.0
    assert pytest.approx(2.0 * one / two, rel=1e-5) == DECAY + 1.0 / DECAY
    stress = np.array([share_of_row(float(row)) for row in range(1, 12)])
    assert stress[ROWS:] == pytest.approx(1.0)
    for i in range(2, 9):  # rows without contact, of which the first miss a neighbour
        lower = two / 2.0 * stress[i - 2] + one * stress[i - 1]
        assert one * stress[i + 1] + two / 2.0 * stress[i + 2] == pytest.approx(lower, rel=5e-4)
    assert one * stress[2] + two / 2.0 * (stress[3] + stress[1]) == pytest.approx(one * stress[0], rel=5e-4)


SMOOTH_GROUND = {"rods": {**SMOOTH_WALLS["rods"], "ground": {"friction": 0.0}}}


@pytest.mark.parametrize("wall", [None, 0.05])
def test_soil_at_rest_starts_with_all_forces_in_equilibrium(wall: float | None) -> None:
    blocks: dict[str, Any] = {**BLOCKS, "wall": {"width": 0.05, "height": 0.05, "length": 0.05, "material": "smooth"}}
    pile = [{"block": "wall", "x": 0.075, "y": 0.025 + 0.05 * k, "fixed": True} for k in (0, 1)]
    held = scene(
        column(0.05, 0.1, SPACING, gradient="raw"),
        blocks=blocks,
        bodies=[FAR] if wall else [*pile, FAR],
        walls=[LEFT, right(wall)] if wall else [LEFT],
        pairs=SMOOTH_GROUND,
    )
    soil = Soil(held)
    points, states, pull = soil.soils.points, soil.soils.states, 9.81 * float(soil.soils.kinds["mass"][0])
    off = np.hypot(states["fx"], states["fy"] - pull) / pull
    is_corner = (np.abs(points["x"] - 0.025) > 0.025 - 2.0 * SPACING) & (points["y"] < 2.0 * SPACING)
    assert is_corner.sum() == 2 * 4
    assert off[~is_corner].max() < 0.3  # 2.9 without
    assert off[is_corner].max() < 1.5


def test_corrected_gradients_start_in_equilibrium_across_all_faces_and_within_the_yield_surface() -> None:
    width = 0.06
    table = column(width, 0.1, SPACING, gradient="corrected")
    soils = Soil(scene(table, walls=[LEFT, right(width)], pairs=SMOOTH_GROUND)).soils
    points, states, kind, pull = soils.points, soils.states, soils.kinds[0], 9.81 * float(soils.kinds["mass"][0])
    side = 0.5 * width - np.abs(points["x"] - 0.5 * width)
    is_low, is_at_wall = points["y"] < 3.0 * SPACING, side < 3.0 * SPACING
    is_high = points["y"] > 0.1 - 4.0 * SPACING  # no face: up to a quarter of the weight
    fx, fy = np.abs(states["fx"]) / pull, np.abs(states["fy"] - pull) / pull
    assert fx[~is_low].max() < 0.05  # 9 with the stress inside
    assert fy[~is_at_wall & ~is_high].max() < 0.1  # 17
    assert fy[is_at_wall & ~is_low & ~is_high].max() < 0.3  # what the yield surface leaves to the others
    normal = np.array([states["sxx"], states["syy"], states["szz"]])
    total = normal.sum(axis=0)
    deviator = np.sqrt(0.5 * ((normal - total / 3.0) ** 2).sum(axis=0) + states["sxy"] ** 2)
    assert (deviator + kind["slope"] * total).max() < 1e-9 * np.abs(normal).max()
    assert states["plastic"].max() < 1e-12


RADIUS = 0.0025
INTERPRETED = pytest.mark.skipif(not config.DISABLE_JIT, reason="calls kernels with whole worlds, or without records")


def world_of(**changes: Any) -> Any:
    return build(Model(scene(column(0.04, 0.04, 0.005), **changes))).world


@INTERPRETED
@pytest.mark.parametrize("angles", [(), (0, 170, 190), (0, 100, 200, 280), (0, 40, 90, 150, 210, 280)])
def test_distance_from_a_block_is_that_from_the_nearest_place_on_its_outline(angles: tuple[int, ...]) -> None:
    """A rectangle that is given by its sides, and a triangle with a tip of 10 degrees are among them."""
    turns = np.radians(angles or (45, 135, 225, 315))
    outline = 0.04 * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    size = 0.04 * math.sqrt(2.0)
    shape = {"outline": outline.tolist(), "depth": 0.05} if angles else {"width": size, "height": size, "length": 0.05}
    world = world_of(
        blocks={"far": {**shape, "material": "soft"}},
        soils=[column(0.04, 0.04, 0.0005)],
        bodies=[{"block": "far", "x": -1, "y": 1}],
    )
    block, corners = world.bodies[0], outline - np.array(geometry.centroid(outline.tolist()))
    block.cos, block.sin = math.cos(2.0), math.sin(2.0)
    turn = np.array([[block.cos, -block.sin], [block.sin, block.cos]])
    places = np.random.default_rng(5).uniform(-0.07, 0.07, (300, 2))
    apart = geometry.edge_distance(places, corners) * np.where(geometry.is_inside(places, corners), -1.0, 1.0)
    for place, expected in zip(places, apart, strict=True):
        x, y = (-1.0, 1.0) + turn @ place
        found, *normal = from_body(world, 0, x, y, RADIUS)
        assert found == pytest.approx(expected, abs=1e-15)
        foot = place - found * turn.T @ np.array(normal)
        assert geometry.edge_distance(foot[np.newaxis], corners)[0] == pytest.approx(0.0, abs=1e-14)
        assert is_near(world, 0, x, y, 0.02) or expected >= 0.02


@INTERPRETED
def test_a_wall_has_one_face_and_a_free_end() -> None:
    world = world_of(walls=[LEFT])
    assert from_body(world, 1, 0.002, 0.1, RADIUS) == pytest.approx((0.002, 1.0, 0.0), abs=1e-9)
    assert from_body(world, 1, -0.0005, 0.1, RADIUS)[0] == pytest.approx(-0.0005)  # pressed in
    assert from_body(world, 1, -0.002, 0.1, RADIUS)[0] == math.inf  # behind
    assert from_body(world, 1, 0.0, 0.301, RADIUS)[0] == pytest.approx(0.001)  # on its end
    assert from_body(world, 1, 0.002, -0.02, RADIUS)[0] == math.inf  # that end stands on the ground


@INTERPRETED
def test_an_edge_of_a_profile_is_touched_once() -> None:
    profile = [[-0.2, 0.0], [0.2, 0.0], [0.2, -0.1], [0.5, -0.1]]
    world = world_of(ground={"profile": profile})
    found = [from_body(world, piece, 0.201, 0.001, RADIUS)[0] for piece in range(1, world.bodies.size - 1)]
    assert sorted(one for one in found if one < RADIUS) == pytest.approx([math.hypot(0.001, 0.001)])


record: Any = SimpleNamespace


@INTERPRETED
@pytest.mark.parametrize(("apart", "touches"), [(3e-4, True), (3e-3, False)])
def test_particle_that_nearly_touches_a_body_at_the_start_is_pressed_against_it(
    monkeypatch: pytest.MonkeyPatch, apart: float, touches: bool
) -> None:
    monkeypatch.setattr(contact, "from_body", lambda *_: (1.0 + apart, 0.0, 1.0))
    touch = record(particle=0, body=0, normal_force=0.0)
    ground: Any = record(contact_class=0)
    table: Any = {(0, 0): record(normal_stiffness=1e9)}
    soils = record(
        controls=[record(radius=1.0, touch_count=1)],
        touches=[touch],
        points=[record(x=0.0, y=1.0)],
        states=[record(kind=0, sxx=-1.0, sxy=0.0, syy=-1.0)],
        kinds=[record(density=1.0, volume=1.0, pitch_x=2.0, pitch_y=2.0)],
        interactions=table,
    )
    bodies = type("Rows", (list,), {"size": 1})([ground])
    contact.preload(soils, record(controls=[record(gravity_x=0.0, gravity_y=-1.0)], bodies=bodies))
    assert (touch.normal_force > 0.0) == touches
