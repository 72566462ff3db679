"""Stacks, stairs, pyramids, dominoes, walls and grids, against the numbers one would measure with a ruler."""

import math
from collections.abc import Mapping
from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import PlacedBody
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.overlap import overlapping_pairs
from blocksim.scenario.structures import KINDS
from blocksim.scenario.structures.base import Pose, UnfitError
from blocksim.scenario.structures.masonry import BlockWall, Dominoes, Grid, Pyramid, Stack, Staircase

BRICK = Block(width=0.032, height=0.025, length=0.05, material="aluminium")
FLAT = Block(width=0.05, height=0.025, length=0.032, material="aluminium")


def test_a_stack_leans_by_its_offset_and_a_staircase_overlaps_by_its_overlap() -> None:
    stairs = Staircase(kind="staircase", block="brick", count=5, overlap=0.01, left=-0.1).place(BRICK)
    stacks = {o: Stack(kind="stack", block="brick", count=5, left=-0.1, offset=o) for o in (0.0, 0.0105, -0.004)}
    for offset, poses in ((0.022, stairs), *((offset, stack.place(BRICK)) for offset, stack in stacks.items())):
        assert [pose.x - 0.016 for pose in poses] == pytest.approx([-0.1 + i * offset for i in range(5)], abs=1e-15)
        assert [pose.y for pose in poses] == pytest.approx([0.025 * (i + 0.5) for i in range(5)], abs=1e-15)


@pytest.mark.parametrize("gap", [0.0, 0.004])
def test_every_course_of_a_pyramid_lies_in_the_middle_above_the_one_below(gap: float) -> None:
    poses = Pyramid(kind="pyramid", block="brick", rows=3, gap=gap).place(BRICK)
    pitch = 0.032 + gap
    assert [pose.x - 0.016 for pose in poses] == pytest.approx(
        [0.0, pitch, 2 * pitch, 0.5 * pitch, 1.5 * pitch, pitch], abs=1e-15
    )
    assert [pose.y for pose in poses] == pytest.approx([0.0125] * 3 + [0.0375] * 2 + [0.0625], abs=1e-15)


def test_dominoes_stand_apart_by_their_spacing() -> None:
    poses = Dominoes(kind="dominoes", block="brick", count=4, spacing=0.01).place(BRICK)
    assert [pose.x - 0.016 for pose in poses] == pytest.approx([0.0, 0.042, 0.084, 0.126], abs=1e-15)
    assert {pose.y for pose in poses} == {0.0125}
    assert {pose[2:] for pose in poses} == {(0.0, 0.0, 0.0, 0.0)}


@pytest.mark.parametrize("push", [0.2, -0.2])
def test_a_pushed_domino_turns_about_its_edge(push: float) -> None:
    first, *others = Dominoes(kind="dominoes", block="brick", count=3, spacing=0.01, push=push).place(BRICK)
    edge = 0.016 if push > 0 else -0.016  # from the centre
    assert first.vx - first.spin * -0.0125 == pytest.approx(0.0, abs=1e-15)  # velocity of the edge
    assert first.vy + first.spin * edge == pytest.approx(0.0, abs=1e-15)
    assert (first.vx, first.vy > 0.0) == (push, True)
    assert {pose[3:] for pose in others} == {(0.0, 0.0, 0.0)}


SHAPES = {
    "stack": ({"count": 4}, 0.1),
    "staircase": ({"count": 4, "overlap": 0.03}, 0.1),
    "wall": ({"rows": 4, "columns": 3, "missing": 0.2}, 0.1),
    "pyramid": ({"rows": 4}, 0.1),
    "dominoes": ({"count": 4, "spacing": 0.01, "push": 0.3}, 0.025),
    "grid": ({"rows": 4, "columns": 3, "gap_x": 0.01, "gap_y": 0.02, "offset": 0.001}, 0.16),
}


@pytest.mark.parametrize(("kind", "keys", "height"), [(kind, *shape) for kind, shape in SHAPES.items()])
def test_every_structure_stands_where_it_is_told_and_can_be_thrown_and_sheared(
    kind: str, keys: Mapping[str, object], height: float
) -> None:
    here = KINDS[kind].model_validate({"kind": kind, "block": "brick", **keys})
    for left, bottom in ((0.0, 0.1), (-0.3, -0.025)):
        there = here.model_copy(update={"left": left, "bottom": bottom})
        for pose, moved in zip(here.place(BRICK), there.place(BRICK), strict=True):
            assert moved == pytest.approx(Pose(pose.x + left, pose.y + bottom, *pose[2:]), abs=1e-15)
    rest = here.model_copy(update={"bottom": 0.7})
    moving = rest.model_copy(update={"velocity": (2.0, -1.0), "shear_velocity": 3.0})
    assert rest.height(BRICK) == pytest.approx(height)
    assert len(rest.start(BRICK)) == rest.size
    for pose, thrown in zip(rest.start(BRICK), moving.start(BRICK), strict=True):
        share = (pose.y - 0.7) / height
        assert thrown == pytest.approx(pose._replace(vx=pose.vx + 2.0 + 3.0 * share, vy=pose.vy - 1.0), abs=1e-14)


def courses(**keys: object) -> list[list[float]]:
    """Return the left edges (m) of the blocks of every course that has some, the lowest first."""
    wall = BlockWall.model_validate({"kind": "wall", "block": "brick", **keys})
    poses = wall.place(FLAT)
    assert wall.size == len(poses)
    heights = sorted({pose.y for pose in poses})
    return [[pose.x - 0.025 for pose in poses if pose.y == height] for height in heights]


@pytest.mark.parametrize("gap", [0.0, 0.002])
def test_every_second_course_of_a_running_bond_is_shifted_by_half_a_block(gap: float) -> None:
    pitch = 0.05 + gap
    even, odd = [0.0, pitch, 2 * pitch], [0.5 * pitch, 1.5 * pitch, 2.5 * pitch]
    found = courses(rows=3, columns=3, gap=gap)
    assert found == [pytest.approx(course, abs=1e-15) for course in (even, odd, even)]


def test_holes_are_counted_from_the_lower_left() -> None:
    found = courses(rows=3, columns=3, bond="stack", holes=((1, 1), (3, 2)))
    assert found == [pytest.approx(course, abs=1e-15) for course in ([0.05, 0.1], [0.0, 0.05, 0.1], [0.0, 0.1])]


@pytest.mark.parametrize(("missing", "left"), [(0.0, 21), (0.1, 19), (0.5, 11), (0.93, 1)])
def test_a_share_of_the_blocks_beside_the_holes_is_left_out(missing: float, left: int) -> None:
    holes = ((1, 1), (2, 2), (4, 6))
    found = courses(rows=4, columns=6, bond="stack", holes=holes, missing=missing)
    assert sum(map(len, found)) == left
    assert not any(x == pytest.approx(0.0) for x in found[0] if missing < 0.6)


def wall_of(**keys: object) -> list[Pose]:
    wall = {"kind": "wall", "block": "brick", "rows": 30, "columns": 40, "gap": 0.002, **keys}
    return list(BlockWall.model_validate(wall).place(FLAT))


def test_a_seed_decides_and_leaving_blocks_out_does_not_shift_the_others_differently() -> None:
    for keys in ({"missing": 0.3}, {"offset": 0.001}):
        assert wall_of(**keys) == wall_of(**keys, seed=0)
        assert wall_of(**keys, seed=1) == wall_of(**keys, seed=1)
        assert wall_of(**keys, seed=1) != wall_of(**keys, seed=2)
    assert set(wall_of(offset=0.001, missing=0.5)) < set(wall_of(offset=0.001))


def test_random_numbers_are_those_of_every_other_version_and_machine() -> None:
    """First numbers of PCG64(0), as numpy's documentation prints them for default_rng(0).random(3)."""
    poses = wall_of(offset=0.001)
    drawn = [0.5 + 0.5 * (pose.x - 0.025 - i * 0.052) / 0.001 for i, pose in enumerate(poses[:3])]
    assert drawn == pytest.approx([0.63696169, 0.26978671, 0.04097352], abs=1e-8)


@given(seed=st.integers(0, 2**32 - 1), gap=st.floats(0.0, 0.01))
def test_the_largest_shifts_never_make_neighbours_overlap(seed: int, gap: float) -> None:
    for course in courses(rows=5, columns=20, gap=gap, offset=0.5 * gap, seed=seed):
        assert min(right - left for left, right in pairwise(course)) >= 0.05 - 1e-12


def grid_of(block: Block = FLAT, /, **keys: object) -> list[Pose]:
    grid = Grid.model_validate(
        {"kind": "grid", "block": "brick", "rows": 3, "columns": 4, "gap_x": 0.01, "gap_y": 0.02, **keys}
        | {"turn": f"{keys.get('turn', 0.0)!r} rad"}
    )
    poses = grid.place(block)
    assert grid.size == len(poses)
    return list(poses)


def test_blocks_lie_in_rows_and_columns() -> None:
    poses = grid_of()
    assert [pose.x - 0.025 for pose in poses] == pytest.approx([0.0, 0.06, 0.12, 0.18] * 3, abs=1e-15)
    assert [pose.y - 0.0125 for pose in poses] == pytest.approx([0.0] * 4 + [0.045] * 4 + [0.09] * 4, abs=1e-15)
    assert {pose.angle for pose in poses} == {0.0}
    assert len(grid_of(rows=1, gap_y=0.0, offset=0.001)) == 4  # a single row needs no distance to the next


def test_blocks_are_shifted_and_turned_as_far_as_asked() -> None:
    wide = {"rows": 30, "columns": 30, "gap_x": 0.1, "gap_y": 0.1}
    regular, random = grid_of(**wide), grid_of(**wide, offset=0.001, turn=0.3)
    assert random != grid_of(**wide, offset=0.001, turn=0.3, seed=6)
    changes = [(a.x - b.x, a.y - b.y, a.angle) for a, b in zip(random, regular, strict=True)]
    for change, most in zip(zip(*changes, strict=True), (0.001, 0.001, 0.3), strict=True):
        assert max(change) == pytest.approx(most, rel=0.02)
        assert min(change) == pytest.approx(-most, rel=0.02)
        assert max(map(abs, change)) <= most * (1 + 1e-12)


# angle, and the sides (m) of the box around a block that is turned by it, where that is as wide or high as it gets
TILTED = math.pi / 8
BOX_X = 0.05 * math.cos(TILTED) + 0.025 * math.sin(TILTED)
BOX_Y = 0.05 * math.sin(TILTED) + 0.025 * math.cos(TILTED)
DIAGONAL = math.hypot(0.05, 0.025)
SMALLEST = [
    (0.0, 0.0, 0.0),
    (TILTED, BOX_X - 0.05, BOX_Y - 0.025),
    (math.pi / 2, DIAGONAL - 0.05, DIAGONAL - 0.025),
    (math.pi, DIAGONAL - 0.05, DIAGONAL - 0.025),
]


@pytest.mark.parametrize(("turn", "gap_x", "gap_y"), SMALLEST)
@pytest.mark.parametrize("offset", [0.0, 0.002])
def test_gaps_too_small_for_shift_and_turn_are_refused(turn: float, gap_x: float, gap_y: float, offset: float) -> None:
    least = {"gap_x": gap_x + 2 * offset, "gap_y": gap_y + 2 * offset}
    grid_of(turn=turn, offset=offset, **{key: gap + 1e-9 for key, gap in least.items()})
    for key, gap in least.items():
        if gap > 0.0:
            with pytest.raises(UnfitError, match="is too small for such random shifts and angles") as caught:
                grid_of(turn=turn, offset=offset, **{**dict.fromkeys(least, 1.0), key: 0.999 * gap})
            assert caught.value.key == key


@given(
    seed=st.integers(0, 2**32 - 1), turn=st.floats(0.0, math.pi), offset=st.floats(0.0, 0.01), side=st.floats(0.01, 0.1)
)
def test_the_smallest_gaps_keep_all_blocks_apart(seed: int, turn: float, offset: float, side: float) -> None:
    block = Block(width=side, height=0.025, length=0.032, material="aluminium")
    widest, highest = (
        max(a * math.cos(t) + b * math.sin(t) for t in (turn * i / 1000 for i in range(1001)) if t <= math.pi / 2)
        for a, b in ((side, 0.025), (0.025, side))
    )
    gaps = {"gap_x": widest - side + 2 * offset + 1e-6, "gap_y": highest - 0.025 + 2 * offset + 1e-6}
    poses = grid_of(block, rows=6, columns=6, **gaps, offset=offset, seed=seed, turn=turn)
    bodies = [PlacedBody("b", "brick", "m", side, 0.025, 1.0, 1.0, *pose, fixed=False) for pose in poses]
    assert list(overlapping_pairs(bodies)) == []
