"""Geometry of the kinds of structure, against the numbers one would measure with a ruler."""

import pytest

from blocksim.scenario import Block
from blocksim.scenario.structures import KINDS, Stack, Staircase, UnfitError

BRICK = Block(width=0.032, height=0.025, length=0.05, material="aluminium")


def test_every_kind_is_registered_under_its_own_name() -> None:
    assert {"staircase": Staircase, "stack": Stack} == KINDS


def test_blocks_of_a_staircase_overlap_by_the_overlap() -> None:
    poses = Staircase(kind="staircase", block="brick", count=4, overlap=0.01, left=0.1).place(BRICK)
    lefts = [pose.x - 0.016 for pose in poses]
    assert lefts == pytest.approx([0.1, 0.122, 0.144, 0.166], abs=1e-15)
    assert [right + 0.032 - left for left, right in zip(lefts[1:], lefts[:-1], strict=True)] == pytest.approx(
        [0.01] * 3
    )
    assert [pose.y - 0.0125 for pose in poses] == pytest.approx([0.0, 0.025, 0.05, 0.075], abs=1e-15)


def test_a_staircase_of_full_overlap_is_a_straight_stack() -> None:
    stairs = Staircase(kind="staircase", block="brick", count=3, overlap=0.032).place(BRICK)
    assert stairs == Stack(kind="stack", block="brick", count=3).place(BRICK)


@pytest.mark.parametrize("bottom", [0.1, -0.025])
def test_a_structure_stands_at_its_bottom(bottom: float) -> None:
    on_ground = Stack(kind="stack", block="brick", count=2, offset=0.001).place(BRICK)
    raised = Stack(kind="stack", block="brick", count=2, offset=0.001, bottom=bottom).place(BRICK)
    stairs = Staircase(kind="staircase", block="brick", count=2, overlap=0.031, bottom=bottom).place(BRICK)
    assert [pose.y for pose in raised] == [pytest.approx(pose.y + bottom) for pose in on_ground]
    assert [(pose.x, pose.y) for pose in stairs] == [pytest.approx((pose.x, pose.y)) for pose in raised]


def test_more_overlap_than_block_is_refused() -> None:
    with pytest.raises(UnfitError, match="33 mm is more than the block's 32 mm along x") as caught:
        Staircase(kind="staircase", block="brick", count=3, overlap=0.033).place(BRICK)
    assert caught.value.key == "overlap"


@pytest.mark.parametrize("offset", [0.0, 0.0105, -0.004])
def test_a_stack_leans_by_its_offset(offset: float) -> None:
    poses = Stack(kind="stack", block="brick", count=5, left=-0.1, offset=offset).place(BRICK)
    assert [pose.x - 0.016 for pose in poses] == pytest.approx([-0.1 + i * offset for i in range(5)], abs=1e-15)
    assert [pose.y for pose in poses] == pytest.approx([0.025 * (i + 0.5) for i in range(5)], abs=1e-15)
