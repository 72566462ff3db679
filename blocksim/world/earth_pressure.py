"""Active thrust of soil on the straight back of a structure, by the wedge of C. A. Coulomb (1776).

As in B. M. Das, Principles of Geotechnical Engineering, section 13.12: general batter, inclination of the surface, and
friction on the back; of Rankine where all three are zero. Cohesion takes 2 c K^(1/2) off the pressure, and leaves no
tension.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.scenario import Model, placement
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.open_faces import exposed_faces
from blocksim.world.systems.soils import friction_with, yield_surface
from blocksim.world.systems.system import Floats

STRAIGHT = 0.01  # of the smallest side: how far points may lie off a line
PLACES = 50  # where the surface is looked at


def coulomb_share(angle: float, batter: float = 0.0, slope: float = 0.0, friction: float = 0.0) -> float:
    """Return K of the active wedge; all angles in rad, the slope no more than the soil's own angle.

    The batter is positive where the foot of the back is farther in the soil than its head, the slope where the surface
    rises away from the back.
    """
    across = math.cos(batter + friction)
    root = math.sin(angle + friction) * math.sin(max(angle - slope, 0.0)) / (across * math.cos(batter - slope))
    return math.cos(angle - batter) ** 2 / (math.cos(batter) ** 2 * across * (1.0 + math.sqrt(root)) ** 2)


class ActiveThrust(NamedTuple):
    """Soil behind a straight back."""

    side: float  # 1.0 where it is on the right
    low: float  # m: heights between which it lies against the back
    top: float
    x: float  # m, of the back at `top`
    batter: float  # rad
    friction: float  # rad, on the back
    share: float  # K
    unit_weight: float  # N/m3
    cohesion: float  # Pa
    depth: float  # m

    def above(self, heights: Floats) -> Floats:
        """Return the thrust above some heights (m): forces (N) along x and y, and moment (N m) about the origin."""
        foot = np.maximum(heights, self.low)
        crack = 2.0 * self.cohesion / (self.unit_weight * math.sqrt(self.share))
        height = np.maximum(self.top - foot - crack, 0.0)
        size, turned = 0.5 * self.unit_weight * self.share * height**2 * self.depth, self.batter + self.friction
        y = foot + height / 3.0
        x = self.x + self.side * math.tan(self.batter) * (self.top - y)
        fx, fy = -self.side * math.cos(turned) * size, -math.sin(turned) * size
        return np.stack([fx, fy, x * fy - y * fx], axis=-1)


def active_thrust(
    model: Model, own: Sequence[int], touched: Sequence[int], soil: SoilTable, side: float
) -> ActiveThrust | str:
    """Return the soil behind the blocks of a structure that it touches on a side (1.0: right), or why there is none.

    `own` are all blocks of the structure. Everything is where it was placed.
    """
    scenario, placed = model.scenario, model.bodies
    faces = [
        [placed[number].ground_point(*place) for place in edge[:2]]
        for number, edge in exposed_faces(scenario, placed, touched, side)
    ]
    near = STRAIGHT * placement.smallest_width(placed[number] for number in own)
    back = np.array(faces).reshape(-1, 2)
    if scenario.ground.tilt != 0.0 or not scenario.gravity > 0.0:
        return "gravity is not vertical"
    if not len(back) or (line := _line(back[:, ::-1], near)) is None:
        return "the back is not straight"
    far = float(side * (side * soil.corners[:, 0]).max())
    begin = float(side * (side * back[:, 0]).max())
    places = begin + (far - begin) * np.linspace(0.01, 0.99, PLACES)
    heights = [_heights(soil.corners, places, upper) for upper in (True, False)]
    surface = _line(np.stack([places, heights[0]], axis=-1), near)
    if surface is None:
        return "the surface is not straight"
    (lean, base), (rise, level) = line, surface  # x = base + lean y, y = level + rise x
    top = (level + rise * base) / (1.0 - rise * lean)
    low, highest = float(heights[1][0]), float(back[:, 1].max())
    if top > highest + near:
        return "the soil is higher than the back"
    ends = sorted((begin, far))
    if any(_is_among(one.corners, ends, near) for one in model.soils if one is not soil):
        return "there are several soils"
    mine = {*own}
    for number, body in enumerate(placed):
        corners = np.array([body.ground_point(*place) for place in body.corners])
        if number not in mine and corners[:, 1].max() > low + near and _is_among(corners, ends, near):
            return f"block {body.name} is on or in the soil"
    material = scenario.materials[soil.material]
    slope, strength = yield_surface(material)
    angle, rising, batter = math.asin(3.0 * slope), math.atan(side * rise), math.atan(-side * lean)
    if rising > angle:
        return "the surface is steeper than the friction angle"
    if abs(far - begin) < (top - low) * math.tan(math.pi / 4.0 - 0.5 * angle):
        return "the soil is narrower than the wedge"
    block = placed[touched[0]]
    rough = friction_with(scenario, soil.material, block.material, ground=False).static
    friction = min(math.atan(rough), angle)
    share = coulomb_share(angle, batter, rising, friction)
    weight, cohesion = material.density * scenario.gravity, strength / math.cos(angle)
    place = base + lean * top
    return ActiveThrust(side, low, top, place, batter, friction, share, weight, cohesion, block.depth)


def _line(points: Floats, near: float) -> tuple[float, float] | None:
    """Return slope and intercept of the line through points (u, v) from the first to the last u, None where any is off."""
    u, v = points[np.argsort(points[:, 0], kind="stable")].T
    slope = float((v[-1] - v[0]) / (u[-1] - u[0])) if u[-1] > u[0] else 0.0
    level = float(v[0] - slope * u[0])
    return (slope, level) if bool((np.abs(v - slope * u - level) <= near).all()) else None


def _is_among(corners: Floats, ends: Sequence[float], near: float) -> bool:
    """Return True if an outline reaches into the range between two x."""
    return bool(corners[:, 0].min() < ends[1] - near and corners[:, 0].max() > ends[0] + near)


def _heights(corners: Floats, places: Floats, upper: bool) -> Floats:
    """Return how high (m) an outline reaches at some x, or how low."""
    (x0, y0), (x1, y1) = corners.T[..., None], np.roll(corners, -1, axis=0).T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (places - x0) / (x1 - x0)
    crossed = (share >= 0.0) & (share <= 1.0)
    y = y0 + np.where(crossed, share, 0.0) * (y1 - y0)
    return np.where(crossed, y, -math.inf).max(axis=0) if upper else np.where(crossed, y, math.inf).min(axis=0)
