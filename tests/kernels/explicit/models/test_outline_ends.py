"""Flat polygons whose corners pass one another at an end of their interval: energy and force keep to their state."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.tolerances import HAND_OVER
from blocksim.kernels.explicit.bearing import flat_within
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.models.surface import near_slots
from blocksim.kernels.explicit.sides import cone_of
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from numpy.typing import NDArray

Outline = list[list[float]]
RADIUS = 0.02  # m
STEPS = 250  # an impact takes some hundred


def regular(corners: int) -> Outline:
    return [[RADIUS * cos(2.0 * pi * k / corners), RADIUS * sin(2.0 * pi * k / corners)] for k in range(corners)]


ROUND, HEXAGON, SQUARE, WEDGE = regular(16), regular(6), regular(4), [[-0.03, -0.005], [0.03, -0.005], [0.0, 0.01]]
# found among random impacts: lower shape and its angle, upper shape, angle, how far beside and velocity, law, stiffness
FLAT: dict[str, tuple[Outline, float, Outline, float, float, tuple[float, float], str, float]] = {
    "both ends pass": (ROUND, 1.7672196, ROUND, -2.1598449, -5.8942658e-5, (0.29035, -0.48932), "hertz-mindlin", 0.01),
    "far beside": (ROUND, 2.1598449, ROUND, -1.7671459, -3.9678676e-4, (0.48721, -0.77405), "hertz-mindlin", 0.01),
    "wedge": (WEDGE, 0.46370318, SQUARE, 0.7853981634, 9.7123094e-3, (-0.26557, -0.73071), "hertz-mindlin", 0.01),
    "square on a 16-gon": (ROUND, 0.2034794, SQUARE, -2.3561340, -1.0387303e-2, (0.65204, -0.63654), "linear", 1.0),
    "16-gon on a hexagon": (HEXAGON, 2.0974033, ROUND, 2.5497385, 6.1218634e-3, (-0.31783, -0.22873), "linear", 0.01),
}


@pytest.mark.parametrize("name", FLAT)
def test_elastic_impact_keeps_its_energy_where_corners_pass_one_another(name: str) -> None:
    """With the stiffness of the way between outer corners it gains 1 %, at their depth it loses up to 0.3 %."""
    below, angle, above, turn, x, velocity, law, scale = FLAT[name]
    high = max(sin(angle) * u + cos(angle) * v for u, v in below)
    low = min(sin(turn) * u + cos(turn) * v for u, v in above)
    bodies: list[dict[str, object]] = [
        {"y": 0.2, "outline": below, "angle": angle},
        {"x": x, "y": 0.2 + high - low + 1e-6, "outline": above, "angle": turn, "velocity": list(velocity)},
    ]
    contact: dict[str, object] = {"stiffness_scale": scale, "law": law}
    run = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact=contact).start()
    before = run.kinetic
    run.to_step(STEPS)
    assert run.mechanical == pytest.approx(before, rel=1e-3)


DEEP = 2e-4  # m


def forces_along(ways: NDArray[np.float64], law: str, tilt: float) -> NDArray[np.float64]:
    """Return forces (N) and torques over the radius of a 16-gon that is led over the face of another, place by place.

    `ways` is how far its face is beside the other one, over the overlap; `tilt` its sine over that of parallel faces.
    """
    turn = pi / 16
    high = RADIUS * cos(turn)
    bodies = [{"y": 1.0 + 2.0 * high, "outline": ROUND, "angle": turn}, {"y": 1.0, "outline": ROUND, "angle": turn}]
    contact: dict[str, object] = {"law": law, "max_overlap": 10.0 * DEEP}
    world: Any = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact=contact).start().world
    a, b, pair = world.bodies[0], world.bodies[1], world.pairs[0]
    pair.a, pair.b = 0, 1
    sine = tilt * float(flat_within(cone_of(a, b, world.corners)))
    forces = []
    for way in ways:
        a.x, a.y, a.angle = way * DEEP - high * sine, 1.0 + 2.0 * high - DEEP, turn + sine
        a.cos, a.sin = cos(a.angle), sin(a.angle)
        renew_dashpots(pair)
        pair.near = near_slots(world, 0, 1, RADIUS, world.candidates[0])
        pair_forces(world, 0, 0.0)
        action = world.action[0]
        forces.append([action.fx, action.fy, action.torque_a / RADIUS])
    return np.array(forces)


@pytest.mark.parametrize("tilt", [-0.9, 0.5])
@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
def test_force_is_the_same_whichever_way_corners_have_passed(law: str, tilt: float) -> None:
    """But where they are nearer than the one in contact may stay: blunt ends let the outer one in for 2.4 overlaps."""
    beside = np.linspace(4.0 * HAND_OVER, 2.3, 12)
    ways = np.concatenate([-beside[::-1], beside])
    there = forces_along(ways, law, tilt)
    back = forces_along(ways[::-1], law, tilt)[::-1]
    assert np.abs(there[:, 1]).min() > 0.0
    assert back == pytest.approx(there, rel=1e-9, abs=1e-9 * np.abs(there).max())


def test_flush_corner_in_contact_stays_for_a_little() -> None:
    """Stacks that are flush to the last digits do not change their contacts at every step."""
    near = 0.005
    left, right = (forces_along(np.array([side, -near, near, -near]), "linear", 0.5)[1:] for side in (-1.0, 1.0))
    for one in (left, right):
        assert one[2] == pytest.approx(one[0], rel=1e-9)
        assert one[1, 1] == pytest.approx(one[0, 1], rel=1e-3)
    assert abs(left[0, 0] - right[0, 0]) > 1e-4 * left[0, 1]  # which corners are in contact
