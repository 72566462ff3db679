"""Velocities at contact points and how gaps bend, against gaps of the blocks as they move on."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.nonsmooth.arrays import FAR, STEPPING
from blocksim.kernels.nonsmooth.slip import Constraints, Motion, bend_of, bend_time, follow_curvature, slip_of
from tests.kernels.nonsmooth.references import brought_near, corners, meet, meeting, places_of, sides

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import Record
    from tests.kernels.conftest import MakeBody

MARGIN = 4e-3
TIME = 1e-4  # s: of finite differences
EXAMPLES = 40


class Moving(NamedTuple):
    """Two blocks of which a corner of one is near a face of the other, and how they move."""

    a: Record
    b: Record
    va: NDArray[np.float64]
    vb: NDArray[np.float64]
    constraint: Record
    is_of_b: bool
    corner: int  # of the one
    side: int  # of the other

    @property
    def constraints(self) -> Constraints:
        """The constraint as lanes have it."""
        return Constraints(*(float(self.constraint[name]) for name in Constraints._fields))

    @property
    def motion(self) -> Motion:
        """How they move; half a substep is a second."""
        vx, vy, _ = self.va - self.vb
        return Motion(float(vx), float(vy), float(self.va[2]), float(self.vb[2]), 0.0, 1.0)


def moved(body: Record, velocity: NDArray[np.float64], time: float, make_body: MakeBody) -> Record:
    x, y, angle = np.array([body.x, body.y, body.angle]) + time * velocity
    return make_body(x, y, angle, width=2 * body.half_x, height=2 * body.half_y)


@pytest.fixture(scope="module")
def examples(make_body: MakeBody) -> list[Moving]:
    """Return blocks that touch with one corner, half of them with a corner of body a."""
    random = np.random.default_rng(1)
    found: list[Moving] = []
    while len(found) < EXAMPLES:
        b = make_body(0.2, 0.1, random.uniform(-3.0, 3.0), width=0.05, height=0.03)
        angle, way, gap = b.angle + random.uniform(0.2, 1.3), random.uniform(-3.0, 3.0), random.uniform(-2e-4, 2e-4)
        a = brought_near(make_body, b, np.array([0.02, 0.03]), angle, way, gap)
        known = meeting(a, b, MARGIN)
        constraint = meet(a, b, MARGIN)
        if known.is_of_b == (len(found) % 2 == 0) and max(constraint.gap_one, constraint.gap_two) >= FAR:
            other, of, sign = (a, b, 1.0) if known.is_of_b else (b, a, -1.0)
            ways = np.abs(corners(other) - known.places[0]).sum(axis=1)
            side = int(np.argmax([one.normal @ known.normal * sign for one in sides(of)]))
            if ways.min() < 1e-3:  # no end of the reference face
                va, vb = random.normal(size=(2, 3)) * (1.0, 1.0, 20.0)
                found.append(Moving(a, b, va, vb, constraint, known.is_of_b, int(ways.argmin()), side))
    return found


def followed(one: Moving, make_body: MakeBody) -> list[float]:
    """Return the gap of the corner that touches (m) a short time before, now and a short time later."""
    gaps = []
    for k in (-1, 0, 1):
        a, b = moved(one.a, one.va, k * TIME, make_body), moved(one.b, one.vb, k * TIME, make_body)
        other, of = (a, b) if one.is_of_b else (b, a)
        side = sides(of)[one.side]
        gaps.append(float((corners(other)[one.corner] - side.begin) @ side.normal))
    return gaps


def test_gaps_change_as_the_points_move_and_bend_as_blocks_turn(examples: list[Moving], make_body: MakeBody) -> None:
    for one in examples:
        before, now, after = followed(one, make_body)
        slip = slip_of(one.constraints, *one.motion[:2], one.motion.spin_a, one.motion.spin_b)
        is_first = one.constraint.gap_one < FAR
        assert now == pytest.approx(min(one.constraint.gap_one, one.constraint.gap_two), abs=1e-12)
        rate = slip.one if is_first else slip.two
        assert (after - before) / (2.0 * TIME) == pytest.approx(rate, abs=1e-4)
        bend = bend_of(one.constraints, one.motion, one.is_of_b, not is_first)
        # the corner is taken for the point of the face below it; they are one where contacts press
        within = 0.02 + abs(now) * (abs(one.va[2]) + abs(one.vb[2])) ** 2
        assert (after - 2.0 * now + before) / TIME**2 == pytest.approx(bend.normal, abs=within)


def test_slip_is_that_of_the_places_on_both_bodies(examples: list[Moving]) -> None:
    for one in examples:
        n, t = np.array([one.constraint.nx, one.constraint.ny]), np.array([-one.constraint.ny, one.constraint.nx])
        expected = []
        for place in places_of(one.constraint, one.a, of_a=True):
            va, vb = (
                v[:2] + v[2] * np.array([body.y - place[1], place[0] - body.x])
                for body, v in ((one.a, one.va), (one.b, one.vb))
            )
            expected.append(va - vb)
        slip = slip_of(one.constraints, *one.motion[:2], one.motion.spin_a, one.motion.spin_b)
        assert (slip.one, slip.two) == pytest.approx([u @ n for u in expected], abs=1e-12)
        assert slip.shear == pytest.approx(expected[0] @ t, abs=1e-12)
        assert expected[1] @ t == pytest.approx(expected[0] @ t, abs=1e-12)


def test_point_that_sticks_is_drawn_to_both_centres(examples: list[Moving]) -> None:
    for one in examples:
        t = np.array([-one.constraint.ny, one.constraint.nx])
        for is_two in (False, True):
            place = places_of(one.constraint, one.a, of_a=True)[int(is_two)]
            drawn = [-(w**2) * (place - (body.x, body.y)) for body, w in ((one.a, one.va[2]), (one.b, one.vb[2]))]
            bend = bend_of(one.constraints, one.motion, one.is_of_b, is_two)
            assert bend.shear == pytest.approx((drawn[0] - drawn[1]) @ t, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_bends_add_up_to_a_parabola_about_the_middle_of_the_manifold(substeps: int) -> None:
    h, curvature = 1e-3, 7.0
    stepping = zeros(1, STEPPING)[0]
    stepping.substep, stepping.substeps = h, substeps
    middle, bend = (substeps - 1) * h / 2, curvature * h / 2

    def off(time: float) -> float:
        return 0.5 * curvature * (time - middle) ** 2

    assert bend * bend_time(stepping, 0) == pytest.approx(off(0.0), abs=1e-15)
    for number in range(substeps):
        follow_curvature(stepping, number)
        gained = h * stepping.bend_share * bend
        assert bend * stepping.bend_time == pytest.approx(off(number * h), abs=1e-15)
        assert bend * stepping.next_bend_time == pytest.approx(off((number + 1) * h), abs=1e-15)
        assert gained == pytest.approx(off((number + 1) * h) - off(number * h), abs=1e-15)
