"""Polygons that overlap by a sliver: their energy is a function of their state, and their force its gradient."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.explicit import slivers
from blocksim.kernels.explicit.sliver_axes import nearest_axis
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.verification.scene import Simulation

Outline = list[list[float]]
RADIUS = 0.02  # m
STEPS = 250  # an impact takes some thirty


def regular(corners: int, turned: float = 0.0) -> Outline:
    angles = [turned + 2.0 * pi * k / corners for k in range(corners)]
    return [[RADIUS * cos(angle), RADIUS * sin(angle)] for angle in angles]


HEXAGON, ROUND, WEDGE = regular(6), regular(16, pi / 16), [[-0.03, -0.005], [0.03, -0.005], [0.0, 0.01]]
NEEDLE = [[-0.02, 0.0], [0.01, -3e-4], [0.01, 3e-4]]
# shape and angle of two free blocks, how far the upper one is beside the lower one, stiffness scale
SLIVERS: dict[str, tuple[Outline, float, Outline, float, float, float]] = {
    "hexagon on a 16-gon, soft": (ROUND, -7.232829e-4, HEXAGON, 6.718059e-4, 0.013818266, 0.01),
    "hexagon on a 16-gon": (ROUND, 1.752375e-4, HEXAGON, -6.494365e-7, 0.013897033, 1.0),
    "16-gon on a 16-gon": (ROUND, 4.272495e-5, ROUND, 6.295303e-5, -0.007622653, 0.01),
    "16-gon on a wedge": (WEDGE, 3.14154964, ROUND, 1.942500e-4, 0.033854872, 0.1),
    "wedge on a hexagon": (HEXAGON, 3.983529e-4, WEDGE, 3.1415e-3, 0.039957592, 1.0),
    "needle on a hexagon": (HEXAGON, 0.0, NEEDLE, -0.5 * pi + 0.01, 0.0099, 1.0),
}


def struck(name: str, law: str = "linear", **values: float) -> tuple[Simulation, float]:
    """Return a block that has struck a sliver of the face of another, and the kinetic energy (J) before."""
    below, angle, above, turn, x, scale = SLIVERS[name]
    high = max(sin(angle) * u + cos(angle) * v for u, v in below)
    low = min(sin(turn) * u + cos(turn) * v for u, v in above)
    bodies = [
        {"y": 0.1, "outline": below, "angle": angle},
        {"x": x, "y": 0.1 + high - low + 1e-6, "outline": above, "angle": turn, "velocity": [0.3, -1.0]},
    ]
    contact: dict[str, object] = {"stiffness_scale": scale, "law": law}
    run = CaseScene(bodies, gravity=0.0, contact=contact, **values).start()  # type: ignore[arg-type]
    before = run.kinetic
    run.to_step(STEPS)
    return run, before


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
@pytest.mark.parametrize("name", SLIVERS)
def test_elastic_impact_on_a_sliver_keeps_its_energy(name: str, law: str) -> None:
    """With stiffness that changes with the face such an impact returns up to sixty times what it began with."""
    run, before = struck(name, law, restitution=1.0, friction=0.0)
    assert run.mechanical == pytest.approx(before, rel=1e-3)


# shapes, and the power of the overlap in the energy of the law
PAIRS = {
    "hexagons": (HEXAGON, HEXAGON, 2.0),
    "16-gons": (ROUND, ROUND, 2.5),
    "wedges": (WEDGE, WEDGE, 2.5),
    "needle": (NEEDLE, ROUND, 2.0),
}
WAY, PLACES, DEPTH = 1e-3, 500, 1e-4  # m, -, m


def past_corner(one: Outline, two: Outline, angle: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (m, m, rad) of a body on a way on which its corner passes one of another at (1, 1), and the way."""
    length = hypot(*two[1])
    out_x, out_y = two[1][0] / length, two[1][1] / length
    turn = atan2(-out_y, -out_x) - atan2(one[0][1], one[0][0]) + angle
    x, y = cos(turn) * one[0][0] - sin(turn) * one[0][1], sin(turn) * one[0][0] + cos(turn) * one[0][1]
    start = np.array([1.0 + two[1][0] - DEPTH * out_x - x, 1.0 + two[1][1] - DEPTH * out_y - y, turn])
    way = np.array([out_y, -out_x, 0.05])
    return start + np.linspace(-0.5 * WAY, 0.5 * WAY, PLACES)[:, np.newaxis] * way, way


@pytest.mark.parametrize("name", PAIRS)
def test_energy_of_a_sliver_has_no_step_and_the_force_is_its_slope(name: str) -> None:
    """Along a way on which the nearest face changes: a step of the energy is no integral of a force."""
    one, two, power = PAIRS[name]
    world = CaseScene([{"y": 1.0, "outline": one}, {"x": 1.0, "y": 1.0, "outline": two}], gravity=0.0).start().world
    a: Any = world.bodies[0]
    b: Any = world.bodies[1]
    faces = set()
    for angle in (0.0, 0.03, 0.1):
        places, way = past_corner(one, two, angle)
        energies, slopes = np.zeros(PLACES), np.zeros(PLACES)
        for i, place in enumerate(places):
            a.x, a.y, a.angle = place
            a.cos, a.sin = cos(place[2]), sin(place[2])
            nearest = nearest_axis(a, b, world.corners)
            if nearest.depth > 0.0:
                found = slivers.mean_energy(nearest, power, a, b, world.corners)
                energies[i] = found.value
                slopes[i] = found.x * way[0] + found.y * way[1] + found.turn * way[2]
                faces.add((angle, nearest.of_b, nearest.face))
        work = 0.5 * (slopes[1:] + slopes[:-1]) * WAY / (PLACES - 1)
        assert np.abs(np.diff(energies) - work).max() < 3e-3 * energies.max()
    assert len(faces) > 3
