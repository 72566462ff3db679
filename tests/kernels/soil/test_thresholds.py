"""What is decided on each side of a tolerance of soil; without the compiler, as functions get bare numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from blocksim.kernels.common.jit import config
from blocksim.kernels.soil import contact

pytestmark = pytest.mark.skipif(not config.DISABLE_JIT, reason="calls kernels without records")
record: Any = SimpleNamespace


@pytest.mark.parametrize(("apart", "touches"), [(3e-4, True), (3e-3, False)])
def test_particle_that_nearly_touches_a_body_at_the_start_is_pressed_against_it(
    monkeypatch: pytest.MonkeyPatch, apart: float, touches: bool
) -> None:
    monkeypatch.setattr(contact, "from_body", lambda *_: (1.0 + apart, 0.0, 1.0))
    touch = record(particle=0, body=0, normal_force=0.0)
    ground: Any = record(contact_class=0)
    table: Any = {(0, 0): record(normal_stiffness=1e9)}
    soils = record(
        controls=[record(radius=1.0, touch_count=1)],
        touches=[touch],
        points=[record(x=0.0, y=1.0)],
        states=[record(kind=0, sxx=-1.0, sxy=0.0, syy=-1.0)],
        kinds=[record(density=1.0, volume=1.0)],
        interactions=table,
    )
    bodies = type("Rows", (list,), {"size": 1})([ground])
    contact.preload(soils, record(controls=[record(gravity_x=0.0, gravity_y=-1.0)], bodies=bodies))
    assert (touch.normal_force > 0.0) == touches
