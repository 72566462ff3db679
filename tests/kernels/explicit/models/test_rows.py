"""Sums over one row of particles, against the trapezoid rule: the ends of a row have half a tributary length."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import POINT, zeros
from blocksim.kernels.explicit.models.smoothed import add_row
from blocksim.kernels.sph.functions import kernel_value
from blocksim.verification.scene import WIDTH

if TYPE_CHECKING:
    from tests.kernels.conftest import Pose

SPACING, ABOVE, LOWER = 2e-3, 1e-4, 0


@pytest.mark.parametrize("along", [0.0, 0.4 * SPACING, WIDTH / 2, WIDTH])
def test_weight_of_a_row_is_the_integral_of_the_kernel_along_it(pose: Pose, along: float) -> None:
    world = pose((0.0, 1.0, 0.0), contact={"model": "kernel", "particle_spacing": SPACING})
    body, controls, sums = world.bodies[0], world.controls[0], zeros(1, POINT)[0]
    add_row(along - body.half_x, -body.half_y - ABOVE, 1.0, body, LOWER, controls, sums)
    places = np.linspace(0.0, WIDTH, round(WIDTH / SPACING) + 1)
    values = [
        kernel_value(int(controls.sph_kernel), float(np.hypot(place - along, ABOVE)), float(controls.smoothing_length))
        for place in places
    ]
    assert sums.weight == pytest.approx(np.trapezoid(values, places), rel=1e-12)
