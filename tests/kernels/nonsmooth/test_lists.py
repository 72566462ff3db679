"""The list of pairs of rigid contacts, its colours, and packs of four, which find their numbers by place."""

from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth.arrays import AWAY, COLOURS, TOUCHING, Nonsmooth
from blocksim.kernels.nonsmooth.neighbours import frame_of_supports, most_packs, rebuild, update_pairs
from blocksim.kernels.nonsmooth.packs import gather
from blocksim.kernels.nonsmooth.step import substep
from tests.kernels.references import apart, corners
from tests.kernels.scenes import Block, collided, listed, listed_constraints, pairs_of, place, posed, velocities

STEP = 1e-3  # s
BLOCKS = 24
SEEDS = (0, 1)


def cloud(seed: int, area: float, rate: float) -> list[Block]:
    """Return blocks of many sizes all over a square, a plank among them, every ninth one fixed."""
    random = np.random.default_rng(seed)
    found = []
    for i in range(BLOCKS):
        fixed = i % 9 == 4
        sides = (0.4, 0.01) if i == 7 else random.uniform(0.01, 0.03, 2)
        vx, vy, spin = np.zeros(3) if fixed else rate * random.normal(size=3) * (1.0, 1.0, 20.0)
        x, y, angle = random.uniform(0.0, (area, area, 6.0))
        found.append(Block(x, y, angle, vx, vy, spin, sides[0], sides[1], fixed))
    return found


def near(scene: Nonsmooth, reaches: NDArray[np.float64]) -> set[tuple[int, int]]:
    """Return all pairs whose gap is at most the sum of both reaches (m), with the ground, the last, at most one."""
    bodies = scene.world.bodies
    ground = bodies.size - 1
    free = bodies.inverse_mass > 0.0
    limit = np.add.outer(reaches, reaches)
    ways = np.hypot(np.subtract.outer(bodies.x, bodies.x), np.subtract.outer(bodies.y, bodies.y))
    may = (ways <= np.add.outer(bodies.radius, bodies.radius) + limit) & np.logical_or.outer(free, free)
    found = {
        (i, j) for i, j in combinations(range(ground), 2) if may[i, j] and apart(bodies[i], bodies[j]) <= limit[i, j]
    }
    lowest = [float(corners(bodies[i])[:, 1].min()) for i in range(ground)]
    return found | {(i, ground) for i in range(ground) if free[i] and lowest[i] <= bodies.y[ground] + reaches[i]}


def fly(scene: Nonsmooth) -> None:
    """Move all bodies by one step, with nothing in their way."""
    bodies: Any = scene.world.bodies
    bodies.x += STEP * bodies.vx
    bodies.y += STEP * bodies.vy
    bodies.angle += STEP * bodies.spin
    bodies["cos"], bodies["sin"] = np.cos(bodies.angle), np.sin(bodies.angle)


@pytest.mark.parametrize("seed", SEEDS)
def test_list_has_all_pairs_whose_reaches_meet_each_once(seed: int) -> None:
    scene = listed(posed(cloud(seed, 0.15, 0.1), step=STEP))
    constraints = listed_constraints(scene)
    assert len(pairs_of(scene)) == constraints.size
    assert np.all(constraints.a < constraints.b)
    reaches = scene.reaches
    assert len(set(reaches.tolist())) > BLOCKS // 3  # by speed
    expected = near(scene, reaches)
    assert pairs_of(scene) == expected
    assert len(pairs_of(scene)) > BLOCKS


def test_body_that_only_turns_uses_up_its_reach() -> None:
    scene = listed(posed([Block(0.0, 1.0, spin=30.0), Block(0.04, 1.0)], step=STEP, gravity=0.0))
    for _ in range(40):
        fly(scene)
        scene = listed(scene)
    assert scene.world.clock[0].rebuilds > 1


def test_list_that_does_not_fit_leaves_everything_as_it_was() -> None:
    count = 20
    scene = posed([Block(0.001 * i, 1.0) for i in range(count)], step=STEP)
    assert scene.contacts.constraints.size < count * (count - 1) // 2
    before = scene.contacts.constraints.copy()
    assert not update_pairs(scene)
    assert np.array_equal(scene.contacts.constraints, before)
    assert len(pairs_of(listed(scene))) == count * (count - 1) // 2


def crowd(seed: int, count: int = 30) -> list[Block]:
    """Return blocks that overlap one another all over, some of them fixed."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, 0.12, (count, 2))
    return [Block(x, y, random.uniform(-4.0, 4.0), fixed=i % 7 == 3) for i, (x, y) in enumerate(places)]


def comb() -> list[Block]:
    """Return a beam with more blocks on it than there are colours."""
    teeth = [Block(0.006 * i, 0.03, width=0.005, height=0.02) for i in range(COLOURS + 6)]
    return [Block(0.2, 0.0125, width=0.5), *teeth]


def of_colours(scene: Nonsmooth) -> list[list[tuple[int, int]]]:
    """Return the pairs of every colour that there is."""
    constraints = listed_constraints(scene)
    used = int(scene.contacts.stepping[0].colours)
    assert scene.begins[0] == 0
    assert np.all(scene.begins[used:] == constraints.size)
    return [
        list(zip(constraints.a[i:j].tolist(), constraints.b[i:j].tolist(), strict=True))
        for i, j in pairwise(scene.begins[: used + 1])
    ]


def free_bodies(scene: Nonsmooth, pairs: list[tuple[int, int]]) -> list[int]:
    return [i for pair in pairs for i in pair if scene.contacts.states.inverse_mass[i] > 0.0]


def test_pairs_beyond_the_last_colour_are_solved_one_by_one() -> None:
    scene = listed(posed(comb()))
    colours = of_colours(scene)
    assert len(colours) == COLOURS
    for pairs in colours[:-1]:
        free = free_bodies(scene, pairs)
        assert len(set(free)) == len(free)
    assert sum(0 in pair for pair in colours[-1]) > 1  # they all push the beam
    constraints: Any = listed_constraints(scene)
    constraints.reach = TOUCHING
    gather(scene.contacts, scene.begins)
    first, last = scene.contacts.ends[COLOURS - 1 : COLOURS + 1]
    assert last - first == len(colours[-1])
    assert np.all(scene.contacts.packs["count"][first:last] == 1)
    assert last <= most_packs(scene) <= scene.contacts.packs.size


def test_impulses_go_with_their_pair_into_the_next_list() -> None:
    scene = listed(posed(crowd(1)))
    constraints: Any = listed_constraints(scene)
    names = ("nx", "ny", "normal_one", "normal_two", "shear")
    random = np.random.default_rng(0)
    for name in names:
        constraints[name] = random.uniform(1.0, 2.0, constraints.size)
    constraints["reach"] = np.where(np.arange(constraints.size) % 3 == 0, AWAY, TOUCHING)
    kept = {
        (int(constraint.a), int(constraint.b)): [constraint[name] for name in names]
        for constraint in constraints
        if constraint.reach != AWAY
    }
    before = pairs_of(scene)
    moved = [Block(one.x + 0.01 * (i % 3), one.y, one.angle) for i, one in enumerate(crowd(1))]
    place(scene, moved)
    scene.firsts[:-1] = 1
    assert rebuild(scene, frame_of_supports(scene))
    after = listed_constraints(scene)
    assert before - pairs_of(scene)
    assert pairs_of(scene) - before
    carried = 0
    for constraint in after:
        expected = kept.get((int(constraint.a), int(constraint.b)))
        assert [constraint[name] for name in names] == (expected or [0.0] * 5)
        carried += expected is not None
    assert carried > 20


def members(scene: Nonsmooth) -> list[list[int]]:
    """Return the constraints of all packs, without copies."""
    packs = scene.contacts.packs[: scene.contacts.stepping[0].pack_count]
    return [pack.constraint[: pack["count"]].tolist() for pack in packs]


@pytest.mark.parametrize("seed", range(3))
def test_every_constraint_within_the_margin_is_in_one_pack_of_its_colour(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene = listed(posed([Block(*random.uniform(0.0, (0.15, 0.15, 6.0))) for _ in range(25)]))
    constraints: Any = listed_constraints(scene)
    constraints["reach"] = random.integers(3, size=constraints.size)
    gather(scene.contacts, scene.begins)
    packs = members(scene)
    assert sorted(r for pack in packs for r in pack) == np.flatnonzero(constraints.reach != AWAY).tolist()
    assert scene.contacts.stepping[0].active_count == np.count_nonzero(constraints.reach != AWAY)
    for colour in range(scene.contacts.stepping[0].colours):
        first, last = scene.contacts.ends[colour : colour + 2]
        inside = [r for pack in packs[first:last] for r in pack]
        assert all(scene.begins[colour] <= r < scene.begins[colour + 1] for r in inside)
        touching = [constraints.reach[r] == TOUCHING for r in inside]
        assert touching == sorted(touching, reverse=True)  # those that touch first
        left = len(inside) % WIDTH
        sizes = [WIDTH] * (len(inside) // WIDTH) + ([1] * left if left <= 2 else [left])
        assert [len(pack) for pack in packs[first:last]] == sizes
    for pack, inside in zip(scene.contacts.packs, packs, strict=False):
        assert pack.constraint.tolist() == inside + [inside[-1]] * (WIDTH - len(inside))


def test_constraints_of_one_pack_have_the_restitution_and_friction_of_their_own_materials() -> None:
    """Blocks that land and slide on the ground, and on fixed blocks, of other materials."""
    landing: dict[str, Any] = {"vy": -1.0, "vx": 3.0}
    blocks = [Block(0.0, 0.0125 + 1e-5, **landing), Block(0.1, 0.0125 + 1e-5, **landing)]
    for x in (0.2, 0.3):
        blocks += [Block(x, 0.0125, fixed=True), Block(x, 0.0375 + 1e-5, **landing)]
    scene = posed(blocks, restitution=0.5, gravity=0.0, friction=0.25, ground_friction=0.5, substeps=1)
    materials: Any = scene.contacts.materials
    on_ground = materials["kinetic_friction"] == 0.5
    materials["restitution"] = np.where(on_ground, 0.125, 0.5)
    scene = collided(scene)
    assert members(scene) == [[0, 1, 2, 3]]
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    found = velocities(scene.contacts.states)[[0, 1, 3, 5]]
    assert found[:, 1] == pytest.approx([0.125, 0.125, 0.5, 0.5], abs=1e-9)
    assert found[:, 0] == pytest.approx([3.0 - 0.5 * 1.125] * 2 + [3.0 - 0.25 * 1.5] * 2, abs=1e-9)
