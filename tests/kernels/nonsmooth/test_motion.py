"""What happens to bodies one by one: kicks, drifts, poses at the end of a step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.nonsmooth.arrays import BEFORE, STATE
from blocksim.kernels.nonsmooth.motion import drift, is_in_flight, kick, kick_warm, place

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Records
    from tests.kernels.conftest import MakeBody

H = 1e-3
KICK = (0.5 * H, -9.0 * H)


def kicked(vx: float, vy: float, spin: float, share: float) -> tuple[Records, Records]:
    """Return the state of a free body after a share of a kick, and what is kept from before the substep."""
    states, before = zeros(1, STATE), zeros(1, BEFORE)
    one = states[0]
    one.vx, one.vy, one.spin, one.inverse_mass, one.inverse_inertia = vx, vy, spin, 10.0, 1e4
    kick(states, before, 0, 1, share, *KICK)
    return states, before


@given(share=st.sampled_from([0.5, 1.0]), vx=st.floats(-3.0, 3.0), vy=st.floats(-3.0, 3.0))
def test_kick_adds_its_share_of_gravity_and_remembers_the_velocity(share: float, vx: float, vy: float) -> None:
    (one,), (before,) = kicked(vx, vy, 7.0, share)
    assert (before.vx, before.vy, before.spin) == (vx, vy, 7.0)
    assert (one.vx, one.vy, one.spin) == pytest.approx((vx + share * KICK[0], vy + share * KICK[1], 7.0), abs=1e-15)


@pytest.mark.parametrize("last", [0.5, 1.0])
def test_warm_kick_gives_again_what_impulses_gave_and_one_whole_kick(last: float) -> None:
    states, kept = kicked(1.0, -2.0, 3.0, last)
    one, before = states[0], kept[0]
    pushed = np.array([0.1, 0.4, -5.0])
    one.vx, one.vy, one.spin = np.array([one.vx, one.vy, one.spin]) + pushed
    now = np.array([one.vx, one.vy, one.spin])
    kick_warm(states, kept, 0, 1, last, *KICK)
    assert [one.vx, one.vy, one.spin] == pytest.approx(now + pushed + (*KICK, 0.0), abs=1e-14)
    assert [before.vx, before.vy, before.spin] == now.tolist()


def test_drift_moves_by_velocity_times_time() -> None:
    states = zeros(3, STATE)
    states.vx, states.vy, states.spin = (1.0, 2.0, 3.0), (-1.0, 0.5, 4.0), (10.0, 20.0, 30.0)
    for _ in range(2):
        drift(states, 1, 3, H)
    assert states.dx.tolist() == pytest.approx([0.0, 4e-3, 6e-3])
    assert states.dy.tolist() == pytest.approx([0.0, 1e-3, 8e-3])
    assert states.turned.tolist() == pytest.approx([0.0, 0.04, 0.06])


@pytest.mark.parametrize("turned", [1e-4, -0.3])
@pytest.mark.parametrize("is_touching", [False, True])
def test_step_ends_with_the_pose_that_the_drifts_add_up_to(
    make_body: MakeBody, turned: float, is_touching: bool
) -> None:
    """Velocities of bodies in flight are brought up by half a kick; a support holds against that."""
    body = make_body(0.2, 0.1, 0.6)
    (one,), (before,) = kicked(1.0, -2.0, 3.0, 1.0)
    one.vy += 0.1 * is_touching
    one.dx, one.dy, one.turned = 0.01, -0.02, turned
    velocity = np.array([one.vx, one.vy, one.spin])
    place(body, one, before, 1.0, (*KICK, 0.0))
    assert (body.x, body.y, body.angle) == pytest.approx((0.21, 0.08, 0.6 + turned), abs=1e-15)
    assert (body.cos, body.sin) == pytest.approx((math.cos(body.angle), math.sin(body.angle)), abs=1e-14)
    brought = np.array([0.0, 0.0, 0.0]) if is_touching else np.array([*KICK, 0.0]) / 2
    assert [body.vx, body.vy, body.spin] == pytest.approx(velocity + brought, abs=1e-15)
    assert (one.dx, one.dy, one.turned) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("extra", "flies"), [(0.0, True), (1e-7, False), (-1e-7, False)])
def test_body_is_in_flight_where_gravity_alone_has_changed_its_velocity(extra: float, flies: bool) -> None:
    for name in ("vx", "vy"):
        (one,), (before,) = kicked(1.0, -2.0, 3.0, 1.0)
        one[name] += extra
        assert bool(is_in_flight(one, before, *KICK)) is flies
