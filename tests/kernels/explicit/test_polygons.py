"""Polygons on springs: slivers, corners that pass one another, ends of faces; energy is a function of their state."""

from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import World
from blocksim.kernels.common.tolerances import FLAT, HAND_OVER
from blocksim.kernels.explicit import slivers
from blocksim.kernels.explicit.bearing import flat_within
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.models.surface import near_slots
from blocksim.kernels.explicit.sides import MOST_CORNERS, cone_of
from blocksim.kernels.explicit.sliver_axes import Axis, nearest_axis
from blocksim.verification.scene import CaseScene, SteppedScene
from tests.contacts import contact_records

Outline = list[list[float]]
RADIUS = 0.02  # m
STEPS = 250  # an impact takes some thirty


def regular(corners: int, turned: float = 0.0) -> Outline:
    angles = [turned + 2.0 * pi * k / corners for k in range(corners)]
    return [[RADIUS * cos(angle), RADIUS * sin(angle)] for angle in angles]


def box(width: float, height: float) -> Outline:
    """Return a rectangle of some sides (mm)."""
    x, y = 0.5e-3 * width, 0.5e-3 * height
    return [[-x, -y], [x, -y], [x, y], [-x, y]]


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


def struck(
    below: Outline, angle: float, above: Outline, turn: float, x: float, speed: tuple[float, float], **contact: object
) -> tuple[SteppedScene, float]:
    """Return a block that has struck another one, elastic and smooth, and the kinetic energy (J) before."""
    high = max(sin(angle) * u + cos(angle) * v for u, v in below)
    low = min(sin(turn) * u + cos(turn) * v for u, v in above)
    bodies: list[dict[str, object]] = [
        {"y": 1.0, "outline": below, "angle": angle},
        {"x": x, "y": 1.0 + high - low + 1e-6, "outline": above, "angle": turn, "velocity": list(speed)},
    ]
    run = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact=contact).start()
    before = run.kinetic
    run.to_step(STEPS)
    return run, before


class Pair:
    """Two free elastic polygons, of which the first is put anywhere."""

    def __init__(self, one: Outline, two: Outline, law: str = "linear") -> None:
        """Begin with the bodies beside one another, the second at (1, 1)."""
        apart = sum(max(hypot(*corner) for corner in outline) for outline in (one, two))
        bodies = [{"x": 1.0 - apart, "y": 1.0, "outline": one}, {"x": 1.0, "y": 1.0, "outline": two}]
        scene = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact={"law": law, "max_overlap": 2e-3})
        self.world = scene.start().world
        self.a: Any = self.world.bodies[0]
        self.b: Any = self.world.bodies[1]
        self.pair: Any = self.world.pairs[0]
        self.pair.a, self.pair.b = 0, 1

    def put(self, place: NDArray[np.float64]) -> Axis:
        """Put the first body at x (m), y (m) and an angle (rad); return the axis on which it is nearest."""
        self.a.x, self.a.y, self.a.angle = place
        self.a.cos, self.a.sin = cos(place[2]), sin(place[2])
        return nearest_axis(self.a, self.b, self.world.corners)

    def force(self, place: NDArray[np.float64], *, remembers: bool = False) -> NDArray[np.float64]:
        """Return the force (N) on the first body, and its torque (N m) over the radius."""
        self.put(place)
        if not remembers:
            self.pair.active = self.pair.is_sliver = self.pair.duplicates = 0
        renew_dashpots(self.pair)
        self.pair.near = near_slots(self.world, 0, 1, RADIUS, self.world.candidates[0])
        pair_forces(self.world, 0, 0.0)
        action = self.world.action[0]
        return np.array([action.fx, action.fy, action.torque_a / RADIUS])

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
        meet = [self.b.x + last.x - x - SHALLOW * side.nx, self.b.y + last.y - y - SHALLOW * side.ny, turn]
        return np.array(meet), np.array([-side.ny, side.nx, 0.3])


# shapes, and the power of the overlap in the energy of the law
PAIRS = {
    "hexagons": (HEXAGON, HEXAGON, 2.0),
    "16-gons": (ROUND, ROUND, 2.5),
    "wedges": (WEDGE, WEDGE, 2.5),
    "needle": (NEEDLE, ROUND, 2.0),
}
WAY, PLACES, DEPTH = 1e-3, 500, 1e-4  # m, -, m


def at_corner(
    one: Outline, two: Outline, angle: float, depth: float
) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """Return the place (m, m, rad) of a body whose corner is so deep (m) in one of another at (1, 1); the way out."""
    length = hypot(*two[1])
    out_x, out_y = two[1][0] / length, two[1][1] / length
    turn = atan2(-out_y, -out_x) - atan2(one[0][1], one[0][0]) + angle
    x, y = cos(turn) * one[0][0] - sin(turn) * one[0][1], sin(turn) * one[0][0] + cos(turn) * one[0][1]
    return np.array([1.0 + two[1][0] - depth * out_x - x, 1.0 + two[1][1] - depth * out_y - y, turn]), (out_x, out_y)


def past_corner(one: Outline, two: Outline, angle: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (m, m, rad) of a body on a way on which its corner passes one of another at (1, 1), and the way."""
    start, (out_x, out_y) = at_corner(one, two, angle, DEPTH)
    way = np.array([out_y, -out_x, 0.05])
    return start + np.linspace(-0.5 * WAY, 0.5 * WAY, PLACES)[:, np.newaxis] * way, way


@pytest.mark.parametrize("name", PAIRS)
def test_energy_of_a_sliver_has_no_step_and_the_force_is_its_slope(name: str) -> None:
    """Along a way on which the nearest face changes: a step of the energy is no integral of a force."""
    one, two, power = PAIRS[name]
    pair, faces = Pair(one, two), set()
    for angle in (0.0, 0.03, 0.1):
        places, way = past_corner(one, two, angle)
        energies, slopes = np.zeros(PLACES), np.zeros(PLACES)
        for i, place in enumerate(places):
            nearest = pair.put(place)
            if nearest.depth > 0.0:
                found = slivers.mean_energy(nearest, power, pair.a, pair.b, pair.world.corners)
                energies[i] = found.value
                slopes[i] = found.x * way[0] + found.y * way[1] + found.turn * way[2]
                faces.add((angle, nearest.of_b, nearest.face))
        work = 0.5 * (slopes[1:] + slopes[:-1]) * WAY / (PLACES - 1)
        assert np.abs(np.diff(energies) - work).max() < 3e-3 * energies.max()
    assert len(faces) > 3


@pytest.mark.parametrize(("one", "two"), [(HEXAGON, HEXAGON), (WEDGE, HEXAGON)])
def test_energy_of_corners_that_are_round_off_deep_is_that_of_their_depth(one: Outline, two: Outline) -> None:
    """As of drawn stones that share a corner: by another sum the same depth is twice as much, or zero."""
    pair, random, found = Pair(one, two), np.random.default_rng(1), 0
    for angle in np.linspace(-0.3, 0.3, 400):
        nearest = pair.put(at_corner(one, two, float(angle), random.uniform(0.0, 4e-16))[0])
        if nearest.depth > 0.0:
            jet = slivers.mean_energy(nearest, 2.0, pair.a, pair.b, pair.world.corners)
            assert 0.0 < jet.value <= 1.5 * nearest.depth**2
            assert np.isfinite(jet).all()
            found += 1
    assert found > 200


PAST, SHALLOW = 2e-4, 1e-5  # m
STOPS = 60
STEEP = 2e-3  # of the force: changes from one place to the next that may hide a jump


ROUGH = [[-0.02, -0.004], [-0.006, -0.012], [0.012, -0.01], [0.018, 0.003], [0.004, 0.014], [-0.014, 0.01]]
SHAPES = {"triangle": regular(3), "square": regular(4), "hexagon": regular(6), "16-gon": regular(16), "rough": ROUGH}
MEETINGS = [("triangle", "square"), ("hexagon", "16-gon"), ("16-gon", "16-gon"), ("rough", "rough")]
QUICKEST = ("triangle", "square", "linear")


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
@pytest.mark.parametrize(("one", "two"), MEETINGS)
def test_force_does_not_jump_where_corners_pass_one_another(one: str, two: str, law: str, pace: int) -> None:
    """Faces that are parallel, to within 0.01 rad, may turn the force by as much: so it is between rectangles."""
    if pace > 1 and (one, two, law) != QUICKEST:
        pytest.skip("takes half a minute without the compiler")
    pair, seen = Pair(SHAPES[one], SHAPES[two], law), set()
    for share in (0.15, 0.3, 0.5, 0.8):
        for ends in ((0, 0), (1, 1)):
            middle, way = pair.way(share, ends)
            places = middle + np.linspace(-PAST, PAST, STOPS)[:, np.newaxis] * way
            forces = [pair.force(place) for place in places]
            nearest = [pair.put(place) for place, force in zip(places, forces, strict=True) if force.any()]
            seen |= {(share, one.of_b, int(one.face), int(one.corner)) for one in nearest}
            for k in range(STOPS - 1):
                if np.linalg.norm(forces[k + 1] - forces[k]) > STEEP * max(map(np.linalg.norm, forces[k : k + 2])):
                    assert largest_jump(pair, places[k], places[k + 1]) < FLAT
    assert len(seen) > 8


SIXTEEN, SQUARE = regular(16), regular(4)
# found among random impacts: lower shape and its angle, upper shape, angle, how far beside and velocity, law, stiffness
IMPACTS: dict[str, tuple[Outline, float, Outline, float, float, tuple[float, float], str, float]] = {
    "ends pass": (SIXTEEN, 1.7672196, SIXTEEN, -2.1598449, -5.8942658e-5, (0.29035, -0.48932), "hertz-mindlin", 0.01),
    "far beside": (SIXTEEN, 2.1598449, SIXTEEN, -1.7671459, -3.9678676e-4, (0.48721, -0.77405), "hertz-mindlin", 0.01),
    "wedge": (WEDGE, 0.46370318, SQUARE, 0.7853981634, 9.7123094e-3, (-0.26557, -0.73071), "hertz-mindlin", 0.01),
    "square on a 16-gon": (SIXTEEN, 0.2034794, SQUARE, -2.3561340, -1.0387303e-2, (0.65204, -0.63654), "linear", 1.0),
    "16-gon on a hexagon": (HEXAGON, 2.0974033, SIXTEEN, 2.5497385, 6.1218634e-3, (-0.31783, -0.22873), "linear", 0.01),
    # rectangles: the overlap is as deep as it is long
    "ends of rectangles": (box(22.4, 15.1), 0.0, box(36.7, 13.8), -0.0015, -0.0294, (0.0, -1.0), "linear", 0.003),
    "end of a rectangle": (box(38.2, 24.5), 0.0, box(14.5, 11.7), 0.0, 0.02623, (0.0, -1.0), "linear", 0.01),
}
IMPACTS |= {
    f"{name}, {law}": (*one[:5], (0.3, -1.0), law, one[5])
    for name, one in SLIVERS.items()
    for law in ("linear", "hertz-mindlin")
}


@pytest.mark.parametrize("name", IMPACTS)
def test_elastic_impact_keeps_its_energy_where_corners_pass_one_another(name: str) -> None:
    """With the stiffness of the way between outer corners it gains 1 %, at their depth it loses up to 0.3 %.

    On a sliver, stiffness that changes with the face returns up to sixty times what an impact began with.
    """
    below, angle, above, turn, x, speed, law, scale = IMPACTS[name]
    run, before = struck(below, angle, above, turn, x, speed, law=law, stiffness_scale=scale)
    assert run.mechanical == pytest.approx(before, rel=1e-3)
    if "rectangle" in name:
        assert run.to_step(2 * STEPS).contact_count == 0
        assert run.bodies[1].spin != 0.0
        assert run.mechanical == pytest.approx(before, rel=1e-3)


DEEP = 2e-4  # m


def forces_along(ways: NDArray[np.float64], law: str, tilt: float) -> NDArray[np.float64]:
    """Return forces (N) and torques over the radius of a 16-gon that is led over the face of another, place by place.

    `ways` is how far its face is beside the other one, over the overlap; `tilt` its sine over that of parallel faces.
    """
    turn = pi / 16
    high = RADIUS * cos(turn)
    pair = Pair(SIXTEEN, SIXTEEN, law)
    pair.b.angle, pair.b.cos, pair.b.sin = turn, cos(turn), sin(turn)
    sine = tilt * float(flat_within(cone_of(pair.a, pair.b, pair.world.corners)))
    places = [(pair.b.x + way * DEEP - high * sine, 1.0 + 2.0 * high - DEEP, turn + sine) for way in ways]
    return np.array([pair.force(np.array(place), remembers=True) for place in places])


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


def test_only_corners_near_the_other_body_are_candidates() -> None:
    bodies = [
        {"y": 0.1, "outline": regular(3), "angle": 0.5 * pi},
        {"y": 0.1 - 0.011 - RADIUS, "outline": regular(6), "angle": 0.5 * pi},
    ]
    world: Any = CaseScene(bodies, gravity=0.0).start().scene
    found = np.zeros(2 * MOST_CORNERS, dtype=np.int64)
    count = near_slots(world, 0, 1, 1.1e-3, found)
    assert found[:count].tolist() == [MOST_CORNERS]


def test_no_end_of_a_face_is_lost_between_two_sharp_corners() -> None:
    """As at the back of an arch: where sharp ends lie on one another, neither corner need be inside the other body."""
    depth = 1e-6
    below = [[-0.02, -0.02], [0.02, -0.02], [0.03, 0.02], [-0.03, 0.02]]
    above = [[-0.03, -0.02], [0.03, -0.02], [0.02, 0.02], [-0.02, 0.02]]
    apart = 0.08 * 7.0 / 15.0  # m, of the centroids
    for beside in (0.0, 0.1 * depth, -0.2 * depth):  # within a quarter of the depth: that is how far sides recede there
        bodies = [{"y": 0.1, "outline": below}, {"x": beside, "y": 0.1 + apart, "outline": above}]

        def press(world: World) -> None:
            world.bodies[1].y -= depth

        run = CaseScene(bodies, gravity=0.0, restitution=1.0).start(press)
        contacts = contact_records(run.world)
        assert contacts.depth == pytest.approx([depth, depth], rel=1e-6)
        assert run.bodies[1].ay * run.bodies[1].mass == pytest.approx(contacts.normal_force.sum(), rel=1e-9)
        assert abs(run.bodies[1].spin_rate) * 0.03 < 1e-3 * run.bodies[1].ay
        run.to_step(3)
        assert run.contact_count == 2
