"""Polygons on springs against closed forms: a wedge between jaws, a slope, a hexagon that rolls onto its next face.

Rigid contacts have the same cases in tests/kernels/nonsmooth/test_polygon_motion.py.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from blocksim.scenario.geometry import Corners, centre_outline, regular, section_of
from blocksim.verification.scene import CaseScene, Simulation

G = 9.81
RADIUS = 0.02  # m
BETA = math.radians(20.0)  # half the angle of the wedge


def table(corners: Corners, **values: object) -> dict[str, object]:
    """Return the table of a body with these corners (m)."""
    outline = centre_outline(corners)
    place = {axis: corner - own for axis, corner, own in zip("xy", corners[0], outline[0], strict=True)}
    return {**place, "outline": [list(corner) for corner in outline], **values}


def turned(corners: Corners, angle: float) -> Corners:
    return tuple(
        (math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y) for x, y in corners
    )


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_wedge_slides_in_between_jaws_with_the_force_of_limit_equilibrium(friction: float) -> None:
    """N = W / (2 (sin b + mu cos b)) on either side as jaws become heavy; of these N (cos b - mu sin b) / M pushes."""
    low, high = 0.01, 0.05
    at_low, at_high = (0.01 + y * math.tan(BETA) for y in (low, high))
    shape = ((-at_low, low), (at_low, low), (at_high, high), (-at_high, high))
    jaw = ((0.01, 0.0), (1.0, 0.0), (1.0, high), (at_high, high))
    left = tuple((-x, y) for x, y in reversed(jaw))
    ratio = section_of(jaw)[0] / section_of(shape)[0]
    push, carry = math.cos(BETA) - friction * math.sin(BETA), math.sin(BETA) + friction * math.cos(BETA)
    sinks = G / (1.0 + 2.0 * ratio * math.tan(BETA) * carry / push)
    bodies = [table(corners) for corners in (shape, jaw, left)]
    run = CaseScene(bodies, restitution=0.0, friction=friction, ground_friction=0.0).start().to_time(0.005)
    assert run.bodies.vy[0] == pytest.approx(-sinks * run.time, rel=1e-3)
    assert run.bodies.vx[1] == pytest.approx(sinks * run.time * math.tan(BETA), rel=1e-3)


@pytest.mark.parametrize("corners", [3, 6])
@pytest.mark.parametrize(("degrees", "slides"), [(-0.5, False), (0.5, True)])
def test_slope_holds_a_polygon_below_the_friction_angle_only(corners: int, degrees: float, slides: bool) -> None:
    outline, tilt = regular(corners, RADIUS), math.atan(0.3) + math.radians(degrees)
    lifted = tuple((x, y - min(y for _, y in outline)) for x, y in outline)
    values: dict[str, object] = {"ground_friction": 0.3, "tilt": -tilt, "contact": {"stiffness_scale": 0.01}}
    run = CaseScene([table(lifted)], restitution=0.0, **values).start().to_time(0.05)  # type: ignore[arg-type]
    place, speed, began = float(run.bodies.x[0]), float(run.bodies.vx[0]), run.time
    run.to_time(0.1)
    if slides:
        rate = G * (math.sin(tilt) - 0.3 * math.cos(tilt))
        assert run.bodies.vx[0] - speed == pytest.approx(rate * (run.time - began), rel=1e-4)
    else:
        assert abs(run.bodies.x[0] - place) < 1e-9
    assert abs(run.bodies.angle[0]) < 1e-5


def test_hexagon_that_rolls_onto_its_next_face_keeps_eleven_seventeenths_of_its_spin() -> None:
    """About the new corner: w' (I + m R^2) = w (I + m R^2 cos 60 deg), I = 5/12 m R^2."""
    outline, spin = turned(regular(6, RADIUS), math.radians(2.0)), -8.0
    pivot = min(outline, key=lambda corner: corner[1])
    above = tuple((x, y - pivot[1]) for x, y in outline)
    moving: dict[str, object] = {"velocity": [spin * pivot[1], -spin * pivot[0]], "spin": spin}
    run = CaseScene(
        [table(above, **moving)], restitution=0.0, ground_friction=5.0, contact={"stiffness_scale": 0.1}
    ).start()
    spins = spins_until(run, 0.006)
    fall = int(np.argmax(np.abs(np.diff(spins))))
    assert spins[fall + 15] / spins[fall - 15] == pytest.approx(11.0 / 17.0, rel=0.01)


def spins_until(run: Simulation, end: float, every: float = 2e-5) -> list[float]:
    """Return the spin (rad/s) of the first block, after every so many seconds."""
    return [float(run.to_time((k + 1) * every).bodies.spin[0]) for k in range(round(end / every))]
