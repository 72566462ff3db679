"""Outlines for tests, m."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.scenario.geometry import centre_outline, regular
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.scenario.geometry import Corners

RADIUS = 0.02
HEXAGON = regular(6, RADIUS)
TRIANGLE = centre_outline([(0.0, 0.0), (0.04, 0.0), (0.012, 0.03)])  # its centroid is not over the middle of its base


def rectangle(width: float = WIDTH, height: float = HEIGHT) -> Corners:
    """Return the outline of a rectangle."""
    return centre_outline([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])


def turned(outline: Corners, angle: float) -> NDArray[np.float64]:
    """Return the corners (n, 2) of an outline turned by an angle (rad)."""
    c, s = cos(angle), sin(angle)
    return np.asarray(np.array(outline) @ np.array([[c, s], [-s, c]]))


def depth_below(outline: Corners, angle: float = 0.0) -> float:
    """Return how far (m) a polygon reaches below its centroid."""
    return -float(turned(outline, angle)[:, 1].min())


def random_outline(random: Any, size: float = RADIUS) -> Corners:
    """Return a convex polygon of 3 to 9 corners, some of them sharp, at random."""
    while True:
        angles = np.sort(random.uniform(0.0, 2.0 * pi, int(random.integers(3, 10))))
        steps = np.diff([*angles, angles[0] + 2.0 * pi])
        if steps.min() > 0.15 and steps.max() < 2.8:
            stretch = random.uniform(0.4, 1.0)
            return centre_outline([(size * cos(one), stretch * size * sin(one)) for one in angles.tolist()])
