"""Restitution beyond case V4: the phase of a step at which a contact begins, and the particle spacing."""

from __future__ import annotations

import pytest

from blocksim.verification.case import Setting
from blocksim.verification.flight import SPACINGS
from blocksim.verification.restitution import LANDINGS
from blocksim.verification.scene import WIDTH
from blocksim.verification.throws import GOLDEN, Throw, Thrower

PHASES = tuple((GOLDEN * k) % 1.0 for k in range(1, 14))  # of a step


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
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
