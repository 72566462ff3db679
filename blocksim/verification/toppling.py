"""V10 the chart of sliding and toppling on a slope, V17 the leaning ladder."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, radians, sin
from typing import TYPE_CHECKING

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, absolute, count, relative
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROUGH = 2.0  # friction coefficient at which no slope of this chart lets a block slide before it topples
BRACKET = radians(1.0)  # either way of the expected limit
SLOPE_HALVINGS = 6
OBSERVED = 0.35  # s; enough to see a block go at a hundredth of a degree beyond a limit
SLID = 1e-5  # m, before the block has turned by TURNED
TURNED = radians(1.0)

LADDER, LADDER_THICKNESS, LADDER_SLOPE = 1.0, 0.01, radians(60.0)  # m, m, rad
LADDER_HALVINGS = 7
SLIPPED = 1e-4  # rad, of turning
WALL = 0.2  # m, thickness


@dataclass(frozen=True)
class Slope:
    """A block on a slope that goes down towards +x."""

    width: float  # m
    height: float  # m
    angle: float  # rad
    friction: float


def motion(setting: Setting, slope: Slope) -> tuple[bool, bool]:
    """Return True if the block slides, and whether it topples.

    Sliding is seen while the block has hardly turned: a block that has toppled falls on its side and slides then.
    """
    body = {"y": slope.height / 2, "width": slope.width, "height": slope.height}
    scene = setting.start([body], ground_friction=slope.friction, tilt=-slope.angle)
    slides = topples = False
    while scene.time < OBSERVED and not topples:
        scene.to_time(scene.time + 2e-3)
        block = scene.bodies[0]
        topples = bool(-block.angle > TURNED)
        foot = block.x + cos(block.angle) * slope.width / 2 + sin(block.angle) * slope.height / 2
        slides = slides or bool(foot - slope.width / 2 > SLID)
    return slides, topples


def chart(setting: Setting) -> Iterator[Row]:
    """Find the limits of sliding and toppling on a slope, and one point of every regime."""
    for friction in (0.31, 0.38):
        expected = forms.sliding_slope(friction)
        found = slope_limit(setting, WIDTH, HEIGHT, friction, expected, 0)
        yield absolute(f"slides, μ = {friction:g}", "°", degrees(expected), degrees(found), 0.2)
    for width, height, name in ((WIDTH, HEIGHT, "32 × 25"), (HEIGHT, WIDTH, "25 × 32")):
        expected = forms.toppling_slope(width, height)
        found = slope_limit(setting, width, height, ROUGH, expected, 1)
        yield absolute(f"topples, {name}", "°", degrees(expected), degrees(found), 0.2)
    points = list(regimes())
    yield count("regimes", len(points), sum(motion(setting, slope) == expected for slope, expected in points))


def slope_limit(setting: Setting, width: float, height: float, friction: float, expected: float, which: int) -> float:
    """Return the slope (rad) from which on a block slides (`which` 0) or topples (1)."""

    def happens(angle: float) -> bool:
        return motion(setting, Slope(width, height, angle, friction))[which]

    return limit(happens, expected - BRACKET, expected + BRACKET, SLOPE_HALVINGS)


def regimes() -> Iterator[tuple[Slope, tuple[bool, bool]]]:
    """Return one slope of every regime and what the block on end does there: slides, topples.

    Steeper than both limits the block slides without toppling where mu < b/h (friction, not gravity, turns it), topples
    first where mu is above `rolling_friction_limit`, and does both in between.
    """
    width, height = HEIGHT, WIDTH
    steep = radians(60.0)
    needed = forms.rolling_friction_limit(width, height, steep)
    both = 0.5 * (width / height + needed)
    yield Slope(width, height, radians(30.0), ROUGH), (False, False)
    yield Slope(width, height, radians(30.0), 0.5), (True, False)
    yield Slope(width, height, steep, 0.9 * width / height), (True, False)
    yield Slope(width, height, steep, both), (True, True)
    yield Slope(width, height, steep, 1.1 * needed), (False, True)


def ladder(setting: Setting) -> Iterator[Row]:
    """Find the ground friction below which a ladder at a smooth wall slips."""
    slenderness = LADDER_THICKNESS / LADDER
    expected = forms.ladder_friction(LADDER_SLOPE, slenderness)
    found = limit(lambda friction: not slips(setting, friction), 0.9 * expected, 1.1 * expected, LADDER_HALVINGS)
    yield relative("friction needed", "", expected, found, 0.02)


def slips(setting: Setting, friction: float) -> bool:
    """Return True if the ladder comes down: the wall stands at x < 0, the foot is to the right."""
    along, across = (cos(LADDER_SLOPE), sin(LADDER_SLOPE)), (sin(LADDER_SLOPE), cos(LADDER_SLOPE))
    rod = {
        "x": (LADDER * along[0] + LADDER_THICKNESS * across[0]) / 2,
        "y": (LADDER * along[1] + LADDER_THICKNESS * across[1]) / 2,
        "width": LADDER_THICKNESS,
        "height": LADDER,
        "angle": radians(90.0) - LADDER_SLOPE,
    }
    wall = {"x": -WALL / 2, "y": LADDER / 2, "width": WALL, "height": LADDER, "fixed": True}
    scene = setting.start([rod, wall], friction=0.0, ground_friction=friction)
    return bool(abs(scene.to_time(1.0).bodies[0].angle - rod["angle"]) > SLIPPED)


def limit(outcome: Callable[[float], bool], low: float, high: float, halvings: int) -> float:
    """Return where an outcome changes, by bisection: the middle of the last interval.

    NaN where `outcome` is not False at `low` and True at `high`.
    """
    if outcome(low) or not outcome(high):
        return float("nan")
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outcome(middle) else (middle, high)
    return 0.5 * (low + high)
