"""Distances, cells, and lists of pairs: all that is near, looked at before anything leaves their reach."""

from collections.abc import Callable
from math import cos, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import (
    MOTION_PIECE,
    NEAR_PAIR,
    PAIR,
    Floats,
    Record,
    Records,
    World,
    zeros,
)
from blocksim.kernels.common.mechanics import renew_rotations
from blocksim.kernels.common.neighbours import CellGrid, Stale, lay_cells, list_pairs, sort_into_cells, travel
from blocksim.kernels.common.shapes import separation, turn
from blocksim.kernels.common.tolerances import MOST_UNSEEN, SMALL_TURN
from blocksim.kernels.explicit.broad_phase import PAIR_SHARE, carry_history, unseen_steps
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.persistent_forces import CHANGED, UNTOUCHED, persistent_forces
from blocksim.kernels.sph.fields import PLACE, find_neighbours
from blocksim.scenario import Model
from blocksim.verification.scene import SteppedScene, scenario_of
from blocksim.world.build import build_world, empty_lists
from tests.kernels.references import apart as largest_gap, distances, turning
from tests.kernels.scenes import make_body, pose

Sides = Callable[[np.random.Generator, int], NDArray[np.float64]]

places = st.floats(-0.06, 0.06)
sides = st.floats(1e-3, 0.05)
angles = st.floats(-7.0, 7.0)


def points_of(body: Record, count: int = 15) -> np.ndarray:
    """Return a grid of points that fills a body."""
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, count), np.linspace(-1.0, 1.0, count))
    local = np.stack([u.ravel() * body.half_x, v.ravel() * body.half_y], axis=1)
    return np.asarray(local @ turning(body.angle) + (body.x, body.y))


@pytest.mark.parametrize("by", [0.0, 1e-9, 1e-3, SMALL_TURN * (1 - 1e-9), SMALL_TURN, SMALL_TURN * (1 + 1e-9), -0.049])
def test_turn_agrees_with_the_library_on_both_sides_of_the_series(by: float) -> None:
    assert turn(1.0, 0.0, by) == pytest.approx((cos(by), sin(by)), abs=1e-14)


@given(x=places, y=places, one=angles, two=angles, w=sides, h=sides)
def test_separation_is_the_largest_gap_and_never_exceeds_the_distance(
    *, x: float, y: float, one: float, two: float, w: float, h: float
) -> None:
    a = make_body(x, y, one)
    b = make_body(0.0, 0.01, two, width=w, height=h)
    gap = separation(a, b)
    assert gap == pytest.approx(largest_gap(a, b), abs=1e-15)
    assert gap == pytest.approx(separation(b, a), abs=1e-15)
    nearest = min(distances(points_of(a), b).min(), distances(points_of(b), a).min())
    assert gap <= nearest + 1e-15
    assert (gap <= 0.0) or (nearest > 0.0)


RADIUS = 0.1
# on the edges of cells, between them, and so far away that cells of the size of the radius would be too many
PLACES = st.one_of(
    st.integers(-6, 6).map(lambda k: k * RADIUS), st.floats(-0.5, 0.5), st.floats(-1e9, 1e9), st.just(-0.0)
)
CLOUDS = st.lists(st.tuples(PLACES, PLACES), min_size=1, max_size=40).map(np.array)


def sort(positions: Floats, radius: float) -> tuple[CellGrid, list[list[int]]]:
    """Return the grid, and what lies in every cell."""
    n = len(positions)
    places: Records = np.ascontiguousarray(positions).view(PLACE)[:, 0].view(np.recarray)
    starts, order = np.full(3 * n + 3, -1), np.full(n, -1)
    grid = lay_cells(places, radius, n, False)
    sort_into_cells(places, grid, starts, order)
    count = grid.columns * grid.rows
    assert (starts[0], starts[count]) == (0, n)
    return grid, [order[starts[c] : starts[c + 1]].tolist() for c in range(count)]


def test_a_few_that_have_flown_off_do_not_make_cells_larger() -> None:
    positions = np.random.default_rng(3).uniform(0.0, 1.0, (1000, 2))
    positions[::100] = np.random.default_rng(4).uniform(-1e300, 1e300, (10, 2))
    positions[7] = np.nan
    grid, cells = sort(positions, 0.1)
    assert grid.size < 0.2
    assert max(map(len, cells)) < 60


def by_cells(positions: Floats, points: Floats, radius: float) -> list[list[int]]:
    offsets, indices = find_neighbours(positions, points, radius)
    return [sorted(indices[offsets[i] : offsets[i + 1]].tolist()) for i in range(len(points))]


def by_brute_force(positions: Floats, points: Floats, radius: float) -> list[list[int]]:
    dx, dy = (positions[None, :, k] - points[:, None, k] for k in (0, 1))
    return [np.flatnonzero(row).tolist() for row in dx * dx + dy * dy < radius * radius]


@given(positions=CLOUDS, points=CLOUDS, radius=st.sampled_from([1e-9, 0.05, RADIUS, 0.3, 1e6, 1e12]))
def test_cells_are_few_and_lists_equal_those_of_a_search_over_all_pairs(
    positions: Floats, points: Floats, radius: float
) -> None:
    grid, cells = sort(positions, radius)
    assert len(cells) <= 3 * len(positions) + 1
    assert grid.size >= radius
    assert sorted(i for cell in cells for i in cell) == list(range(len(positions)))
    assert all(cell == sorted(cell) for cell in cells)
    for places in (points, positions):
        assert by_cells(positions, places, radius) == by_brute_force(positions, places, radius)


COUNT = 64
HILL = {"ground": {"profile": [[-1.0, 0.2], [0.0, 0.0], [0.3, -0.1], [5.0, 0.4]]}}
WALLS = {"walls": [{"from": [0.1, 0.5], "to": [0.1, 0.0]}]}


def alike(_: np.random.Generator, count: int) -> NDArray[np.float64]:
    return np.full((count, 2), (0.032, 0.025))


def up_to(ratio: float) -> Sides:
    """Return how to draw sides of which the largest is `ratio` times the smallest, all sizes equally often."""

    def draw(random: np.random.Generator, count: int) -> NDArray[np.float64]:
        return np.asarray(0.01 * ratio ** random.uniform(0.0, 1.0, (count, 2)))

    return draw


def planks(random: np.random.Generator, count: int) -> NDArray[np.float64]:
    sides = up_to(2.0)(random, count)
    sides[::12] = 1.5, 0.01
    return sides


def heap(sides: Sides, area: float, **tables: Any) -> World:
    """Return blocks all over a square, overlapping as no scenario would allow; every ninth one is fixed."""
    random = np.random.default_rng(0)
    bodies = [
        {"x": float(i), "y": 1.0, "fixed": i % 9 == 0, "width": width, "height": height}
        for i, (width, height) in enumerate(sides(random, COUNT).tolist())
    ]
    world = build_world(Model(scenario_of(bodies, **tables)))
    blocks: Any = world.bodies[:COUNT]
    blocks.x, blocks.y = random.uniform(-area / 2, area / 2, (2, COUNT))
    blocks.angle = random.uniform(-4.0, 4.0, COUNT)
    renew_rotations(world.bodies)
    return world


def expected_neighbours(world: World) -> list[list[int]]:
    """Return for every body those after it that are within the skin, unless both are fixed."""
    bodies, reach = world.bodies[:-1].view(np.recarray), float(world.controls[0].skin)
    way = np.hypot(bodies.x - bodies.x[:, None], bodies.y - bodies.y[:, None])
    is_free = bodies.inverse_mass > 0.0
    may = np.triu((way <= bodies.radius + bodies.radius[:, None] + reach) & (is_free | is_free[:, None]), 1)
    return [
        [j for j in np.flatnonzero(row).tolist() if largest_gap(bodies[i], bodies[j]) <= reach]
        for i, row in enumerate(may)
    ]


def found_neighbours(world: World) -> list[list[int]]:
    """Return the same from the list of pairs, made at once or of two halves of the bodies, without the ground."""
    ground, reach = world.bodies.size - 1, float(world.controls[0].skin)
    kept: Any = zeros(ground * ground, PAIR)
    found: list[list[int]] = [[] for _ in range(ground)]
    for a, b in kept[: list_pairs(world, kept, None, reach, False)][["a", "b"]].tolist():
        if b < ground:
            found[a].append(b)
    stale = Stale(np.ones(ground + 1, np.int64), 0.5 * np.full(ground + 1, reach))
    at_once = kept[: list_pairs(world, kept, stale, 0.0, True)][["a", "b"]].tolist()
    assert sorted(pair for pair in at_once if pair[1] < ground) == [(a, b) for a in range(ground) for b in found[a]]
    others: list[tuple[int, int]] = []
    marks = np.arange(ground + 1) % 2
    for half in (marks, 1 - marks):
        stale = Stale(half, 0.5 * np.full(ground + 1, reach))
        others += kept[: list_pairs(world, kept, stale, 0.0, False)][["a", "b"]].tolist()
    mixed = [(a, b) for a, b in others if b < ground and a % 2 != b % 2]
    assert len(mixed) == 2 * len(set(mixed))  # from both halves
    assert sorted({pair for pair in others if pair[1] < ground}) == [(a, b) for a in range(ground) for b in found[a]]
    return found


HEAPS = [
    pytest.param(alike, 0.4, {}, 0, id="alike"),
    pytest.param(up_to(50.0), 2.0, {}, 5, id="one to fifty"),
    pytest.param(planks, 0.8, {}, 6, id="planks"),
    pytest.param(alike, 0.5, HILL | WALLS, 4, id="slabs"),
]


@pytest.mark.parametrize(("sides", "area", "tables", "large"), HEAPS)
def test_grid_finds_the_pairs_that_looking_at_all_of_them_finds(
    sides: Sides, area: float, tables: dict[str, Any], large: int
) -> None:
    world = heap(sides, area, **tables)
    expected = expected_neighbours(world)
    assert found_neighbours(world) == expected
    assert sum(map(len, expected)) > 20
    is_large = world.bodies.radius[:-1] > world.controls[0].cell_radius
    assert world.large.tolist() == np.flatnonzero(is_large).tolist()
    assert large <= is_large.sum() <= COUNT // 8


BODIES = 12
CAPACITY = BODIES * (BODIES - 1) // 2


@pytest.fixture(scope="module")
def worlds() -> dict[str, World]:
    """Return a world with room for all pairs, with contacts of either kind."""
    bodies = [{"x": 0.04 * i, "y": 1.0} for i in range(BODIES)]
    contact = {"particle_spacing": 0.008}
    made = {
        model: build_world(Model(scenario_of(bodies, contact={"model": model, **contact})))
        for model in ("surface", "kernel")
    }
    for world in made.values():
        world.controls.approach = 1.0  # m: all are near to one another
    return {
        model: world._replace(**empty_lists(CAPACITY, world.candidates.shape[1], world.before))
        for model, world in made.items()
    }


def drawn_pairs(random: np.random.Generator, share: float) -> list[tuple[int, int]]:
    every = [(a, b) for a in range(BODIES) for b in range(a + 1, BODIES)]
    return [pair for pair in every if random.random() < share]


REMEMBERED = ("axis", "duplicates", "normal_left", "shear_left", "sticking", "slides")


def fill_list(world: World, pairs: list[tuple[int, int]], random: np.random.Generator) -> None:
    """List pairs with made-up contacts, operators, duplicates and axes; every other pair or so touches."""
    for p, (a, b) in enumerate(pairs):
        pair = world.pairs[p]
        pair.a, pair.b, pair.active = a, b, random.integers(0, 3)
        for name in REMEMBERED:
            pair[name] = random.integers(0, 3)
        for contact in world.contacts[p, : pair.active]:
            for name in contact.dtype.names:
                contact[name] = random.integers(1, 10**6)
        world.operators[p].e_one = random.random(2)
    world.clock[0].pair_count = len(pairs)


def remembered(world: World, pairs: Records, count: int) -> dict[tuple[int, int], tuple[object, ...]]:
    """Return what every pair that touches remembers."""
    return {
        (int(pair.a), int(pair.b)): (
            [int(pair[name]) for name in REMEMBERED],
            world.contacts[p, : pair.active].tobytes(),
            world.operators[p].tobytes(),
        )
        for p, pair in enumerate(pairs[:count])
        if pair.active
    }


@pytest.mark.parametrize("model", ["surface", "kernel"])
@given(seed=st.integers(0, 10**6), shares=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)))
def test_every_pair_keeps_its_own_history_wherever_it_moves_in_the_list(
    worlds: dict[str, World], model: str, seed: int, shares: tuple[float, float]
) -> None:
    world, random = worlds[model], np.random.default_rng(seed)
    old, new = drawn_pairs(random, shares[0]), drawn_pairs(random, shares[1])
    fill_list(world, old, random)
    before = remembered(world, world.pairs, len(old))
    axes = {(int(pair.a), int(pair.b)): int(pair.axis) for pair in world.pairs[: len(old)]}
    for near, (a, b) in zip(world.candidates.view(NEAR_PAIR)[:, 0], new, strict=False):
        near.a, near.b = a, b
    assert carry_history(world, len(new)) == len(new)
    after = remembered(world, world.pairs, len(new))
    assert after == {pair: history for pair, history in before.items() if pair in set(new)}
    assert world.pairs.axis[: len(new)].tolist() == [axes.get(pair, 0) for pair in new]


SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps
G = 9.81


@pytest.fixture(scope="module")
def world() -> World:
    """Return a block in the air; nothing has been looked at."""
    return build_world(Model(scenario_of([{"y": 1.0}], contact=SOFT)))


def test_travel_is_that_of_the_farthest_corner() -> None:
    body = make_body(0.3, -0.2, 1.0)
    body.list_x, body.list_y, body.list_angle = 0.1, 0.1, 1.5
    assert travel(body, 0.0, 0.0) == pytest.approx(np.hypot(0.2, 0.3) + 0.5 * body.radius)
    body.list_x, body.list_y, body.list_angle = body.x, body.y, body.angle
    assert travel(body, 0.0, 0.0) == 0.0


shares = st.floats(0.0, 0.999)
speeds = st.one_of(st.just(0.0), st.floats(1e-6, 100.0))


@given(share=shares, fastest=speeds)
def test_no_falling_body_comes_beyond_its_share_unseen(world: World, share: float, fastest: float) -> None:
    """The worst: the fastest body is at the edge of its share already and falls the way that it moves."""
    reach = PAIR_SHARE * float(world.controls[0].skin)
    steps = unseen_steps(world, share * reach, fastest)
    time = steps * float(world.controls[0].step)
    assert 0 <= steps <= MOST_UNSEEN
    assert share * reach + fastest * time + 0.5 * G * time**2 <= reach


def jolt() -> World:
    """Jerk the ground away below three blocks at rest: the support's speed jumps from none to 2 m/s."""
    bodies = [{"x": 0.04 * i, "y": 0.0125} for i in range(2)] + [{"x": 0.02, "y": 0.0376}]
    pieces = zeros(2, MOTION_PIECE)
    pieces[1].start, pieces[1].c1 = 2e-3, 2.0
    contact = {**SOFT, "max_overlap": 0.02}
    world = build_world(Model(scenario_of(bodies, contact=contact, time={"stop_at_rest": False})))
    world.controls.motion_x = 1.0
    return world._replace(motion=pieces)


def test_no_body_comes_beyond_its_share_before_pairs_are_looked_for(pace: int) -> None:
    scene = SteppedScene(jolt())
    stops, share = round(0.02 / scene.step) // pace, PAIR_SHARE * float(scene.world.controls[0].skin)
    for step in range(1, stops):
        bodies = scene.to_step(step).world.bodies
        moved = np.hypot(bodies.x - bodies.list_x, bodies.y - bodies.list_y)
        assert (moved + bodies.radius * np.abs(bodies.angle - bodies.list_angle)).max() <= share, step
    assert 1 <= scene.world.clock[0].rebuilds < stops / 3


STEP = 1e-6
near_places = st.floats(-0.05, 0.05)
half_turns = st.floats(-4.0, 4.0)


@pytest.mark.parametrize("axis", [0, 3, 17, 18])
@given(x=near_places, y=near_places, one=half_turns, two=half_turns, seed=st.integers(0, 1000))
def test_no_contact_begins_unseen(*, axis: int, x: float, y: float, one: float, two: float, seed: int) -> None:
    world = pose((x, 1.0 + y, one), (0.0, 1.0, two))
    assume(world.clock[0].pair_count > 0)
    skin, random = float(world.controls[0].skin), np.random.default_rng(seed)
    for body in world.bodies[:2]:
        body.x += random.uniform(-0.2, 0.2) * skin
        body.y += random.uniform(-0.2, 0.2) * skin
        body.angle += random.uniform(-0.2, 0.2) * skin / float(body.radius)
    renew_rotations(world.bodies)
    pair = world.pairs[0]
    pair.axis = axis  # whichever was the best one last
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result in {CHANGED, UNTOUCHED}
    if contact_points(world, 0) > 0:
        assert result == CHANGED
    elif separation(*world.bodies[:2]) > 0.0:
        assert result == UNTOUCHED


@given(y=st.floats(0.0, 0.02), angle=half_turns, down=st.floats(-0.4, 0.4))
@pytest.mark.parametrize("axis", [0, 1])
def test_no_contact_with_the_ground_begins_unseen(axis: int, y: float, angle: float, down: float) -> None:
    world = pose((0.2, y, angle))
    assume(world.clock[0].pair_count > 0)
    world.bodies[0].y += down * float(world.controls[0].skin)
    world.pairs[0].axis = axis
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result == (CHANGED if contact_points(world, 0) > 0 else UNTOUCHED)
