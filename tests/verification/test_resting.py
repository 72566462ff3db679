"""Blocks that must stand: static overlap (V2), exactly aligned stacks, overhangs at their limit (V13)."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.analysis import closed_forms as forms

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tests.conftest import PaperBlock, Simulation, Start

SOFT = 0.01  # stiffness scale: ten times quicker; sags stay far below the margins, see `sag_shift`


@pytest.mark.parametrize("spacing", [5e-4, 1e-3, 4e-3])
def test_block_sinks_into_the_ground_by_weight_over_face_stiffness(
    start: Start, paper_block: PaperBlock, spacing: float
) -> None:
    rest = start([{"y": paper_block.height / 2}], contact={"particle_spacing": spacing}).to_time(0.02)
    expected = forms.static_overlap(paper_block.mass, 2.0 * paper_block.point_stiffness)
    assert paper_block.height / 2 - rest.bodies[0].y == pytest.approx(expected, rel=1e-3)
    assert rest.contacts == 2
    assert rest.slots[0, :2].depth == pytest.approx([expected, expected], rel=1e-3)


def test_particle_spacing_changes_no_bit_of_a_rest(start: Start, paper_block: PaperBlock) -> None:
    rests = [
        start([{"y": paper_block.height / 2}], contact={"particle_spacing": spacing}).to_time(1e-3)
        for spacing in (5e-4, 1e-3, 2e-3, 4e-3)
    ]
    assert len({rest.bodies.tobytes() for rest in rests}) == 1


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12, 1e-9, -1e-9])
def test_aligned_stack_stands_on_two_points_per_face(start: Start, paper_block: PaperBlock, offset: float) -> None:
    count = 4
    height = paper_block.height
    places = [{"x": offset * (i % 2), "y": (i + 0.5) * height} for i in range(count)]
    stack = start(places).to_time(0.05)
    assert stack.contacts == 2 * count
    sag_of_one = forms.static_overlap(paper_block.mass, 2.0 * paper_block.point_stiffness)
    tops = [0.0, *(float(y) for y in stack.bodies.y + height / 2)]
    for i, (below, body) in enumerate(zip(tops, stack.bodies, strict=False)):
        sag = below - (body.y - height / 2)
        assert sag == pytest.approx((count - i) * sag_of_one, rel=1e-3)
    assert np.abs(stack.bodies.x - [place["x"] for place in places]).max() < 1e-12
    assert np.abs(stack.bodies.angle).max() < 1e-9
    assert stack.kinetic < 1e-18


def has_fallen(stack: Simulation, block: PaperBlock, time: float) -> bool:
    """Tell whether anything has come down by a tenth of a block height, or moved at all worth noting if not."""
    before = stack.state()
    stack.to_time(time)
    drop = float((before[:, 1] - stack.bodies.y).max())
    moved = float(np.abs(stack.state()[:, :2] - before[:, :2]).max())
    assert drop > 0.1 * block.height or moved < 1e-5, "neither falls nor stands"
    return drop > 0.1 * block.height


def sag_shift(block: PaperBlock, count: int) -> float:
    """Return a bound (m) for the shift of a stack's centres by leaning on soft contacts.

    All the weight on one corner of every interface leans each block by less than count sags over half a width,
    and that moves the top by the angle times the height, once for every interface.
    """
    sag = count * forms.static_overlap(block.mass, SOFT * block.point_stiffness)
    return count * sag / (block.width / 2) * count * block.height


@pytest.mark.parametrize(("offset", "falls"), [(10.5e-3, False), (10.8e-3, True)])
def test_three_blocks_of_equal_offset_fall_beyond_a_third_of_the_width(
    start: Start, paper_block: PaperBlock, offset: float, falls: bool
) -> None:
    limit = forms.equal_offset_limit(3, paper_block.width)
    assert limit == pytest.approx(10.667e-3, abs=1e-6)
    assert sag_shift(paper_block, 3) < 0.05 * abs(offset - limit)
    places = [{"x": i * offset, "y": (i + 0.5) * paper_block.height} for i in range(3)]
    assert has_fallen(start(places, contact={"stiffness_scale": SOFT}), paper_block, 1.5) is falls


def overhanging(block: PaperBlock, share: float, count: int) -> Sequence[Mapping[str, object]]:
    """Return a fixed table and `count` blocks on it, each a share of the largest offset beyond the one below."""
    offsets = [share * offset for offset in reversed(forms.harmonic_offsets(count, block.width))]
    blocks: list[Mapping[str, object]] = [
        {"x": x, "y": (level + 0.5) * block.height} for level, x in enumerate(accumulate(offsets), start=1)
    ]
    return [{"y": 0.5 * block.height, "fixed": True}, *blocks]


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize(("share", "falls"), [(0.99, False), (1.01, True)])
def test_harmonic_overhang_falls_beyond_its_limit_only(
    start: Start, paper_block: PaperBlock, count: int, share: float, falls: bool
) -> None:
    smallest_margin = 0.01 * min(forms.harmonic_offsets(count, paper_block.width))
    assert sag_shift(paper_block, count) < 0.2 * smallest_margin
    stack = start(overhanging(paper_block, share, count), contact={"stiffness_scale": SOFT})
    assert has_fallen(stack, paper_block, 1.5) is falls
