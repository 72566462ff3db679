"""V7 sliding on level ground, V8 on a slope, V9 sticking below the friction angle and slipping above it."""

from __future__ import annotations

from math import atan, degrees, radians
from typing import TYPE_CHECKING

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, absolute, farthest, relative
from blocksim.verification.scene import HEIGHT, Simulation

if TYPE_CHECKING:
    from collections.abc import Iterator

SPACINGS = (5e-4, 1e-3, 4e-3)  # m
SPEED, LEVEL_FRICTION = 0.5, 0.38  # m/s, -
STOPPED = 1e-4  # of the first speed
POLL = 1e-4  # s
LONGEST = 0.5  # s
MARGIN = radians(0.5)
FRICTIONS = (0.31, 0.38)


def sliding_to_rest(setting: Setting) -> Iterator[Row]:
    """Push a block along level ground at three particle spacings; the farthest off counts."""
    slides = [slide(setting, spacing) for spacing in setting.distinct(SPACINGS)]
    distance = forms.sliding_stop_distance(SPEED, LEVEL_FRICTION)
    time = forms.sliding_stop_time(SPEED, LEVEL_FRICTION)
    yield relative("distance", "mm", 1e3 * distance, 1e3 * farthest(distance, [end for end, _ in slides]), 0.005)
    yield relative("time", "s", time, farthest(time, [stop for _, stop in slides]), 0.005)


def slide(setting: Setting, spacing: float) -> tuple[float, float]:
    """Return where (m) and when (s) a pushed block stops."""
    body = {"y": HEIGHT / 2, "velocity": [SPEED, 0.0]}
    scene = setting.start([body], ground_friction=LEVEL_FRICTION, contact={"particle_spacing": spacing})
    while scene.bodies[0].vx > STOPPED * SPEED and scene.time < LONGEST:
        scene.to_time(scene.time + POLL)
    stop = scene.time
    return float(scene.to_time(stop + 0.02).bodies[0].x), stop


def on_slope(setting: Setting, slope: float, friction: float) -> Simulation:
    """Put a block on a slope (rad) that goes down towards +x."""
    return setting.start([{"y": HEIGHT / 2}], ground_friction=friction, tilt=-slope)


def slope(setting: Setting) -> Iterator[Row]:
    """Measure the acceleration of a block on a slope of 30 degrees between 0.1 and 0.3 s."""
    scene = on_slope(setting, radians(30.0), 0.31).to_time(0.1)
    time, speed = scene.time, float(scene.bodies[0].vx)
    scene.to_time(0.3)
    expected = forms.incline_acceleration(radians(30.0), 0.31)
    yield relative("acceleration", "m/s²", expected, (scene.bodies[0].vx - speed) / (scene.time - time), 0.005)


def friction_angle(setting: Setting) -> Iterator[Row]:
    """Half a degree below the friction angle nothing creeps, half a degree above the block slides."""
    begin, end = (1.0, 2.0) if setting.quick else (5.0, 10.0)
    for friction in FRICTIONS:
        name = f"{degrees(atan(friction)):.2f}°"
        rest = on_slope(setting, atan(friction) - MARGIN, friction).to_time(begin)
        time, place = rest.time, float(rest.bodies[0].x)
        creep = (float(rest.to_time(end).bodies[0].x) - place) / (rest.time - time)
        yield absolute(f"{name} − 0.5°, creep", "µm/s", 0.0, 1e6 * creep, 1.0)
        steep = atan(friction) + MARGIN
        expected = forms.fall_distance(0.5, forms.incline_acceleration(steep, friction))
        way = float(on_slope(setting, steep, friction).to_time(0.5).bodies[0].x)
        yield relative(f"{name} + 0.5°, way in 0.5 s", "mm", 1e3 * expected, 1e3 * way, 0.02)
