"""Impacts beyond V3 to V6 and V16: the phase of a step at which a contact begins, and the particle spacing."""

from __future__ import annotations

from math import radians

import pytest

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Setting
from blocksim.verification.impacts import LANDINGS, SPACINGS
from blocksim.verification.scene import GOLDEN, HEIGHT, WIDTH, Throw, Thrower, kinetic_energy

TILT = radians(30.0)
BOTH = ["linear", pytest.param("hertz-mindlin", marks=pytest.mark.long)]
PHASES = tuple((GOLDEN * k) % 1.0 for k in range(14))  # of a step; zero begins exactly at one


@pytest.mark.parametrize("law", BOTH)
@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("landing", LANDINGS)
def test_where_in_a_step_a_contact_begins_does_not_matter(law: str, landing: str, e: float) -> None:
    thrower = Thrower(Setting(law=law), e)
    for phase in PHASES:
        body = thrower.throw(Throw(LANDINGS[landing], phase=phase))
        assert body.vy == pytest.approx(e, abs=0.005), f"at phase {phase}"
        assert abs(body.spin) * WIDTH < 1e-9


@pytest.mark.parametrize("landing", LANDINGS)
def test_particle_spacing_changes_no_bit_of_an_impact(landing: str) -> None:
    states = {
        Thrower(Setting(), 0.3, contact={"particle_spacing": spacing}).throw(Throw(LANDINGS[landing])).tobytes()
        for spacing in SPACINGS
    }
    assert len(states) == 1


@pytest.mark.parametrize("law", BOTH)
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("e", [0.3, 0.5, 0.8, 1.0])
def test_impact_beside_the_centre_loses_the_asked_share_of_its_energy(law: str, speed: float, e: float) -> None:
    """1 - e^2 of the energy along the normal, m_eff v^2/2.

    The ratio of normal velocities at the corner is e only while the block hardly turns during the impact: a soft Hertz
    contact at 10 m/s turns it by 3 degrees, its lever arm grows, and the corner leaves up to 0.07 v faster.
    """
    thrower = Thrower(Setting(law=law), e, speed)
    before = kinetic_energy(thrower.world.bodies[0])
    body = thrower.throw(Throw(TILT))
    arm = forms.lowest_corner(WIDTH, HEIGHT, TILT)[0]
    along_normal = 0.5 * speed**2 / (1.0 / body.mass + arm**2 / body.inertia)
    assert (before - kinetic_energy(body)) / along_normal == pytest.approx(1.0 - e**2, abs=0.004)
