"""Friction between its static and its kinetic value, the Coulomb cone, and shear springs that remember."""

from math import exp, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import INTERACTION, zeros
from blocksim.kernels.common.friction import friction_coefficient
from blocksim.kernels.explicit.friction import clip_to_cone, coulomb_limit, draw_same_spring, draw_spring
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, LINEAR, elastic_force, tangent_stiffness

STATIC, KINETIC, SPEED = 0.31, 0.19, 0.005


def rubbing() -> np.record:
    """Return what the kernels know about two surfaces that rub."""
    values: np.record = zeros(1, INTERACTION)[0]
    values.static_friction, values.kinetic_friction, values.transition_speed = STATIC, KINETIC, SPEED
    return values


def test_friction_of_fast_sliding_is_kinetic() -> None:
    assert friction_coefficient(STATIC, KINETIC, SPEED, 0.0) == STATIC
    assert friction_coefficient(STATIC, KINETIC, SPEED, 1.0) == KINETIC
    assert friction_coefficient(STATIC, KINETIC, SPEED, 39.9 * SPEED) == pytest.approx(KINETIC, abs=1e-15)
    assert friction_coefficient(0.38, 0.38, SPEED, 0.002) == 0.38


@given(speed=st.floats(-0.3, 0.3))
def test_friction_falls_exponentially_with_speed_either_way(speed: float) -> None:
    expected = KINETIC + (STATIC - KINETIC) * exp(-abs(speed) / SPEED)
    assert friction_coefficient(STATIC, KINETIC, SPEED, speed) == pytest.approx(expected, rel=1e-14)


@given(force=st.floats(0.0, 1e3), speed=st.floats(-0.05, 0.05), needed=st.floats(0.0, 1e3))
def test_limit_decides_as_the_full_formula_does(force: float, speed: float, needed: float) -> None:
    values = rubbing()
    exact = friction_coefficient(STATIC, KINETIC, SPEED, speed) * force
    limit = coulomb_limit(values, force, speed, needed)
    assert (needed > limit) == (needed > exact)
    if needed > limit:
        assert limit == exact
    assert limit <= STATIC * force


@given(force=st.floats(-1e3, 1e3), normal=st.floats(0.0, 1e3), speed=st.floats(-0.05, 0.05), spring=st.floats(0.0, 1.0))
def test_spring_and_dashpot_together_stay_within_the_cone(
    force: float, normal: float, speed: float, spring: float
) -> None:
    cone = friction_coefficient(STATIC, KINETIC, SPEED, speed) * normal
    limit = coulomb_limit(rubbing(), normal, speed, spring * cone)  # what the spring alone was within
    clipped = clip_to_cone(rubbing(), force, limit, normal, speed)
    assert clipped == (force if abs(force) <= cone else pytest.approx(np.copysign(cone, force), rel=1e-14))


@given(
    old=st.floats(-1e-6, 1e-6), slip=st.floats(-1e-6, 1e-6), normal=st.floats(0.0, 1.0), speed=st.floats(-0.02, 0.02)
)
def test_spring_of_the_same_stiffness_is_drawn_as_any_other(
    old: float, slip: float, normal: float, speed: float
) -> None:
    spring, limit, slides, lost = draw_same_spring(rubbing(), STIFFNESS, old, slip, normal, speed)
    expected = draw_spring(rubbing(), STIFFNESS, STIFFNESS, old, slip, 1.0, normal, speed)
    assert (spring, limit, slides) == expected[:3]
    assert lost == pytest.approx(expected[3], abs=1e-15 * STIFFNESS * 1e-12)
    assert slides or lost == 0.0


DEEPEST = 1e-5  # m
STIFFNESS = 1e6  # N/m, or N/m^1.5


class Dragged:
    """One point whose overlap and slip are prescribed, with its shear spring."""

    def __init__(self, law: float, friction: float) -> None:
        self.law, self.friction = law, friction
        self.values = zeros(1, INTERACTION)[0]
        self.values.shear_ratio = 0.8
        self.values.static_friction = self.values.kinetic_friction = friction
        self.values.transition_speed = 1e-3
        self.spring = self.stiffness = self.force = 0.0
        self.slides = False
        self.work = self.lost = 0.0

    @property
    def stored(self) -> float:
        """Energy (J) in the shear spring."""
        return 0.5 * self.stiffness * self.spring**2

    def reach(self, depth: float) -> float:
        """Return the longest spring (m) that sticks at an overlap (m)."""
        stiffness = 0.8 * tangent_stiffness(self.law, STIFFNESS, depth)
        return self.friction * elastic_force(self.law, STIFFNESS, depth) / stiffness

    def drag(self, depth: float, slip: float, drawn: float = 1.0) -> float:
        """Go to an overlap with a slip (m) of which `drawn` draws the spring; return what friction has taken (J)."""
        normal_force = elastic_force(self.law, STIFFNESS, depth)
        stiffness = 0.8 * tangent_stiffness(self.law, STIFFNESS, depth)
        before, energy = self.force, self.stored
        self.spring, limit, self.slides, lost = draw_spring(
            self.values, stiffness, self.stiffness, self.spring, slip, drawn, normal_force, 0.0
        )
        self.stiffness = stiffness
        self.force = clip_to_cone(self.values, stiffness * self.spring, limit, normal_force, 0.0)
        self.lost += lost
        self.work += 0.5 * (before + self.force) * slip
        assert lost == pytest.approx(0.5 * (before + self.force) * slip - (self.stored - energy), abs=1e-16)
        return lost


laws = pytest.mark.parametrize("law", [LINEAR, HERTZ_MINDLIN])
# overlaps as shares of the deepest one; slips as shares of the longest spring, or of twice that
paths = st.lists(st.tuples(st.floats(1e-3, 1.0), st.floats(-1.0, 1.0)), min_size=1, max_size=15)


@laws
@given(path=paths, friction=st.floats(0.01, 2.0))
def test_shear_spring_never_gives_back_more_than_was_put_in(
    law: int, path: list[tuple[float, float]], friction: float
) -> None:
    contact = Dragged(law, friction)
    scale = friction * elastic_force(law, STIFFNESS, DEEPEST) * DEEPEST
    for share, slip in path:
        depth = share * DEEPEST
        lost = contact.drag(depth, 0.0), contact.drag(depth, 2.0 * slip * contact.reach(depth))
        assert min(lost) >= -1e-15 * scale
        assert contact.work >= contact.stored - 1e-14 * scale
        limit = friction * elastic_force(law, STIFFNESS, depth)
        assert abs(contact.force) <= limit * (1.0 + 1e-12)


@given(first=st.floats(0.05, 1.0), second=st.floats(0.05, 1.0), slip=st.floats(-1.0, 1.0))
def test_growing_overlap_keeps_the_hertzian_shear_force_and_falling_overlap_lowers_it(
    first: float, second: float, slip: float
) -> None:
    contact = Dragged(HERTZ_MINDLIN, 1e6)
    contact.drag(first * DEEPEST, slip * DEEPEST)
    force = contact.force
    contact.drag(second * DEEPEST, 0.0)
    kept = min(1.0, sqrt(second / first))  # the stiffness goes with the root of the overlap
    assert contact.force == pytest.approx(kept * force, rel=1e-12)


@laws
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_steady_slip_costs_the_friction_force_times_the_way(law: int, way: float) -> None:
    contact = Dragged(law, 0.3)
    step = 0.05 * contact.reach(DEEPEST) * way
    for _ in range(40):
        contact.drag(DEEPEST, step)
    assert contact.slides
    lost, force = contact.lost, 0.3 * elastic_force(law, STIFFNESS, DEEPEST)
    for _ in range(100):
        contact.drag(DEEPEST, step)
    assert contact.lost - lost == pytest.approx(force * 100 * abs(step))
    assert contact.force == pytest.approx(way * force)
