"""Contact manifolds of convex polygons: against polygons clipped another way, and against those of rectangles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.arrays import AWAY, CONSTRAINT, FAR, OPEN, TOUCHING
from blocksim.kernels.nonsmooth.narrow_phase import find_manifolds
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.kernels import references
from tests.kernels.scenes import (
    HEXAGON,
    Block,
    depth_below,
    listed,
    listed_constraints,
    place,
    posed,
    random_outline,
    rectangle,
    turned,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth
    from blocksim.scenario.geometry import Corners

PAIRS = 25
BRICK = rectangle(WIDTH, HEIGHT)


@pytest.fixture(autouse=True)
def outlines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the references take the corners of polygons."""
    monkeypatch.setattr(references, "corners", lambda body: body.places)


class Outlined:
    """A body of a scene with its corners in world axes, for the references."""

    def __init__(self, body: Any, block: Block) -> None:
        """Take its pose."""
        self.x, self.y = float(body.x), float(body.y)
        outline = block.outline or rectangle(block.width, block.height)
        self.places = turned(outline, block.angle) + np.array([block.x, block.y])


def manifolds(scene: Nonsmooth, blocks: Sequence[Block]) -> Any:
    """Return the constraints of a scene whose blocks have been put elsewhere."""
    place(scene, blocks)
    scene.world.clock[0].rebuilds = 0
    scene = listed(scene)
    constraints = listed_constraints(scene)
    for name in ("normal_one", "normal_two", "shear"):
        constraints[name] = 0.0
    find_manifolds(scene, 0, constraints.size)
    return constraints


def near_one_another(random: Any, one: Block, other: Block) -> Block:
    """Return `other` in a pose with a gap or an overlap of up to 1 mm."""
    angle, way, gap = (float(random.uniform(*ends)) for ends in ((-4.0, 4.0), (-math.pi, math.pi), (-1e-3, 1e-3)))
    near, far, put = 0.0, 0.2, other
    while far - near > 1e-8:
        middle = 0.5 * (near + far)
        put = Block(one.x + middle * math.cos(way), one.y + middle * math.sin(way), angle, outline=other.outline)
        apart = references.apart(*(Outlined(put, block) for block in (one, put)))
        near, far = (near, middle) if apart > gap else (middle, far)
    return put


def over_a_joint(x: float, y: float, sunk: float) -> list[Block]:
    """Return two blocks beside one another, and a hexagon that has sunk in (m) over their joint."""
    below = depth_below(HEXAGON)
    foot = 0.5 * float(np.ptp([x for x, y in HEXAGON if y < -0.99 * below]))
    slider = Block(x + 0.016 - foot + 0.01 * sunk, y + 0.0125 + below - sunk, outline=HEXAGON)
    return [Block(x, y), Block(x + 0.032, y), slider]


def pairs(random: Any, is_rectangle: bool = False) -> list[tuple[Block, Block]]:
    """Return polygons two by two, all far from one another."""
    found = []
    for k in range(PAIRS):
        shapes = [rectangle(*random.uniform(0.02, 0.06, 2)) if is_rectangle else random_outline(random) for _ in "ab"]
        one = Block(0.5 * k, 2.0, float(random.uniform(-4.0, 4.0)), vx=0.4, outline=shapes[0])  # a margin of 1 mm
        found.append((one, near_one_another(random, one, Block(outline=shapes[1]))))
    return found


def test_manifold_is_what_two_clipped_polygons_have() -> None:
    random = np.random.default_rng(3)
    seen = []
    for two in pairs(random), pairs(random), pairs(random):
        blocks = [block for pair in two for block in pair]
        scene = posed(blocks)
        constraints = {(int(constraint.a), int(constraint.b)): constraint for constraint in manifolds(scene, blocks)}
        margin = float(scene.contacts.stepping[0].margin)
        for k in range(PAIRS):
            a, b = (Outlined(scene.world.bodies[2 * k + i], blocks[2 * k + i]) for i in (0, 1))
            expected: Any = references.meeting(a, b, margin)
            constraint = constraints.get((2 * k, 2 * k + 1))
            is_near = references.apart(a, b) <= margin and expected.gaps.size > 0
            assert (constraint is not None and bool(constraint.reach != AWAY)) is is_near
            if constraint is None or not is_near:
                continue
            seen.append(int(constraint.reach))
            assert (constraint.nx, constraint.ny) == pytest.approx(expected.normal, abs=1e-9)
            gaps = np.array([constraint.gap_one, constraint.gap_two])
            assert gaps[gaps < FAR] == pytest.approx(expected.gaps, abs=1e-9)
            for body, of_a in ((a, True), (b, False)):
                places = references.places_of(constraint, body, of_a=of_a)
                assert places[gaps < FAR] == pytest.approx(expected.places, abs=1e-9)
    assert min(seen.count(reach) for reach in (OPEN, TOUCHING)) > 10


@pytest.mark.parametrize("mixed", [False, True])
def test_rectangles_given_as_outlines_have_the_same_manifolds(mixed: bool) -> None:
    """All of them, or one of every two."""
    random = np.random.default_rng(5)
    outlined = [block for pair in pairs(random, is_rectangle=True) for block in pair]

    def plain(block: Block) -> Block:
        sides = 2.0 * np.array(block.outline).max(axis=0)
        return Block(block.x, block.y, block.angle, vx=block.vx, width=float(sides[0]), height=float(sides[1]))

    rectangles = [plain(block) for block in outlined]
    others = [rectangles[i] if mixed and i % 2 else block for i, block in enumerate(outlined)]
    one, other = (manifolds(posed(blocks), blocks) for blocks in (rectangles, others))
    known = {(int(constraint.a), int(constraint.b)): constraint for constraint in one}
    near = 0
    for constraint in other:
        same = known[int(constraint.a), int(constraint.b)]
        assert constraint.reach == same.reach
        if constraint.reach != AWAY:
            near += 1
            names = [name for name in CONSTRAINT.names or () if not name.startswith("corner")]
            assert [constraint[name] for name in names] == [same[name] for name in names]  # to the last bit
    assert near > PAIRS // 2


@pytest.mark.parametrize("flush", [False, True])
def test_four_pairs_at_a_time_have_the_manifolds_that_each_has_alone(flush: bool) -> None:
    """To the last bit, as threads divide pairs anywhere; flush blocks have faces that face one another over slivers."""
    random = np.random.default_rng(11)
    blocks = [block for pair in (*pairs(random), *pairs(random, is_rectangle=True)) for block in pair]
    if flush:
        blocks = [block for k in range(8) for block in over_a_joint(0.5 * k, 2.0, 1e-5 * (1 + k))]
    scene = posed(blocks)
    manifolds(scene, blocks)
    constraints = listed_constraints(scene)
    for impulse in (0.0, 1.0):  # which goes with corners that have changed places
        constraints["normal_one"], constraints["normal_two"], constraints["shear"] = impulse, 2.0 * impulse, impulse
        corners = constraints["corner_two"].copy(), constraints["corner_one"].copy()
        constraints["corner_one"], constraints["corner_two"] = corners
        before = constraints.copy()
        find_manifolds(scene, 0, constraints.size)
        together = constraints.copy()
        constraints[:] = before
        for r in range(constraints.size):
            find_manifolds(scene, r, r + 1)
        near = together["reach"] != AWAY
        assert near.sum() >= 8
        assert constraints["reach"].tolist() == together["reach"].tolist()
        for name in CONSTRAINT.names or ():
            assert constraints[name][near].tolist() == together[name][near].tolist(), name


def test_polygon_that_has_sunk_in_a_little_is_not_stopped_by_the_side_of_the_next() -> None:
    """A hexagon slides over the flush joint of two blocks, and overlaps the side of the second by a hair only."""
    blocks = over_a_joint(0.0, 0.0, 5e-5)
    constraints = {
        (int(constraint.a), int(constraint.b)): constraint for constraint in manifolds(posed(blocks), blocks)
    }
    for first in (0, 1):
        constraint = constraints[first, 2]
        if constraint.reach != AWAY:
            assert (constraint.nx, constraint.ny) == pytest.approx((0.0, -1.0), abs=1e-12)
    assert constraints[0, 2].reach == TOUCHING


@pytest.mark.parametrize("ground", ["half-plane", "piece", "block"])
@pytest.mark.parametrize(("outline", "halfway"), [(HEXAGON, -30.0), (BRICK, -45.0), ((), -45.0)])
def test_impulses_go_with_the_corner_that_a_block_rolls_over(outline: Corners, halfway: float, ground: str) -> None:
    """What carried one face at the right carries the next face at the left; the new corner has none."""
    level = 1.0 if ground == "block" else 0.0
    table = [Block(0.0, level - 0.1, width=1.0, height=0.2, fixed=True)] if level else []
    profile = {"profile": [[-1, 0], [1, 0]]} if ground == "piece" else {}
    scene = posed([Block(outline=outline), *table], ground=profile)
    pivot: list[str] = []
    corners: list[int] = []
    constraint: Any = None
    for degrees in (halfway + 1.0, halfway - 1.0):
        angle = math.radians(degrees)
        block = Block(0.0, level + depth_below(outline or BRICK, angle) - 1e-6, angle, outline=outline)
        place(scene, [block, *table])
        scene.world.clock[0].rebuilds = 0
        scene = listed(scene)
        constraints = listed_constraints(scene)
        find_manifolds(scene, 0, constraints.size)
        (constraint,) = [constraint for constraint in constraints if constraint.reach != AWAY and constraint.a == 0]
        if not pivot:
            pressed = "one" if constraint.gap_one < constraint.gap_two else "two"
            constraint[f"normal_{pressed}"] = 3.0
            constraint.shear = 1.0
        pivot.append("one" if constraint.gap_one < constraint.gap_two else "two")
        corners.append(int(constraint[f"corner_{pivot[-1]}"]))
    assert pivot[0] != pivot[1]
    assert corners[0] == corners[1]
    assert constraint[f"normal_{pivot[1]}"] == 3.0
    assert constraint[f"normal_{pivot[0]}"] == 0.0
    assert constraint.shear == 1.0
