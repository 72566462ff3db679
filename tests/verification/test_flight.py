"""Bounces beyond the cases: what must not have any influence (V3 itself is a case)."""

from __future__ import annotations

from blocksim.verification.case import Setting
from blocksim.verification.flight import SPACINGS, dropped


def test_particle_spacing_changes_no_bit_of_a_bounce() -> None:
    falls = [dropped(Setting(), spacing).to_time(0.15) for spacing in SPACINGS]
    assert len({fall.bodies.tobytes() for fall in falls}) == 1
    assert falls[0].bodies[0].vy > 0.0
