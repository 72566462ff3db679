"""A grid of free blocks: distances, and that none can overlap however they are shifted and turned."""

import math

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import PlacedBody
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.overlap import overlapping_pairs
from blocksim.scenario.structures.base import Pose, UnfitError
from blocksim.scenario.structures.masonry import Grid

BRICK = Block(width=0.05, height=0.025, length=0.032, material="aluminium")


def placed(**keys: object) -> list[Pose]:
    grid = Grid.model_validate(
        {"kind": "grid", "block": "brick", "rows": 3, "columns": 4, "gap_x": 0.01, "gap_y": 0.02, **keys}
        | {"turn": f"{keys.get('turn', 0.0)!r} rad"}
    )
    poses = grid.place(BRICK)
    assert grid.size == len(poses)
    return list(poses)


def test_blocks_lie_in_rows_and_columns() -> None:
    poses = placed()
    assert [pose.x - 0.025 for pose in poses] == pytest.approx([0.0, 0.06, 0.12, 0.18] * 3, abs=1e-15)
    assert [pose.y - 0.0125 for pose in poses] == pytest.approx([0.0] * 4 + [0.045] * 4 + [0.09] * 4, abs=1e-15)
    assert {pose.angle for pose in poses} == {0.0}


def test_blocks_are_shifted_and_turned_as_far_as_asked() -> None:
    wide = {"rows": 30, "columns": 30, "gap_x": 0.1, "gap_y": 0.1}
    regular, random = placed(**wide), placed(**wide, offset=0.001, turn=0.3)
    assert random != placed(**wide, offset=0.001, turn=0.3, seed=6)
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
    placed(turn=turn, offset=offset, **{key: gap + 1e-9 for key, gap in least.items()})
    for key, gap in least.items():
        if gap > 0.0:
            with pytest.raises(UnfitError, match="is too small for such random shifts and angles") as caught:
                placed(turn=turn, offset=offset, **{**dict.fromkeys(least, 1.0), key: 0.999 * gap})
            assert caught.value.key == key


def test_a_single_row_needs_no_distance_to_the_next() -> None:
    assert len(placed(rows=1, gap_y=0.0, offset=0.001)) == 4


@given(
    seed=st.integers(0, 2**32 - 1), turn=st.floats(0.0, math.pi), offset=st.floats(0.0, 0.01), side=st.floats(0.01, 0.1)
)
def test_the_smallest_gaps_keep_all_blocks_apart(seed: int, turn: float, offset: float, side: float) -> None:
    block = Block(width=side, height=0.025, length=0.032, material="aluminium")
    widest, highest = (
        max(a * math.cos(t) + b * math.sin(t) for t in (turn * i / 1000 for i in range(1001)) if t <= math.pi / 2)
        for a, b in ((side, 0.025), (0.025, side))
    )
    grid = Grid.model_validate(
        {
            "kind": "grid",
            "block": "brick",
            "rows": 6,
            "columns": 6,
            "gap_x": widest - side + 2 * offset + 1e-6,
            "gap_y": highest - 0.025 + 2 * offset + 1e-6,
            "offset": offset,
            "seed": seed,
            "turn": f"{turn!r} rad",
        }
    )
    bodies = [PlacedBody("b", "brick", "m", side, 0.025, 1.0, 1.0, *pose, fixed=False) for pose in grid.place(block)]
    assert list(overlapping_pairs(bodies)) == []
