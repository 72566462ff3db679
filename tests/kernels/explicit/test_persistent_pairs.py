"""Contacts that continue: the same forces as in contact.py, and what is quicker than a search says the same."""

import copy
from collections.abc import Mapping, Sequence
from math import cos, pi, sin
from typing import Any, NamedTuple

import numpy as np
import pytest

from blocksim.kernels.common.arrays import NORMAL, SHEAR, Record, World
from blocksim.kernels.common.jit import config
from blocksim.kernels.common.mechanics import kick_and_drift
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.forces import NOTHING
from blocksim.kernels.explicit.partition import add_kept, keep
from blocksim.kernels.explicit.persistent_forces import (
    CHANGED,
    TOUCHING,
    is_nearer_than_beside,
    persistent_forces,
    stays_on,
)
from blocksim.kernels.explicit.sides import MOST_CORNERS, into_world, next_number, number_before
from blocksim.kernels.explicit.sliver_axes import is_sliver, meets_along
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, SteppedScene
from tests.conftest import Start
from tests.kernels.scenes import pose

STEP = 1e-6
ROUND_OFF = 64 * np.finfo(float).eps  # of places, which are some ten sums and products


class Tally(NamedTuple):
    """How many pairs went either way, and which contacts those had that were steady."""

    steady: int  # with contacts
    general: int  # contacts before or after
    kinds: frozenset[tuple[bool, ...]]  # for every contact whether its corner is one of b


def take_generally(world: World, p: int, step: float) -> None:
    """Evaluate a pair in the general way and add what it does."""
    pair_forces(world, p, step)
    add_kept(world, world.pairs[p], world.action[0], world.ledger[0])


def take_steadily(world: World, p: int, step: float) -> bool:
    """Evaluate a pair in the steady way and add what it does; return whether that goes."""
    kind, effect = persistent_forces(world, p, step, world.particles)
    if kind != CHANGED:
        keep(world.action[0], effect, kind == TOUCHING)
        dashpot, friction = add_kept(world, world.pairs[p], world.action[0], world.ledger[0])
        world.ledger[0].dashpot += dashpot
        world.ledger[0].friction += friction
    return kind != CHANGED


def evaluate(world: World) -> tuple[Tally, World, World]:
    """Evaluate all pairs at the end of the next drift: in the steady way where it goes, and in a copy generally."""
    step = float(world.controls[0].step)
    quick, slow = copy.deepcopy(world), copy.deepcopy(world)
    steady, general, kinds = 0, 0, set()
    for copied in (quick, slow):
        kick_and_drift(copied.bodies, 0, copied.bodies.size, step)
        for name in ("dashpot", "friction", "broken"):
            copied.ledger[name] = 0.0
    for p, pair in enumerate(quick.pairs[: world.clock[0].pair_count]):
        before = int(pair.active)
        is_steady = take_steadily(quick, p, step)
        if not is_steady:
            take_generally(quick, p, step)
        take_generally(slow, p, step)
        if pair.active or before:
            steady, general = steady + is_steady, general + (not is_steady)
            if is_steady:
                kinds.add(tuple((quick.contacts["slot"][p, : pair.active] >= MOST_CORNERS).tolist()))
    return Tally(steady, general, frozenset(kinds)), quick, slow


def is_near(one: Any, other: Any, size: float, rel: float = 0.0) -> bool:
    """Return whether numbers, in their order, differ by no more than a size or a share of the larger one."""
    allowed = np.maximum(size, rel * np.abs(other))
    return np.shape(one) == np.shape(other) and bool(np.all(np.abs(np.subtract(one, other)) <= allowed))


def assert_same(quick: World, slow: World) -> None:
    """Compare totals, contacts, dashpots and losses of two worlds to what round-off in places can do to forces."""
    stiffness = float(quick.interactions.normal_stiffness.max())
    bodies: Any = quick.bodies[:-1]
    reach = float(np.abs([bodies.x, bodies.y]).max()) + float(bodies.radius.max())
    place = ROUND_OFF * reach
    moved = float(quick.controls[0].step) * float(np.hypot(quick.bodies.vx, quick.bodies.vy).max())
    force = stiffness * place + ROUND_OFF * float(slow.contacts.normal_force.max())
    for name, size in (("fx", force), ("fy", force), ("torque", force * reach)):
        assert is_near(quick.bodies[name], slow.bodies[name], 4.0 * size), name
    assert quick.bodies.pairs_now.tolist() == slow.bodies.pairs_now.tolist()
    count = int(quick.clock[0].pair_count)
    for name in ("active", "near", "duplicates", "idle", "normal_left", "shear_left"):
        assert quick.pairs[name][:count].tolist() == slow.pairs[name][:count].tolist(), name
    for p in range(count):
        one, other = (world.contacts[p, : world.pairs[p].active] for world in (quick, slow))
        assert one["slot"].tolist() == other["slot"].tolist()
        assert one["face"].tolist() == other["face"].tolist()
        for name, size in (("spring", place), ("depth", place), ("normal_force", force), ("shear_force", force)):
            assert is_near(one[name], other[name], size), name
        for direction, name in ((NORMAL, "normal_left"), (SHEAR, "shear_left")):
            if quick.pairs[name][p] > 0:
                assert_same_dashpots(quick.operators[p, direction], slow.operators[p, direction])
        assert quick.pairs[p].shear_left == 0 or quick.pairs[p].sticking == slow.pairs[p].sticking
    for name in ("dashpot", "friction", "broken"):
        assert is_near(quick.ledger[name], slow.ledger[name], 8.0 * force * (moved + place), 1e-9), name


def assert_same_dashpots(one: Record, other: Record) -> None:
    for names in (("e_one", "e_mixed", "e_two"), ("h_one", "h_mixed", "h_two")):
        numbers = np.array([[operator[name] for name in names] for operator in (one, other)])
        assert is_near(numbers[0], numbers[1], 1e-9 * np.abs(numbers).max(), 1e-6)


def tip(angle: float) -> float:
    """Return the height (m) of the centre of a block that stands on its corner."""
    return 0.5 * (abs(sin(angle)) * WIDTH + cos(angle) * HEIGHT)


FIXED = {"y": 0.5 * HEIGHT, "fixed": True}
ABOVE = 1.5 * HEIGHT
RESTING = [{"y": 0.5 * HEIGHT}, {"x": 0.004, "y": ABOVE}, {"x": 0.06, "y": 0.5 * HEIGHT}]
SITUATIONS: dict[str, tuple[Sequence[Mapping[str, object]], dict[str, Any]]] = {
    "rest on a slope": (RESTING, {"tilt": -0.2}),
    "sliding": ([{"y": 0.5 * HEIGHT, "velocity": [0.5, 0.0]}, {"x": 0.004, "y": ABOVE, "velocity": [-0.5, 0.0]}], {}),
    "no friction": (RESTING, {"tilt": -0.2, "friction": 0.0, "ground_friction": 0.0}),
    "no dashpots": (RESTING, {"restitution": 1.0, "tilt": -0.2}),
    "impact on a corner": ([{"y": tip(0.3) + 1e-7, "angle": 0.3, "velocity": [0.2, -1.0]}], {}),
    "impact of b's corner": ([FIXED, {"y": HEIGHT + tip(-0.3) + 1e-7, "angle": -0.3, "velocity": [0.2, -1.0]}], {}),
    "impact of two free blocks": (
        [{"y": 0.1, "spin": 3.0}, {"x": 2e-3, "y": 0.1 + HEIGHT + 1e-7, "velocity": [0.1, -1.0], "spin": -2.0}],
        {"gravity": 0.0},
    ),
    "aligned": ([{"y": 0.5 * HEIGHT}, {"y": ABOVE, "velocity": [0.01, 0.0]}], {}),
    "rocking": ([{"y": tip(0.002), "angle": 0.002, "spin": -0.3}, {"x": 0.1, "y": 0.5 * HEIGHT}], {}),
    "wall of three": ([{"y": 0.5 * HEIGHT}, {"x": 0.033, "y": 0.5 * HEIGHT}, {"x": 0.0165, "y": ABOVE}], {}),
}


def outlined(body: Mapping[str, object]) -> dict[str, object]:
    """Return a block with its corners as an outline."""
    x, y = 0.5 * float(str(body.get("width", WIDTH))), 0.5 * HEIGHT
    return {**body, "outline": [[-x, -y], [x, -y], [x, y], [-x, y]]}


RADIUS, APOTHEM = 0.02, 0.01 * 3.0**0.5
HEXAGON = {"outline": [[RADIUS * cos(k * pi / 3), RADIUS * sin(k * pi / 3)] for k in range(6)]}
WEDGE = {"outline": [[-0.03, -0.01], [0.03, -0.01], [0.0, 0.02]]}  # centroid in its origin, sharp ends
SITUATIONS |= {
    f"{name}, as outlines": ([outlined(body) for body in bodies], values)
    for name in ("rest on a slope", "impact of b's corner", "aligned", "rocking")
    for bodies, values in (SITUATIONS[name],)
}
SITUATIONS |= {
    "column of hexagons": (
        [{"y": APOTHEM, **HEXAGON}, {"y": 3.0 * APOTHEM, **HEXAGON}, {"x": 2e-3, "y": 5.0 * APOTHEM, **HEXAGON}],
        {"contact": {"stiffness_scale": 1e-2}},
    ),
    "wedge on wedge": (
        [
            {"y": 0.01, **WEDGE},
            {"x": 0.03, "y": 0.02, **WEDGE, "angle": pi},
            {"x": -0.03, "y": 0.02, **WEDGE, "angle": pi},
        ],
        {"contact": {"stiffness_scale": 1e-3}},
    ),
    "hexagon strikes a corner": (
        [
            {"y": APOTHEM, **HEXAGON, "fixed": True},
            {"x": 0.004, "y": 3.0 * APOTHEM + 1e-7, **HEXAGON, "velocity": [0.3, -1.0]},
        ],
        {},
    ),
}
# with a hundredth of the stiffness: overlaps are far from round-off, and no slivers
HERTZ = {"law": "hertz-mindlin", "stiffness_scale": 0.01, "max_overlap": 2e-3}
SITUATIONS |= {
    f"{name}, Hertz": (SITUATIONS[name][0], {**SITUATIONS[name][1], "contact": HERTZ})
    for name in ("sliding", "wall of three", "column of hexagons")
}


@pytest.mark.parametrize("situation", SITUATIONS)
def test_steady_pairs_have_the_forces_and_losses_of_the_general_way(start: Start, situation: str, pace: int) -> None:
    bodies, values = SITUATIONS[situation]
    scene = start(bodies, **values)
    seen = 0
    for n in range(80 // pace):
        tally, quick, slow = evaluate(scene.world)
        assert_same(quick, slow)
        seen += tally.steady
        scene.to_step(scene.steps + 1 + n % 4)
    assert seen > 20 // pace


@pytest.mark.parametrize("up", [1.1e-6, 1.0])
@pytest.mark.parametrize("below", [[], [(0.0, 1.0, 0.0)]], ids=["on the ground", "on a block"])
def test_contact_that_ends_is_not_steady(up: float, below: list[tuple[float, float, float]]) -> None:
    """It is left to contact.py, as it was."""
    level = 1.0 + 0.5 * HEIGHT if below else 0.0
    world = pose((0.003, level + 0.5 * HEIGHT - 1e-6, 0.0), *below)
    pair_forces(world, 0, 0.0)
    assert world.pairs[0].active == 2
    world.bodies[0].y += up
    before = copy.deepcopy(world)
    assert persistent_forces(world, 0, STEP, world.particles) == (CHANGED, NOTHING)
    for name in ("bodies", "pairs", "contacts", "candidates", "operators", "ledger", "points", "action"):
        assert np.array_equal(getattr(world, name), getattr(before, name)), name


@pytest.mark.parametrize(("shift", "changes"), [(0.0, False), (0.016, False), (0.0171, True)])
def test_corner_of_a_polygon_beyond_the_end_of_its_face_is_not_steady(
    start: Start, shift: float, changes: bool
) -> None:
    def press(world: World) -> None:
        world.bodies[1].y -= 1e-6

    below, above = {"y": APOTHEM, **HEXAGON, "fixed": True}, {"x": 0.003, "y": 3.0 * APOTHEM, **HEXAGON}
    world = start([below, above], change=press).world  # their faces are 20 mm long
    assert world.pairs[0].active == 2
    world.bodies[1].x += shift
    kind, _ = persistent_forces(world, 0, 0.0, world.particles)
    assert kind == (CHANGED if changes else TOUCHING)


TRIES = 1000 if config.DISABLE_JIT else 2000
SIX = [[np.cos(angle), np.sin(angle)] for angle in np.arange(6) * np.pi / 3.0]
SHARP = [[-1.0, -0.2], [1.0, -0.2], [-0.8, 0.9]]
QUADRANGLE = [[-1.0, -0.5], [1.2, -0.7], [0.6, 0.8], [-0.9, 0.4]]


def of_two(one: list[list[float]], two: list[list[float]]) -> SteppedScene:
    return CaseScene([{"y": 1.0, "outline": one}, {"y": 5.0, "outline": two}], gravity=0.0).start()


PAIRS = pytest.mark.parametrize(("one", "two"), [(SIX, SIX), (SHARP, SIX), (QUADRANGLE, SHARP)])


def turn_to(owner: Any, angle: float) -> None:
    owner.angle, owner.cos, owner.sin = angle, np.cos(angle), np.sin(angle)


def put(owner: Any, number: int, touched: Any, x: float, y: float, table: Any) -> None:
    """Move the corner of a number to (x, y) from the centre of `touched`."""
    corner = table[owner.first_corner + number]
    ox, oy = into_world(owner, corner.x, corner.y)
    owner.x, owner.y = touched.x + x - ox, touched.y + y - oy


@PAIRS
def test_corner_that_the_face_beside_cannot_take_stays_on_its_face(
    one: list[list[float]], two: list[list[float]]
) -> None:
    """Random corners near the ends of faces: no other face may be found for any that are told to stay."""
    world = of_two(one, two).world
    touched, owner, table = world.bodies[0], world.bodies[1], world.corners
    random = np.random.default_rng(20)
    told = 0
    for _ in range(TRIES):
        face, number = int(random.integers(len(one))), int(random.integers(len(two)))
        side: Any = table[touched.first_corner + face]
        depth, end = 10.0 ** random.uniform(-7.0, -2.0), random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-7.0, -1.0)
        turn = random.uniform(-0.3, 0.3) if random.random() < 0.5 else 1e-3 * random.standard_normal()
        corner: Any = table[owner.first_corner + number]
        facing = np.arctan2(-side.ny, -side.nx) - np.arctan2(corner.ny, corner.nx) + turn
        turn_to(owner, facing)
        is_last = random.random() < 0.5
        along = side.middle + (1.0 if is_last else -1.0) * (side.half - end)
        x = (side.distance - depth) * side.nx - along * side.ny
        y = (side.distance - depth) * side.ny + along * side.nx
        put(owner, number, touched, x, y, table)
        beside = next_number(touched, table, face) if is_last else number_before(touched, table, face)
        way = 10.0 ** random.uniform(-8.0, -2.0)
        if is_nearer_than_beside(owner, number, touched, face, beside, x, y, depth, way, end, table):
            told += 1
            assert stays_on(face, owner, number, touched, way, table)
    assert told > TRIES // 20


@PAIRS
def test_two_faces_that_meet_along_an_interval_are_no_sliver(one: list[list[float]], two: list[list[float]]) -> None:
    """Random corners on faces nearly parallel to their own, beyond the ends too: most that are no sliver are told."""
    world = of_two(one, two).world
    touched, owner, table = world.bodies[0], world.bodies[1], world.corners
    random = np.random.default_rng(21)
    told = slivers = 0
    for _ in range(TRIES):
        face, own = int(random.integers(len(one))), int(random.integers(len(two)))
        side: Any = table[touched.first_corner + face]
        meets: Any = table[owner.first_corner + own]
        turn = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, -2.0)
        turn_to(owner, np.arctan2(-side.ny, -side.nx) - np.arctan2(meets.ny, meets.nx) + turn)
        number = own if random.random() < 0.5 else next_number(owner, table, own)
        depth, end = 10.0 ** random.uniform(-4.0, -1.0), random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-5.0, 0.0)
        along = random.choice([-1.0, 1.0]) * (side.half - end)
        place = along + side.middle
        x = (side.distance - depth) * side.nx - place * side.ny
        y = (side.distance - depth) * side.ny + place * side.nx
        put(owner, number, touched, x, y, table)
        is_short = is_sliver(owner, touched, table)
        slivers += is_short
        if meets_along(owner, number, touched, side, side.nx, side.ny, along, depth, table):
            told += 1
            assert not is_short
    assert slivers > TRIES // 20
    assert told > TRIES // 5
