"""Shares of corners in the stiffness of a face, and the pieces of a body that dashpots of its pairs stand for."""

from __future__ import annotations

from math import asin
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, SHEAR, SUPPORT
from blocksim.kernels.common.tolerances import CONE_TOLERANCE, FLAT, LEAST_SHARE, SHARE_PERIOD
from blocksim.kernels.explicit.bearing import bearing_along
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.inertia import piece_of
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.kernels.scenes import make_body, pose

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from tests.conftest import Start


UP = (0.0, 1.0)


@pytest.mark.parametrize(("shift", "slide"), [(0.01, 1.0), (-0.01, -1.0), (0.0, 0.0)])
def test_interval_is_what_of_two_faces_lies_opposite(shift: float, slide: float) -> None:
    a, b = make_body(x=0.1 + shift, y=1.0 + HEIGHT), make_body(x=0.1, y=1.0)
    found = bearing_along(a, b, *UP, None)[0]
    assert found.right - found.left == pytest.approx(WIDTH - abs(shift))
    assert found.per_length == pytest.approx(1.0 / WIDTH)
    assert found.slide == slide  # a goes along the tangent, to the left
    assert 0.5 * (found.left + found.right) == pytest.approx(-0.5 * shift)


@pytest.mark.parametrize(("fixed", "length"), [("a", 0.032), ("b", 0.02), ("", 0.032)])
def test_share_refers_to_the_face_of_the_free_body_and_of_two_to_the_longer(fixed: str, length: float) -> None:
    a, b = make_body(y=HEIGHT, width=0.02), make_body()
    for name, body in (("a", a), ("b", b)):
        if name == fixed:
            body.is_moved = SUPPORT
    assert bearing_along(a, b, *UP, None)[0].per_length == pytest.approx(1.0 / length)


@given(sine=st.floats(-0.3, 0.3), shift=st.floats(-0.031, 0.031))
def test_changes_of_a_share_are_its_derivatives(sine: float, shift: float) -> None:
    def share(slip: float = 0.0, turned: float = 0.0) -> float:
        a, b = make_body(x=shift - slip, y=HEIGHT, angle=asin(sine) + turned), make_body()
        return float(bearing_along(a, b, *UP, None)[1].share)

    a, b = make_body(x=shift, y=HEIGHT, angle=asin(sine)), make_body()
    bearing = bearing_along(a, b, *UP, None)[1]
    assert LEAST_SHARE <= bearing.share <= 1.0
    h = 1e-7
    if abs(shift) > 1e-3:  # no end passes the other's within the difference
        if abs(sine) <= FLAT:
            assert (share(slip=h) - share(slip=-h)) / (2.0 * h) == pytest.approx(bearing.slide, abs=1e-4)
        assert bearing.turn == 0.0 or abs(sine) > FLAT
    assert abs(sine) < CONE_TOLERANCE or (bearing.share, bearing.slide, bearing.turn) == (1.0, 0.0, 0.0)


def pushed(x: float, angle: float) -> np.ndarray:
    """Return the force (N) and torque (N m) on a block whose lower left corner lies 1 um deep in another one."""
    c, s = np.cos(angle), np.sin(angle)
    foot_x, foot_y = -0.5 * WIDTH * c + 0.5 * HEIGHT * s, -0.5 * WIDTH * s - 0.5 * HEIGHT * c
    world: World = pose((x - foot_x, 1.0 + 0.5 * HEIGHT - 1e-6 - foot_y, angle), (0.0, 1.0, 0.0))
    pair_forces(world, 0, 0.0)
    action = world.action[0]
    return np.array([action.fx, action.fy, action.torque_a])


@pytest.mark.parametrize(
    "angle", [1e-6 / 0.006, FLAT, CONE_TOLERANCE], ids=["other end lifts off", "tilts", "stands on its corner"]
)
def test_force_does_not_jump_while_a_block_tilts_onto_its_corner(angle: float) -> None:
    """The interval is 6 mm long: at 1 um over it the far end of the other block's face leaves the tilted one."""
    before, after = (pushed(0.01, angle * (1.0 + sign * 1e-7)) for sign in (-1.0, 1.0))
    assert before[1] > 0.0
    assert after == pytest.approx(before, abs=1e-4 * before[1])


JOINT = 0.004
K = 1e9


def test_two_pieces_have_together_mass_centre_and_inertia_of_the_body() -> None:
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
def test_pair_that_bears_alone_stands_for_the_whole_body(seats: int) -> None:
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
