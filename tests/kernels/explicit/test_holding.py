"""Where contacts of polygons pass from a sliver of parallel faces to the faces beside them, the energy adds up."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING

import pytest

from blocksim.verification.scene import Scene

if TYPE_CHECKING:
    from blocksim.verification.scene import Simulation

Outline = list[list[float]]
RADIUS = 0.02  # m
STEPS = 250  # an impact takes some thirty


def regular(corners: int, turned: float = 0.0) -> Outline:
    angles = [turned + 2.0 * pi * k / corners for k in range(corners)]
    return [[RADIUS * cos(angle), RADIUS * sin(angle)] for angle in angles]


HEXAGON, ROUND, WEDGE = regular(6), regular(16, pi / 16), [[-0.03, -0.005], [0.03, -0.005], [0.0, 0.01]]
# shape and angle of two free blocks, how far the upper one is beside the lower one, stiffness scale, gain allowed
SLIVERS: dict[str, tuple[Outline, float, Outline, float, float, float, float]] = {
    "hexagon on a 16-gon, soft": (ROUND, -7.232829e-4, HEXAGON, 6.718059e-4, 0.013818266, 0.01, 0.03),
    "hexagon on a 16-gon": (ROUND, 1.752375e-4, HEXAGON, -6.494365e-7, 0.013897033, 1.0, 1e-3),
    "16-gon on a 16-gon": (ROUND, 4.272495e-5, ROUND, 6.295303e-5, -0.007622653, 0.01, 5e-3),
    "16-gon on a wedge": (WEDGE, 3.14154964, ROUND, 1.942500e-4, 0.033854872, 0.1, 0.1),
    "wedge on a hexagon": (HEXAGON, 3.983529e-4, WEDGE, 3.1415e-3, 0.039957592, 1.0, 0.2),
}


def struck(name: str, **values: float) -> tuple[Simulation, float]:
    """Return a block that has struck a sliver of the face of another, and the kinetic energy (J) before."""
    below, angle, above, turn, x, scale = SLIVERS[name][:-1]
    high = max(sin(angle) * u + cos(angle) * v for u, v in below)
    low = min(sin(turn) * u + cos(turn) * v for u, v in above)
    bodies = [
        {"y": 0.1, "outline": below, "angle": angle},
        {"x": x, "y": 0.1 + high - low + 1e-6, "outline": above, "angle": turn, "velocity": [0.3, -1.0]},
    ]
    run = Scene(bodies, gravity=0.0, contact={"stiffness_scale": scale}, **values).start()  # type: ignore[arg-type]
    before = run.kinetic
    run.to_step(STEPS)
    return run, before


@pytest.mark.parametrize("name", SLIVERS)
def test_elastic_impact_on_a_sliver_gains_next_to_nothing_and_the_ledger_has_it(name: str) -> None:
    """Without a bound such an impact returns up to fourteen times what it began with, and nothing tells."""
    run, before = struck(name, restitution=1.0, friction=0.0)
    assert run.world.ledger.broken.sum() != 0.0
    assert run.mechanical <= (1.0 + SLIVERS[name][-1]) * before
    assert run.residual() < 1e-4


@pytest.mark.parametrize("name", SLIVERS)
def test_ledger_closes_where_impacts_on_slivers_are_damped_and_rub(name: str) -> None:
    """The stiffness of a sliver changes by a tenth in a few steps: it is measured in each of them."""
    run, _ = struck(name, restitution=0.5, friction=0.3)
    assert run.world.ledger.dashpot.sum() > 0.0
    assert run.residual() < 1e-4
