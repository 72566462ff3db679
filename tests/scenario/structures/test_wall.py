"""Bond, holes and random shifts of a wall."""

from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Pose
from blocksim.scenario.structures.masonry import BlockWall

BRICK = Block(width=0.05, height=0.025, length=0.032, material="aluminium")


def courses(**keys: object) -> list[list[float]]:
    """Return the left edges (m) of the blocks of every course that has some, the lowest first."""
    wall = BlockWall.model_validate({"kind": "wall", "block": "brick", **keys})
    poses = wall.place(BRICK)
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


def placed(**keys: object) -> list[Pose]:
    wall = {"kind": "wall", "block": "brick", "rows": 30, "columns": 40, "gap": 0.002, **keys}
    return list(BlockWall.model_validate(wall).place(BRICK))


@pytest.mark.parametrize("keys", [{"missing": 0.3}, {"offset": 0.001}])
def test_a_seed_decides(keys: dict[str, object]) -> None:
    assert placed(**keys) == placed(**keys, seed=0)
    assert placed(**keys, seed=1) == placed(**keys, seed=1)
    assert placed(**keys, seed=1) != placed(**keys, seed=2)


def test_random_numbers_are_those_of_every_other_version_and_machine() -> None:
    """First numbers of PCG64(0), as numpy's documentation prints them for default_rng(0).random(3)."""
    poses = placed(offset=0.001)
    drawn = [0.5 + 0.5 * (pose.x - 0.025 - i * 0.052) / 0.001 for i, pose in enumerate(poses[:3])]
    assert drawn == pytest.approx([0.63696169, 0.26978671, 0.04097352], abs=1e-8)


def test_leaving_blocks_out_does_not_shift_the_others_differently() -> None:
    assert set(placed(offset=0.001, missing=0.5)) < set(placed(offset=0.001))


@given(seed=st.integers(0, 2**32 - 1), gap=st.floats(0.0, 0.01))
def test_the_largest_shifts_never_make_neighbours_overlap(seed: int, gap: float) -> None:
    for course in courses(rows=5, columns=20, gap=gap, offset=0.5 * gap, seed=seed):
        assert min(right - left for left, right in pairwise(course)) >= 0.05 - 1e-12
