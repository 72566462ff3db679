"""Active thrust of soil on the straight back of a structure, by the wedge of C. A. Coulomb (1776).

As in B. M. Das, Principles of Geotechnical Engineering, section 13.12: general batter, inclination of the surface, and
friction on the back; of Rankine where all three are zero, and of N. Mononobe and S. Okabe (the same book, section 14)
with coefficients of gravity. Cohesion takes 2 c K^(1/2) off the pressure, and leaves no
tension.
"""

import math
from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from blocksim.scenario import Model, placement
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.open_faces import exposed_faces
from blocksim.world.systems.soils import friction_with, yield_surface
from blocksim.world.systems.system import Floats

STRAIGHT = 0.01  # of the smallest side: how far points may lie off a line
PLACES = 50  # where the surface is looked at


class NotApplicableError(Exception):
    """Why a structure has no joints, or no active thrust."""


def coulomb_share(
    angle: float, batter: float = 0.0, slope: float = 0.0, friction: float = 0.0, pull: float = 0.0
) -> float:
    """Return K of the active wedge; all angles in rad, the slope and the pull together no more than the soil's angle.

    The batter is positive where the foot of the back is farther in the soil than its head, the slope where the surface
    rises away from the back, the pull of gravity where it is turned towards the back.
    """
    across = math.cos(batter + friction + pull)
    root = math.sin(angle + friction) * math.sin(max(angle - slope - pull, 0.0)) / (across * math.cos(batter - slope))
    wedge = math.cos(angle - batter - pull) ** 2 / (math.cos(pull) * math.cos(batter) ** 2)
    return wedge / (across * (1.0 + math.sqrt(root)) ** 2)


class ActiveThrust(NamedTuple):
    """Soil behind a straight back."""

    side: float  # 1.0 where it is on the right
    ends: tuple[float, float]  # m: heights between which it lies against the back
    x: float  # m, of the back at the upper one
    batter: float  # rad
    friction: float  # rad, on the back
    share: float  # K
    unit_weight: float  # N/m3
    cohesion: float  # Pa
    depth: float  # m

    def above(self, heights: Floats) -> Floats:
        """Return the thrust above some heights (m), (k, 3): forces (N) and moment about the origin (N m)."""
        (low, top), turned = self.ends, self.batter + self.friction
        foot, crack = np.maximum(heights, low), 2.0 * self.cohesion / (self.unit_weight * math.sqrt(self.share))
        height = np.maximum(top - foot - crack, 0.0)
        size, y = 0.5 * self.unit_weight * self.share * height**2 * self.depth, foot + height / 3.0
        fx, fy = -self.side * math.cos(turned) * size, -math.sin(turned) * size
        return np.stack([fx, fy, (self.x + self.side * math.tan(self.batter) * (top - y)) * fy - y * fx], axis=-1)


def active_thrust(
    model: Model, own: Collection[int], outer: Sequence[int], soil: SoilTable, side: float
) -> ActiveThrust:
    """Return the soil behind a structure on a side (1.0: right), where everything was placed.

    `own` are the blocks of the structure, `outer` those of them that are outermost on that side, the lowest first.
    Raises NotApplicableError.
    """
    scenario, placed, (x, y) = model.scenario, model.bodies, soil.corners.T
    along, down = scenario.gravity.pull(0.0)
    near = STRAIGHT * placement.smallest_width(placed[number] for number in own)
    faces = [
        [placed[number].ground_point(*place)[::-1] for place in edge[:2]]
        for number, edge in exposed_faces(scenario, placed, outer, side)
    ]
    back = np.array([face for face in faces if min(face)[0] < y.max()]).reshape(-1, 2)
    if scenario.ground.tilt != 0.0 or not down < 0.0 or not len(back):
        raise NotApplicableError("gravity is not vertical, or nothing is beside the soil")
    lean, base = _line(back, near, "the back")  # x = base + lean y
    begin, far = side * float((side * back[:, 1]).max()), side * float((side * x).max())
    places = begin + (far - begin) * np.linspace(0.01, 0.99, PLACES)
    lower, upper = _heights(soil.corners, places)
    rise, level = _line(np.stack([places, upper], axis=-1), near, "the surface")  # y = level + rise x
    top, low = (level + rise * base) / (1.0 - rise * lean), float(lower[0])
    if top > back[:, 0].max() + near:
        raise NotApplicableError("the soil is higher than the back")
    others = [one.corners for one in model.soils if one is not soil]
    mine = {*own}
    beyond = (one for number, one in enumerate(placed) if number not in mine)
    others += [np.array([body.ground_point(*place) for place in body.corners]) for body in beyond]
    among = [one for one in others if one[:, 1].max() > low + near]
    ends = sorted((begin + side * near, far - side * near))
    if any(one[:, 0].min() < ends[1] and one[:, 0].max() > ends[0] for one in among):
        raise NotApplicableError("other soils or blocks are in the soil or on it")
    material, block = scenario.materials[soil.material], placed[outer[0]]
    slope, strength = yield_surface(material, scenario.strength.divisor("soil"))
    angle, rising, batter = math.asin(3.0 * slope), math.atan(side * rise), math.atan(-side * lean)
    pull = math.atan2(-side * along, -down)
    if rising + pull > angle or abs(far - begin) < (top - low) * math.tan(math.pi / 4.0 - 0.5 * angle):
        raise NotApplicableError("the surface is steeper than the friction angle, or ends within the wedge")
    rough = friction_with(scenario, soil.material, block.material, ground=False).static
    friction = min(math.atan(rough), angle)
    share = coulomb_share(angle, batter, rising, friction, pull)
    weight, cohesion = -material.density * down, strength / math.cos(angle)
    return ActiveThrust(side, (low, top), base + lean * top, batter, friction, share, weight, cohesion, block.depth)


def _line(points: Floats, near: float, what: str) -> tuple[float, float]:
    """Return slope and intercept of the line from the first point (u, v) to the last, which all others are near."""
    u, v = points[np.argsort(points[:, 0], kind="stable")].T
    slope = float((v[-1] - v[0]) / (u[-1] - u[0])) if u[-1] > u[0] else 0.0
    if (np.abs(v - v[0] - slope * (u - u[0])) > near).any():
        raise NotApplicableError(f"{what} is not straight")
    return slope, float(v[0] - slope * u[0])


def _heights(corners: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return between which heights (m) an outline lies at some x."""
    (x0, y0), (x1, y1) = corners.T[..., None], np.roll(corners, -1, axis=0).T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (places - x0) / (x1 - x0)
    y = np.where((share >= 0.0) & (share <= 1.0), y0 + np.clip(np.nan_to_num(share), 0.0, 1.0) * (y1 - y0), math.nan)
    return np.fmin.reduce(y, axis=0), np.fmax.reduce(y, axis=0)  # nan where it has nothing
