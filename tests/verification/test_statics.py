"""Blocks that must stand: exactly aligned stacks (V2, V13 and V14 are cases)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.verification import closed_forms as forms

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start


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
