"""Pieces of a body that the dashpots of its pairs stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import NORMAL, SHEAR
from blocksim.kernels.common.tolerances import SHARE_PERIOD
from blocksim.kernels.explicit.inertia import piece_of
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from tests.conftest import Start
    from tests.kernels.conftest import MakeBody

JOINT = 0.004
K = 1e9


def test_two_pieces_have_together_mass_centre_and_inertia_of_the_body(make_body: MakeBody) -> None:
    body = make_body()
    stiffness, arms = np.array([0.7, 0.3]) * K, np.array([-0.003, 0.007])
    body.seats, body.k_yy, body.k_y = 2, stiffness.sum(), stiffness @ arms
    pieces = [piece_of(body, k, 0.0, 1.0, arm, NORMAL) for k, arm in zip(stiffness, arms, strict=True)]
    masses, centres = np.array([1.0 / piece.inverse_mass for piece in pieces]), np.array([p.arm for p in pieces])
    assert masses.sum() == pytest.approx(1.0 / body.inverse_mass)
    assert masses @ centres == pytest.approx(0.0, abs=1e-15)
    inertia = sum(1.0 / piece.inverse_inertia for piece in pieces) + masses @ centres**2
    assert inertia == pytest.approx(1.0 / body.inverse_inertia)
    shear = piece_of(body, stiffness[0], 0.0, 1.0, arms[0], SHEAR)
    assert shear == pytest.approx((body.inverse_mass / 0.7, body.inverse_inertia / 0.7, 0.0))


@pytest.mark.parametrize("seats", [0, 1, 2])
def test_pair_that_bears_alone_stands_for_the_whole_body(make_body: MakeBody, seats: int) -> None:
    body = make_body()
    body.seats, body.k_yy, body.k_y = seats, K if seats == 2 else 0.5 * K, 1e-3 * K
    assert piece_of(body, K, 0.0, 1.0, 5e-3, NORMAL) == (body.inverse_mass, body.inverse_inertia, 0.0)


def test_seats_are_known_before_a_block_comes_down_on_them(start: Start) -> None:
    left = {"x": JOINT - 0.05, "y": 0.5 * HEIGHT, "width": 0.1, "fixed": True}
    right = {"x": JOINT + 0.05, "y": 0.5 * HEIGHT, "width": 0.1, "fixed": True}
    block = {"y": 1.5 * HEIGHT + 1e-3, "velocity": [0.0, -1.0]}
    step = start([left, right, block], gravity=0.0).step
    block["y"] = 1.5 * HEIGHT + (3 * SHARE_PERIOD + 0.5) * step
    scene = start([left, right, block], gravity=0.0)
    body = scene.world.bodies[2]
    scene.to_step(3 * SHARE_PERIOD)
    assert scene.contacts == 0
    stiffness = 2.0 * float(scene.world.interactions[1, 1].normal_stiffness)
    assert (body.seats, body.k_xx) == (2, 0.0)
    assert body.k_yy == pytest.approx(stiffness)
    assert body.k_y == pytest.approx(0.0, abs=1e-9 * stiffness * WIDTH)
    scene.to_step(3 * SHARE_PERIOD + 2)
    assert scene.contacts == 4
