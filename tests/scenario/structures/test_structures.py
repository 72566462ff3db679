"""Geometry of the kinds of structure, against the numbers one would measure with a ruler."""

from collections.abc import Mapping

import pytest

from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures import KINDS
from blocksim.scenario.structures.base import Pose, UnfitError
from blocksim.scenario.structures.masonry import Dominoes, Pyramid, Stack, Staircase

BRICK = Block(width=0.032, height=0.025, length=0.05, material="aluminium")


def test_blocks_of_a_staircase_overlap_by_the_overlap() -> None:
    poses = Staircase(kind="staircase", block="brick", count=4, overlap=0.01, left=0.1).place(BRICK)
    lefts = [pose.x - 0.016 for pose in poses]
    assert lefts == pytest.approx([0.1, 0.122, 0.144, 0.166], abs=1e-15)
    assert [right + 0.032 - left for left, right in zip(lefts[1:], lefts[:-1], strict=True)] == pytest.approx(
        [0.01] * 3
    )
    assert [pose.y - 0.0125 for pose in poses] == pytest.approx([0.0, 0.025, 0.05, 0.075], abs=1e-15)


def test_more_overlap_than_block_is_refused() -> None:
    with pytest.raises(UnfitError, match="33 mm is more than the block's 32 mm along x") as caught:
        Staircase(kind="staircase", block="brick", count=3, overlap=0.033).place(BRICK)
    assert caught.value.key == "overlap"


@pytest.mark.parametrize("offset", [0.0, 0.0105, -0.004])
def test_a_stack_leans_by_its_offset(offset: float) -> None:
    poses = Stack(kind="stack", block="brick", count=5, left=-0.1, offset=offset).place(BRICK)
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


@pytest.mark.parametrize(("kind", "keys"), [(kind, keys) for kind, (keys, _) in SHAPES.items()])
@pytest.mark.parametrize(("left", "bottom"), [(0.0, 0.1), (-0.3, -0.025)])
def test_a_structure_stands_where_it_is_reported(
    kind: str, keys: Mapping[str, object], left: float, bottom: float
) -> None:
    here = KINDS[kind].model_validate({"kind": kind, "block": "brick", **keys})
    there = here.model_copy(update={"left": left, "bottom": bottom})
    for pose, moved in zip(here.place(BRICK), there.place(BRICK), strict=True):
        assert moved == pytest.approx(Pose(pose.x + left, pose.y + bottom, *pose[2:]), abs=1e-15)


@pytest.mark.parametrize(("kind", "keys", "height"), [(kind, *shape) for kind, shape in SHAPES.items()])
def test_every_structure_can_be_thrown_and_sheared(kind: str, keys: Mapping[str, object], height: float) -> None:
    rest = KINDS[kind].model_validate({"kind": kind, "block": "brick", "bottom": 0.7, **keys})
    moving = rest.model_copy(update={"velocity": (2.0, -1.0), "shear_velocity": 3.0})
    assert rest.height(BRICK) == pytest.approx(height)
    assert len(rest.start(BRICK)) == rest.size
    for pose, thrown in zip(rest.start(BRICK), moving.start(BRICK), strict=True):
        share = (pose.y - 0.7) / height
        assert thrown == pytest.approx(pose._replace(vx=pose.vx + 2.0 + 3.0 * share, vy=pose.vy - 1.0), abs=1e-14)
