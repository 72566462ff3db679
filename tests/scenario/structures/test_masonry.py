"""Stacks, stairs, pyramids, dominoes, walls and grids, against the numbers one would measure with a ruler."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import PlacedBody
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.overlap import overlapping_pairs
from blocksim.scenario.overrides import freeze
from blocksim.scenario.structures import KINDS
from blocksim.scenario.structures.base import Pose, UnfitError
from blocksim.scenario.structures.masonry import BlockWall, Grid
from tests.golden import Golden

BRICK = Block(width=0.032, height=0.025, length=0.05, material="aluminium")
FLAT = Block(width=0.05, height=0.025, length=0.032, material="aluminium")


PLACED: dict[str, dict[str, object]] = tomllib.loads(Path(__file__).with_name("placed.toml").read_text())


def test_blocks_are_placed_as_one_would_measure_with_a_ruler(golden: Golden) -> None:
    """Left and lower edges of blocks of 32 by 25 mm, a row in a line, with other widths and how they move."""
    told = []
    for name, keys in PLACED.items():
        kind = name.split()[0]
        structure = KINDS[kind].model_validate(freeze({"kind": kind, "block": "brick", **keys}))
        rows: dict[str, list[str]] = {}
        for pose in structure.place(BRICK):
            moves = f" moves at ({pose.vx:g}, {pose.vy:.4g}) m/s, {pose.spin:.4g} rad/s" if any(pose[3:6]) else ""
            width = pose.width or BRICK.size_x
            cut = (
                ""
                if pose.width is None or abs(width - BRICK.size_x) < 1e-9
                else f" to {1e3 * (pose.x + 0.5 * width):g}"
            )
            left = f"{1e3 * (pose.x - 0.5 * width):g}"
            rows.setdefault(f"{1e3 * pose.y - 12.5:g}", []).append(f"{left}{cut}{moves}")
            assert pose.angle == 0.0
        told.append("\n  ".join([name, *(f"{y} mm: {', '.join(row)}" for y, row in rows.items())]))
    golden("\n".join(told))


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


def grid_of(block: Block = FLAT, /, **keys: object) -> list[Pose]:
    grid = Grid.model_validate(
        {"kind": "grid", "block": "brick", "rows": 3, "columns": 4, "gap_x": 0.01, "gap_y": 0.02, **keys}
        | {"turn": f"{keys.get('turn', 0.0)!r} rad"}
    )
    poses = grid.place(block)
    assert grid.size == len(poses)
    return list(poses)


def test_blocks_are_shifted_and_turned_as_far_as_asked() -> None:
    wide = {"rows": 30, "columns": 30, "gap_x": 0.1, "gap_y": 0.1}
    regular, random = grid_of(**wide), grid_of(**wide, offset=0.001, turn=0.3)
    assert len(grid_of(rows=1, gap_y=0.0, offset=0.001)) == 4  # a single row needs no distance to the next
    assert random != grid_of(**wide, offset=0.001, turn=0.3, seed=6)
    changes = [(a.x - b.x, a.y - b.y, a.angle) for a, b in zip(random, regular, strict=True)]
    for change, most in zip(zip(*changes, strict=True), (0.001, 0.001, 0.3), strict=True):
        assert max(change) == pytest.approx(most, rel=0.02)
        assert min(change) == pytest.approx(-most, rel=0.02)
        assert max(map(abs, change)) <= most * (1 + 1e-12)


# angle, and the sides (m) of the box around a block that is turned by it, where that is as wide or high as it gets
@given(
    seed=st.integers(0, 2**32 - 1), turn=st.floats(0.0, math.pi), offset=st.floats(0.0, 0.01), side=st.floats(0.01, 0.1)
)
def test_the_smallest_gaps_keep_all_blocks_apart_and_less_is_refused(
    seed: int, turn: float, offset: float, side: float
) -> None:
    block = Block(width=side, height=0.025, length=0.032, material="aluminium")
    widest, highest = (
        max(a * math.cos(t) + b * math.sin(t) for t in (turn * i / 1000 for i in range(1001)) if t <= math.pi / 2)
        for a, b in ((side, 0.025), (0.025, side))
    )
    gaps = {"gap_x": widest - side + 2 * offset + 1e-6, "gap_y": highest - 0.025 + 2 * offset + 1e-6}
    poses = grid_of(block, rows=6, columns=6, **gaps, offset=offset, seed=seed, turn=turn)
    bodies = [PlacedBody("b", "brick", "m", side, 0.025, 1.0, 1.0, *pose[:-1], fixed=False) for pose in poses]
    assert list(overlapping_pairs(bodies)) == []
    for key, gap in gaps.items():
        if gap > 0.001:
            with pytest.raises(UnfitError, match="is too small for such random shifts and angles") as caught:
                grid_of(block, **{**gaps, key: 0.998 * gap}, offset=offset, seed=seed, turn=turn)
            assert caught.value.key == key
