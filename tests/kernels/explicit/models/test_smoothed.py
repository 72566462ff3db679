"""The kernel model: flat faces are flat at any spacing, edges end where they end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.verification.scene import WIDTH

if TYPE_CHECKING:
    from tests.kernels.explicit.models.conftest import Touch

WIDE = 2.2 * WIDTH
SPACINGS = [0.5e-3, 1e-3, 2e-3, 4e-3]
DEPTHS = st.floats(1e-9, 1e-4)


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("below", [None, WIDTH])
def test_face_has_the_stiffness_of_two_corners_at_any_spacing(
    touch: Touch, spacing: float, below: float | None
) -> None:
    corners, particles = (touch(model, spacing=spacing, below=below) for model in ("surface", "kernel"))
    assert len(corners.points) == 2
    assert len(particles.points) > WIDTH / spacing
    assert particles.wrench() == pytest.approx(corners.wrench(), abs=1e-18)


@pytest.mark.parametrize("spacing", SPACINGS)
def test_tilted_face_is_turned_back_by_its_rows_of_springs(touch: Touch, spacing: float) -> None:
    # springs spread over a face have a third of the moment that two of the same sum have at its ends
    tilt = 1e-6
    rocked = touch("kernel", spacing=spacing, below=None, depth=2e-6 + WIDTH * tilt, angle=tilt).wrench()
    assert rocked[1] == pytest.approx(2.0 * (2e-6 + 0.5 * WIDTH * tilt), rel=1e-6)
    intervals = WIDTH / spacing
    discrete = 1.0 + 2.0 / intervals**2  # the trapezoid rule over a parabola
    assert rocked[2] == pytest.approx(-2.0 * tilt * (WIDTH / 2) ** 2 / 3.0 * discrete, rel=1e-6)


@given(shift=st.floats(-0.6 * WIDTH, 0.6 * WIDTH), depth=DEPTHS, spacing=st.sampled_from(SPACINGS))
def test_block_sliding_along_a_flat_face_feels_no_bump(
    touch: Touch, shift: float, depth: float, spacing: float
) -> None:
    found = touch("kernel", shift=shift, depth=depth, spacing=spacing, below=WIDE)
    assert np.abs(found.normals[:, 0]).max() < 1e-12
    assert found.points.depth == pytest.approx(depth, rel=1e-6, abs=1e-16)
    is_own = found.points.slot < found.upper.particle_count
    assert found.points.share[is_own].sum() == pytest.approx(1.0, rel=1e-12)  # half of a face, wherever it stands


@given(angle=st.floats(0.15, 0.7), shift=st.floats(-0.5 * WIDTH, 0.5 * WIDTH), depth=DEPTHS)
def test_corner_on_a_flat_face_touches_it_to_its_true_depth(
    touch: Touch, angle: float, shift: float, depth: float
) -> None:
    found = touch("kernel", angle=angle, shift=shift, depth=depth, below=WIDE)
    own = found.points[found.points.slot < found.upper.particle_count]
    assert own.size == 2  # the corner is the last particle of one row and the first of the next
    assert own.depth == pytest.approx(depth, rel=1e-6, abs=1e-16)
    assert np.abs(own.nx).max() < 1e-12
    assert own.share.min() > 0.0
