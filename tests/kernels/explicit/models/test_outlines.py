"""Polygons in the `surface` model: contact points of rectangles given as outlines, restitution, energy, momentum."""

from __future__ import annotations

from math import cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.explicit.models.surface import near_slots
from blocksim.kernels.explicit.sides import MOST_CORNERS
from blocksim.scenario.laws import LAWS
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from blocksim.verification.scene import Simulation

Outline = list[list[float]]
RADIUS = 0.02  # m
ABOVE = 1e-6  # m, from where blocks fall
STEPS = 400  # an impact takes some thirty


def regular(corners: int) -> Outline:
    return [[RADIUS * cos(2.0 * pi * k / corners), RADIUS * sin(2.0 * pi * k / corners)] for k in range(corners)]


def landed(outline: Outline, angle: float, **values: object) -> tuple[Simulation, float]:
    """Return a block that has struck the ground at 1 m/s, and the speed with which its lowest corner leaves."""
    places = [(cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y) for x, y in outline]
    arm, low = min(places, key=lambda place: place[1])
    block = {"y": ABOVE - low, "outline": outline, "angle": angle, "velocity": [0.0, -1.0]}
    run = CaseScene([block], gravity=0.0, ground_friction=0.0, **values).start()  # type: ignore[arg-type]
    run.to_step(STEPS)
    return run, float(run.bodies[0].vy + run.bodies[0].spin * arm)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("corners", [3, 6, 16])
def test_polygon_leaves_with_its_restitution_flat_and_on_a_corner(corners: int, law: str) -> None:
    flat = -0.5 * pi - pi / corners
    for e in (0.2, 0.8):
        run, speed = landed(regular(corners), flat, restitution=e, contact={"law": law})
        assert speed == pytest.approx(e, abs=0.01)
        assert abs(run.bodies[0].spin) * RADIUS < 1e-6
        _, speed = landed(regular(corners), flat + pi / corners, restitution=e, contact={"law": law})
        assert speed == pytest.approx(e, abs=0.01)


def test_polygon_between_face_and_corner_keeps_its_energy_where_it_is_elastic() -> None:
    """The share of its corner in the stiffness of a face changes with the tilt."""
    for tilt in (0.003, 0.03, 0.15):
        run, _ = landed(regular(6), -0.5 * pi - pi / 6 + tilt, restitution=1.0)
        assert run.residual() < 1e-3


def fell_on(below: Outline, angle: float, x: float, **values: object) -> Simulation:
    """Return a hexagon that has struck the corner or face of another free block, without gravity."""
    high = max(sin(angle) * u + cos(angle) * v for u, v in below)
    bodies = [
        {"y": 0.1, "outline": below, "angle": angle},
        {"x": x, "y": 0.1 + high + RADIUS * cos(pi / 6) + ABOVE, "outline": regular(6), "velocity": [0.3, -1.0]},
    ]
    return CaseScene(bodies, gravity=0.0, **values).start()  # type: ignore[arg-type]


def momenta(run: Simulation) -> np.ndarray:
    b = run.bodies
    spin = b.inertia * b.spin + b.mass * (b.x * b.vy - b.y * b.vx)
    return np.array([(b.mass * b.vx).sum(), (b.mass * b.vy).sum(), spin.sum()])


@pytest.mark.parametrize("angle", [-0.5 * pi - pi / 3, 0.5 * pi - 0.08])
def test_forces_between_polygons_are_equal_and_opposite(angle: float) -> None:
    run = fell_on(regular(3), angle, 0.003, restitution=0.5, friction=0.3)
    before = momenta(run)
    run.to_step(STEPS)
    assert hypot(run.bodies[0].vx, run.bodies[0].vy) > 0.1
    assert np.abs(momenta(run) - before).max() < 1e-12 * np.abs(before).max()


def test_hexagon_on_a_triangle_gains_no_energy_in_an_elastic_impact() -> None:
    for angle in np.linspace(0.0, 2.0, 9).tolist():
        run = fell_on(regular(3), angle, 0.002, restitution=1.0, friction=0.0)
        before = run.kinetic
        run.to_step(STEPS)
        assert run.contacts == 0
        assert run.kinetic == pytest.approx(before, rel=1e-3)


def test_force_does_not_jump_where_a_corner_passes_from_one_face_to_the_next() -> None:
    """A block is led with its corner over the blunt corner of a fixed hexagon: the overlap is that of either face."""
    corner = [[0.0, 0.0], [0.004, 0.02], [-0.004, 0.02]]
    low = min(y for _, y in corner) - 2.0 * 0.02 / 3.0
    bodies = [
        {"y": 0.1, "outline": corner},
        {"y": 0.1 + low - RADIUS - 2e-4, "outline": regular(6), "angle": 0.5 * pi, "fixed": True},
    ]
    run = CaseScene(bodies, gravity=0.0, friction=0.0, restitution=1.0, contact={"max_overlap": 1e-4}).start()
    forces = []
    for x in np.linspace(-2e-6, 2e-6, 41).tolist():
        run.bodies[0].x, run.bodies[0].y, run.bodies[0].angle = x, 0.1 - 2e-4 - 2e-6, 0.0
        run.bodies[0].vx = run.bodies[0].vy = run.bodies[0].spin = 0.0
        run.to_step(int(run.scene.world.clock[0].steps) + 1)
        forces.append(hypot(run.bodies[0].ax, run.bodies[0].ay))
    assert min(forces) > 0.0
    assert np.abs(np.diff(forces)).max() < 0.1 * max(forces)


@pytest.mark.parametrize("angle", [0.0, 0.05, 0.7])
def test_rectangles_given_as_outlines_have_the_same_motion(angle: float) -> None:
    sides = [[-0.02, -0.03], [0.02, -0.03], [0.02, 0.03], [-0.02, 0.03]]
    high = 0.02 * sin(angle) + 0.03 * cos(angle)
    poses: list[dict[str, object]] = [
        {"y": 0.03},
        {"x": 0.007, "y": 0.06 + high + ABOVE, "angle": angle, "velocity": [0.2, -0.5]},
    ]
    states = []
    shapes: tuple[dict[str, object], ...] = ({"width": 0.04, "height": 0.06}, {"outline": sides})
    for shape in shapes:
        run = CaseScene([{**pose, **shape} for pose in poses], friction=0.3).start()
        run.to_step(2 * STEPS)
        states.append(run.state())
    assert states[0][1, 5] != 0.0 or angle == 0.0
    assert states[1] == pytest.approx(states[0], rel=1e-9, abs=1e-12)


SIDES = (0.032, 0.025)  # m


def rectangle(width: float, height: float) -> Outline:
    x, y = 0.5 * width, 0.5 * height
    return [[-x, -y], [x, -y], [x, y], [-x, y]]


def bouncing(shape: dict[str, object], law: str) -> Simulation:
    """Return two blocks, one that falls flat on both, and one that tumbles on the ground."""
    height = SIDES[1]
    poses: list[dict[str, object]] = [
        {"x": -0.02, "y": 0.5 * height},
        {"x": 0.02, "y": 0.5 * height},
        {"x": 0.003, "y": 1.5 * height + 0.01},
        {"x": 0.09, "y": 0.03, "angle": 0.4, "velocity": [0.1, -0.3], "spin": 3.3},
    ]
    contact = {"law": law, "stiffness_scale": 1e-2 if law == "linear" else 1.0}
    return CaseScene([{**pose, **shape} for pose in poses], restitution=0.6, friction=0.3, contact=contact).start()


@pytest.mark.parametrize("law", LAWS)
def test_rectangles_given_as_outlines_bounce_and_tumble_as_rectangles_do(law: str) -> None:
    """To the last bit: impacts would multiply any other."""
    runs = bouncing({"width": SIDES[0], "height": SIDES[1]}, law), bouncing({"outline": rectangle(*SIDES)}, law)
    speeds = []
    for time in np.linspace(0.001, 0.16, 160).tolist():
        state, outlined = (run.to_time(time).state() for run in runs)
        speeds.append(state[2:, 4])
        assert np.array_equal(outlined, state)
    impacts = (np.diff(speeds, axis=0) > 0.02).sum(axis=0)
    assert impacts.min() >= 3
    assert impacts.sum() >= 10


# sides of two (m), place beside and tilt of the upper one, stiffness scale: the overlap is as deep as it is long
AT_ENDS = [
    ((0.0224, 0.0151), (0.0367, 0.0138), -0.0294, -0.0015, 0.003),
    ((0.0382, 0.0245), (0.0145, 0.0117), 0.02623, 0.0, 0.01),
]


@pytest.mark.parametrize(("below", "above", "x", "angle", "scale"), AT_ENDS)
def test_rectangles_given_as_outlines_keep_their_energy_near_the_ends_of_faces(
    below: tuple[float, float], above: tuple[float, float], x: float, angle: float, scale: float
) -> None:
    low = min(sin(angle) * u + cos(angle) * v for u, v in rectangle(*above))
    bodies: list[dict[str, object]] = [
        {"y": 1.0, "outline": rectangle(*below)},
        {
            "x": x,
            "y": 1.0 + 0.5 * below[1] - low + ABOVE,
            "angle": angle,
            "velocity": [0.0, -1.0],
            "outline": rectangle(*above),
        },
    ]
    run = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact={"stiffness_scale": scale}).start()
    before = run.kinetic
    run.to_step(490)
    assert run.contacts == 0
    assert run.bodies[1].spin != 0.0
    assert run.mechanical == pytest.approx(before, rel=1e-3)


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
        contacts = run.contact_records
        assert contacts.depth == pytest.approx([depth, depth], rel=1e-6)
        assert run.bodies[1].ay * run.bodies[1].mass == pytest.approx(contacts.normal_force.sum(), rel=1e-9)
        assert abs(run.bodies[1].spin_rate) * 0.03 < 1e-3 * run.bodies[1].ay
        run.to_step(3)
        assert run.contacts == 2
