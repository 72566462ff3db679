"""Contact manifolds: against polygons clipped another way, the impulses they keep, and how gaps bend."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import Record, zeros
from blocksim.kernels.nonsmooth.arrays import AWAY, CONSTRAINT, FAR, OPEN, STATE, STEPPING, TOUCHING, Nonsmooth
from blocksim.kernels.nonsmooth.faces import Edge, Face, clip
from blocksim.kernels.nonsmooth.slip import Constraints, Motion, bend_of, bend_time, follow_curvature, slip_of
from blocksim.scenario.geometry import Corners
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.kernels import references
from tests.kernels.references import corners, meet, places_of, sides, turning
from tests.kernels.scenes import (
    HEXAGON,
    Block,
    depth_below,
    find_all,
    listed,
    listed_constraints,
    make_body,
    place,
    posed,
    random_outline,
    rectangle,
    turned,
)

PAIRS = 25
BRICK = rectangle(WIDTH, HEIGHT)


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
    find_all(scene)
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


def plain(block: Block) -> Block:
    """Return the block whose outline is that of a rectangle."""
    width, height = 2.0 * np.array(block.outline).max(axis=0)
    return Block(block.x, block.y, block.angle, vx=block.vx, width=float(width), height=float(height))


def test_rectangles_given_as_outlines_have_the_same_manifolds() -> None:
    """One of every two."""
    random = np.random.default_rng(5)
    outlined = [block for pair in pairs(random, is_rectangle=True) for block in pair]
    rectangles = [plain(block) for block in outlined]
    others = [rectangles[i] if i % 2 else block for i, block in enumerate(outlined)]
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


@pytest.mark.parametrize("kind", ["polygons", "flush", "rectangles"])
def test_four_pairs_at_a_time_have_the_manifolds_that_each_has_alone(kind: str) -> None:
    """To the last bit, as threads divide pairs anywhere; of flush blocks corners meet."""
    random = np.random.default_rng(11)
    blocks = [block for pair in (*pairs(random), *pairs(random, is_rectangle=True)) for block in pair]
    if kind == "rectangles":
        blocks = [plain(block) for block in blocks[2 * PAIRS :]]
    if kind == "flush":
        blocks = [block for k in range(8) for block in over_a_joint(0.5 * k, 2.0, 1e-5 * (1 + k))]
    scene = posed(blocks)
    manifolds(scene, blocks)
    constraints = listed_constraints(scene)
    for impulse in (0.0, 1.0):  # which goes with corners that have changed places
        constraints["normal_one"], constraints["normal_two"], constraints["shear"] = impulse, 2.0 * impulse, impulse
        corners = constraints["corner_two"].copy(), constraints["corner_one"].copy()
        constraints["corner_one"], constraints["corner_two"] = corners
        before = constraints.copy()
        find_all(scene)
        together = constraints.copy()
        constraints[:] = before
        find_all(scene, part=1)
        near = together["reach"] != AWAY
        assert near.sum() >= 8
        assert constraints["reach"].tolist() == together["reach"].tolist()
        for name in CONSTRAINT.names or ():
            assert constraints[name][near].tolist() == together[name][near].tolist(), name


@pytest.mark.parametrize("pressed", [True, False])
def test_corners_meet_along_what_presses_a_third_body_and_else_where_they_overlap_least(pressed: bool) -> None:
    """A hexagon slides over the flush joint of two blocks, and overlaps the side of the second by a hair only."""
    blocks = over_a_joint(0.0, 0.0, 5e-5)
    scene = posed(blocks)
    constraints = {(int(one.a), int(one.b)): one for one in manifolds(scene, blocks)}
    assert constraints[0, 2].reach == TOUCHING
    constraints[0, 2].normal_one = 1.0 if pressed else 0.0
    find_all(scene)
    normal = (constraints[1, 2].nx, constraints[1, 2].ny)
    assert constraints[1, 2].reach == TOUCHING
    assert (normal == pytest.approx((0.0, -1.0), abs=1e-12)) is pressed


@pytest.mark.parametrize(
    ("sunk", "deep", "passes"), [(1e-4, 1.5e-4, True), (1e-4, 6e-4, False), (1e-6, 1.5e-5, True), (1e-6, 1e-4, False)]
)
def test_step_is_climbed_that_is_no_higher_than_contacts_are_deep_and_blocks_uneven(
    sunk: float, deep: float, passes: bool
) -> None:
    """A block has sunk into one and, past the joint by a hair, lies deeper (m) below the top of the next."""
    blocks = [Block(), Block(0.032, deep - sunk), Block(5e-7, 0.025 - sunk)]
    scene = posed(blocks)
    constraints = {(int(one.a), int(one.b)): one for one in manifolds(scene, blocks)}
    constraints[0, 2].normal_one = 1.0
    find_all(scene)
    assert (abs(float(constraints[1, 2].ny)) > 0.99) is passes


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
        find_all(scene)
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


MARGIN = 2e-3  # m


@pytest.mark.parametrize(("degrees", "is_kept"), [(24.0, True), (-24.0, True), (26.0, False), (180.0, False)])
def test_impulses_are_kept_until_the_normal_has_turned_by_25_degrees(degrees: float, is_kept: bool) -> None:
    constraint = zeros(1, CONSTRAINT)[0]
    constraint.normal_one, constraint.normal_two, constraint.shear = 3.0, 2.0, 1.0
    constraint.nx, constraint.ny = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    constraint = meet(make_body(0.0, 0.025), make_body(), MARGIN, constraint)
    expected = (3.0, 2.0, 1.0) if is_kept else (0.0, 0.0, 0.0)
    assert (constraint.normal_one, constraint.normal_two, constraint.shear) == expected


@pytest.mark.parametrize("pressed", [True, False])
def test_contact_that_presses_has_the_normal_and_arms_of_the_middle_of_the_step(pressed: bool) -> None:
    """One to come is taken as it is, one with an impulse of round-off too. Gaps are those of now, along that normal."""
    ahead = 1e-3
    a, b = make_body(0.004, 0.0262, 0.06), make_body(0.0, 0.0, 0.02)
    states, constraint = zeros(2, STATE), zeros(1, CONSTRAINT)[0]
    states.vx, states.vy, states.spin = (0.4, -0.1), (-0.3, 0.2), (8.0, -9.0)
    states.inverse_mass = 9.0
    constraint.normal_one, constraint.nx, constraint.ny = (
        (1e-8 if pressed else 1e-13),
        0.0,
        1.0,
    )  # 18/kg makes 1e-10 m/s
    stepping = {"touch_gap": 1e-14, "open_bias": 1e4, "substep": 1e-3}
    constraint = meet(a, b, MARGIN, constraint, states, ahead=ahead, stepping=stepping)
    time = ahead if pressed else 0.0
    late_a, late_b = (
        make_body(body.x + time * state.vx, body.y + time * state.vy, body.angle + time * state.spin)
        for body, state in zip((a, b), states, strict=True)
    )
    expected = meet(late_a, late_b, MARGIN)
    names = ["nx", "ny", "arm_a", "arm_b", "width", "shear_arm_a", "shear_arm_b"]
    assert [constraint[name] for name in names] == pytest.approx([expected[name] for name in names], abs=1e-6)
    rate = constraint.nx * 0.5 + constraint.ny * -0.5 + constraint.arm_a * 8.0 + constraint.arm_b * 9.0
    assert constraint.gap_one == pytest.approx(expected.gap_one - time * rate, abs=1e-7)
    assert constraint.gap_two == pytest.approx(expected.gap_two - time * (rate - constraint.width * 17.0), abs=1e-7)
    assert bool(constraint.bend != 0.0) is pressed


places = st.floats(-0.05, 0.05)


@given(left=places, width=st.floats(1e-4, 0.1), gap=places, rise=places, half=st.floats(0.005, 0.05), middle=places)
def test_clipped_edge_stays_on_its_line_and_over_the_face(
    left: float, width: float, gap: float, rise: float, half: float, middle: float
) -> None:
    face = Face(0.0, 1.0, 0.0, 0.0, 0.0, middle - half, middle + half)
    whole = Edge(left, gap, left + width, gap + rise, False, False)
    cut = clip(whole, face)
    if left >= face.right or left + width <= face.left:
        assert cut.left >= cut.right or math.isclose(cut.left, cut.right)
        return
    assert (cut.left, cut.right) == (max(left, face.left), min(left + width, face.right))
    for end, height in ((cut.left, cut.left_gap), (cut.right, cut.right_gap)):
        assert height == pytest.approx(gap + rise * (end - left) / width, abs=1e-12)
    # ends of the face can touch
    assert (bool(cut.is_left), bool(cut.is_right)) == (left < face.left, left + width > face.right)


TIME = 1e-4  # s: of finite differences


class Moving(NamedTuple):
    """Two blocks of which a corner of one is near the upper face of the other, and how they move."""

    bodies: tuple[Record, Record]  # a and b
    velocities: NDArray[np.float64]  # of both
    is_of_b: bool  # the face
    corner: int  # of the other one

    def gap(self, time: float) -> float:
        """Return how far (m) the corner is from the face after a time (s)."""
        moved = []
        for body, velocity in zip(self.bodies, self.velocities, strict=True):
            pose = np.array([body.x, body.y, body.angle]) + time * velocity
            moved.append(make_body(*pose, width=2 * body.half_x, height=2 * body.half_y))
        other, of = moved if self.is_of_b else moved[::-1]
        upper = sides(of)[2]
        return float((corners(other)[self.corner] - upper.begin) @ upper.normal)


def on_a_corner(random: np.random.Generator, is_of_b: bool) -> Moving:
    """Return a block that stands on a corner, on another block that is turned too."""
    below = make_body(0.2, 0.1, random.uniform(-3.0, 3.0), width=0.05, height=0.03)
    tilt, place = random.uniform(0.2, 1.3), (random.uniform(-0.02, 0.02), 0.015 + random.uniform(-2e-4, 2e-4))
    offsets = corners(make_body(0.0, 0.0, tilt, width=0.02, height=0.03))
    corner = int(offsets[:, 1].argmin())
    x, y = (below.x, below.y) + (np.array(place) - offsets[corner]) @ turning(below.angle)
    above = make_body(x, y, below.angle + tilt, width=0.02, height=0.03)
    bodies = (above, below) if is_of_b else (below, above)
    return Moving(bodies, random.normal(size=(2, 3)) * (1.0, 1.0, 20.0), is_of_b, corner)


@pytest.mark.parametrize("is_of_b", [True, False])
def test_gaps_change_and_bend_as_blocks_move_and_points_that_stick_are_drawn_to_both_centres(is_of_b: bool) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        one = on_a_corner(random, is_of_b)
        (a, b), (va, vb) = one.bodies, one.velocities
        constraint = meet(a, b, 1e-3)  # one point
        rows = Constraints(*(float(constraint[name]) for name in Constraints._fields))
        motion = Motion(float(va[0] - vb[0]), float(va[1] - vb[1]), float(va[2]), float(vb[2]), 0.0, 1.0)
        before, now, after = (one.gap(time) for time in (-TIME, 0.0, TIME))
        slip, is_first = slip_of(rows, *motion[:2], motion.spin_a, motion.spin_b), constraint.gap_one < FAR
        assert now == pytest.approx(min(constraint.gap_one, constraint.gap_two), abs=1e-12)
        assert (after - before) / (2.0 * TIME) == pytest.approx(slip.one if is_first else slip.two, abs=1e-4)
        # the corner is taken for the point of the face below it; they are one where contacts press
        within = 0.02 + abs(now) * (abs(va[2]) + abs(vb[2])) ** 2
        bend = bend_of(rows, motion, is_of_b, not is_first).normal
        assert (after - 2.0 * now + before) / TIME**2 == pytest.approx(bend, abs=within)
        tangent = np.array([-constraint.ny, constraint.nx])
        for is_two, at in enumerate(places_of(constraint, a, of_a=True)):
            drawn = [-(w**2) * (at - (body.x, body.y)) for body, w in ((a, va[2]), (b, vb[2]))]
            shear = bend_of(rows, motion, is_of_b, bool(is_two)).shear
            assert shear == pytest.approx((drawn[0] - drawn[1]) @ tangent, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_bends_add_up_to_a_parabola_about_the_middle_of_the_manifold(substeps: int) -> None:
    h, curvature = 1e-3, 7.0
    stepping = zeros(1, STEPPING)[0]
    stepping.substep, stepping.substeps = h, substeps
    middle, bend = (substeps - 1) * h / 2, curvature * h / 2

    def off(time: float) -> float:
        return 0.5 * curvature * (time - middle) ** 2

    assert bend * bend_time(stepping, 0) == pytest.approx(off(0.0), abs=1e-15)
    for number in range(substeps):
        follow_curvature(stepping, number)
        gained = h * stepping.bend_share * bend
        assert bend * stepping.bend_time == pytest.approx(off(number * h), abs=1e-15)
        assert bend * stepping.next_bend_time == pytest.approx(off((number + 1) * h), abs=1e-15)
        assert gained == pytest.approx(off((number + 1) * h) - off(number * h), abs=1e-15)
