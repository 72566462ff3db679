"""Contact laws: force, stiffness and energy belong together, and restitution does not know the speed."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from blocksim.kernels.explicit.laws import (
    HERTZ_MINDLIN,
    LINEAR,
    dashpot_weight,
    elastic_force,
    stored_energy,
    tangent_stiffness,
)
from blocksim.scenario.laws import LAWS

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Simulation, Start


K = 9.5e8
DEPTHS = st.floats(1e-10, 1e-3)


@pytest.mark.parametrize("law", LAWS)
@given(depth=DEPTHS)
def test_force_is_the_slope_of_the_stored_energy(law: str, depth: float) -> None:
    exponent, h = LAWS[law].exponent, 1e-3 * depth
    slope = (stored_energy(exponent, K, depth + h) - stored_energy(exponent, K, depth - h)) / (2.0 * h)
    assert elastic_force(exponent, K, depth) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
@given(depth=DEPTHS)
def test_stiffness_is_the_slope_of_the_force(law: str, depth: float) -> None:
    exponent, h = LAWS[law].exponent, 1e-3 * depth
    slope = (elastic_force(exponent, K, depth + h) - elastic_force(exponent, K, depth - h)) / (2.0 * h)
    assert tangent_stiffness(exponent, K, depth) == pytest.approx(slope, rel=1e-6)


SOFT = {"law": "hertz-mindlin", "stiffness_scale": 1e-2, "max_overlap": 5e-3}


def test_sphere_on_a_plane_has_the_textbook_approach() -> None:
    """K. L. Johnson (1985), eq. 4.23: d = (9 F^2/(16 R E*^2))^(1/3)."""
    modulus, radius, force = 38e9, 1e-3, 10.0
    approach = (9.0 * force**2 / (16.0 * radius * modulus**2)) ** (1.0 / 3.0)
    assert elastic_force(HERTZ_MINDLIN, 4.0 / 3.0 * modulus * sqrt(radius), approach) == pytest.approx(force)


@given(begin=st.floats(0.0, 5.0), length=st.floats(0.1, 3.0), at=st.floats(0.1, 6.0))
@pytest.mark.parametrize(("law", "power"), [(LINEAR, 0.0), (HERTZ_MINDLIN, 0.25)])
def test_dashpot_weight_is_the_integral_of_its_coefficient(
    law: int, power: float, begin: float, length: float, at: float
) -> None:
    integral, _ = quad(lambda t: t**power, begin, begin + length)
    assert dashpot_weight(law, begin, begin + length, at) == pytest.approx(integral / at**power, rel=1e-6)


def dropped(start: Start, block: PaperBlock, speed: float, restitution: float) -> Simulation:
    """Throw a block down flat, without gravity, from just above the ground."""
    lying = {"y": block.height / 2 + 1e-9, "velocity": [0.0, -speed]}
    return start([lying], restitution=restitution, gravity=0.0, ground_friction=0.0, contact=SOFT)


@pytest.mark.parametrize("e", [0.0, 0.2, 0.5, 0.8])
def test_restitution_is_the_one_asked_at_any_speed(start: Start, paper_block: PaperBlock, e: float) -> None:
    for speed in (0.02, 0.5, 5.0):
        scene = dropped(start, paper_block, speed, e)
        while scene.contacts or scene.bodies[0].vy < 0.0:
            scene.to_step(scene.steps + 1)
        assert scene.bodies[0].vy == pytest.approx(e * speed, abs=0.01 * speed)
        assert scene.residual() < 1e-3
