"""Polygons that slide over one another: their force has no jump where another corner or face becomes the nearest."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.tolerances import FLAT
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.models.surface import near_slots
from blocksim.kernels.explicit.sides import cone_of
from blocksim.kernels.explicit.sliver_axes import nearest_axis
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from numpy.typing import NDArray

Outline = list[list[float]]
RADIUS, WAY, DEPTH = 0.02, 2e-4, 1e-5  # m
PLACES = 60
STEEP = 2e-3  # of the force: changes from one place to the next that may hide a jump


def regular(corners: int) -> Outline:
    return [[RADIUS * cos(2.0 * pi * k / corners), RADIUS * sin(2.0 * pi * k / corners)] for k in range(corners)]


ROUGH = [[-0.02, -0.004], [-0.006, -0.012], [0.012, -0.01], [0.018, 0.003], [0.004, 0.014], [-0.014, 0.01]]
SHAPES = {"triangle": regular(3), "square": regular(4), "hexagon": regular(6), "16-gon": regular(16), "rough": ROUGH}
PAIRS = [("triangle", "square"), ("square", "square"), ("hexagon", "hexagon"), ("hexagon", "16-gon")]
QUICKEST = ("triangle", "square", "linear")
PAIRS += [("16-gon", "16-gon"), ("rough", "16-gon"), ("rough", "rough"), ("triangle", "16-gon")]


class Pair:
    """Two free elastic polygons, of which the first is put anywhere, without any history."""

    def __init__(self, one: str, two: str, law: str) -> None:
        """Begin with the bodies apart."""
        self.outlines = SHAPES[one], SHAPES[two]
        bodies = [{"y": 1.0, "outline": self.outlines[0]}, {"x": 2.0 * RADIUS, "y": 1.0, "outline": self.outlines[1]}]
        scene = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact={"law": law, "max_overlap": 2e-3})
        self.world = scene.start().world
        self.a: Any = self.world.bodies[0]
        self.b: Any = self.world.bodies[1]
        self.pair: Any = self.world.pairs[0]
        self.pair.a, self.pair.b = 0, 1

    def put(self, place: NDArray[np.float64]) -> None:
        """Put the first body at x (m), y (m) and an angle (rad)."""
        self.a.x, self.a.y, self.a.angle = place
        self.a.cos, self.a.sin = cos(place[2]), sin(place[2])

    def force(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the force (N) on the first body, and its torque (N m) over the radius."""
        self.put(place)
        self.pair.active = self.pair.is_sliver = self.pair.duplicates = 0
        renew_dashpots(self.pair)
        self.pair.near = near_slots(self.world, 0, 1, RADIUS, self.world.candidates[0])
        pair_forces(self.world, 0, 0.0)
        action = self.world.action[0]
        return np.array([action.fx, action.fy, action.torque_a / RADIUS])

    def features(self, place: NDArray[np.float64]) -> tuple[bool, int, int]:
        """Return the nearest face and corner."""
        self.put(place)
        nearest = nearest_axis(self.a, self.b, self.world.corners)
        return nearest.of_b, int(nearest.face), int(nearest.corner)

    def way(self, share: float, ends: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a place where corners of both meet, and the way along the face of b that leads over it.

        A face of the first body is tilted against it by a share of the cone.
        """
        sine = share * float(cone_of(self.a, self.b, self.world.corners))
        at_a, at_b = (self.world.corners[int(body.first_corner) :] for body in (self.a, self.b))
        side, corner = at_b[ends[1]], at_a[ends[0]]
        turn = atan2(side.ny, side.nx) + pi - atan2(corner.ny, corner.nx) + sine
        x, y = cos(turn) * corner.x - sin(turn) * corner.y, sin(turn) * corner.x + cos(turn) * corner.y
        last = at_b[(ends[1] + 1) % int(self.b.corner_count)]
        meet = [self.b.x + last.x - x - DEPTH * side.nx, self.b.y + last.y - y - DEPTH * side.ny, turn]
        return np.array(meet), np.array([-side.ny, side.nx, 0.3])


def largest_jump(pair: Pair, low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return the jump of force between two places, as a share of it: what is left as they approach one another."""
    before, after = pair.force(low), pair.force(high)
    size = max(hypot(*before[:2]), hypot(*after[:2]))
    while np.linalg.norm(after - before) > STEEP * size and np.abs(high - low).max() > 1e-12:
        middle = 0.5 * (low + high)
        between = pair.force(middle)
        if np.linalg.norm(between - before) > np.linalg.norm(after - between):
            high, after = middle, between
        else:
            low, before = middle, between
    change = float(np.linalg.norm(after - before))
    return change / size if change > STEEP * size else 0.0


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_force_does_not_jump_where_corners_pass_one_another(one: str, two: str, law: str, pace: int) -> None:
    """Faces that are parallel, to within 0.01 rad, may turn the force by as much: so it is between rectangles."""
    if pace > 1 and (one, two, law) != QUICKEST:
        pytest.skip("takes half a minute without the compiler")
    pair = Pair(one, two, law)
    seen = set()
    for share in (0.15, 0.3, 0.5, 0.8):
        for ends in ((0, 0), (1, 1)):
            middle, way = pair.way(share, ends)
            places = middle + np.linspace(-WAY, WAY, PLACES)[:, np.newaxis] * way
            forces = [pair.force(place) for place in places]
            seen |= {(share, *pair.features(place)) for place, force in zip(places, forces, strict=True) if force.any()}
            for k in range(PLACES - 1):
                if np.linalg.norm(forces[k + 1] - forces[k]) > STEEP * max(map(np.linalg.norm, forces[k : k + 2])):
                    assert largest_jump(pair, places[k], places[k + 1]) < FLAT
    assert len(seen) > 8
