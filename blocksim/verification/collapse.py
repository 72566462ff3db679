"""V24 the three blocks before their first impact, V22 their rest positions without restitution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Row, Setting, absolute

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from blocksim.verification.scene import Simulation

SIZES = {"width": 0.032, "height": 0.05, "length": 0.025}  # m, upright = "length"
STEP_X = 0.022  # m, offset of each block against the one below: an overlap of 10 mm
BEFORE_FIRST_IMPACT = {  # time (s): x, y (mm), angle (degrees) of blocks 2 and 3, by pymunk at a step of 1e-5 s
    0.05: ((40.330, 74.323, -5.409), (63.160, 122.385, -5.409)),
    0.10: ((46.623, 71.146, -21.171), (74.432, 113.995, -21.171)),
    0.15: ((55.200, 61.301, -49.670), (94.447, 92.863, -48.415)),
    0.20: ((64.446, 32.025, -85.583), (116.650, 48.972, -79.664)),
}
FINAL = ((1, 16.0, 0.1, 0.0), (2, 67.3, 0.6, -90.0), (3, 128.8, 1.0, -90.0))  # block, x, tolerance (mm), angle (°)
HERTZ_TOLERANCE = 2.0  # mm
LONGEST = 2.0  # s


def staircase(order: Sequence[int] = (0, 1, 2), side: float = 1.0, shift: float = 0.0) -> list[dict[str, object]]:
    """Return the bodies, block `order[i]` at place i of the list; to the other side for `side` = -1."""
    return [{"x": shift + side * (0.016 + STEP_X * level), "y": 0.025 + 0.05 * level, **SIZES} for level in order]


def collapse(setting: Setting, restitution: float, spacing: float = 1e-3, scale: float = 1.0) -> Simulation:
    """Let go of the three blocks; they stop once they rest."""
    contact = {"particle_spacing": spacing, "stiffness_scale": scale}
    return setting.start(
        staircase(), restitution=restitution, contact=contact, time={"stop_at_rest": True, "end": LONGEST}
    )


def before_impact(setting: Setting) -> Iterator[Row]:
    """Compare positions and angles of blocks 2 and 3 at four times; the farthest off counts.

    Restitution 0, as in V22: no impact yet, but the weight comes suddenly upon the springs at the start, and the rigid
    contacts of the reference do not swing back from that.
    """
    for time, (place, angle) in off_reference(setting).items():
        yield absolute(f"{time:.2f} s, place off by", "mm", 0.0, place, 0.1)
        yield absolute(f"{time:.2f} s, angle off by", "°", 0.0, angle, 0.15)


def off_reference(setting: Setting) -> dict[float, tuple[float, float]]:
    """Return by how much (mm, degrees) blocks 2 and 3 are off the reference at most, at every time (s) of it."""
    scene = collapse(setting, 0.0)
    found = {}
    for time, blocks in BEFORE_FIRST_IMPACT.items():
        upper = scene.to_time(time).bodies[1:]
        places = np.array([1e3 * upper.x, 1e3 * upper.y, np.degrees(upper.angle)]).T
        off = np.abs(places - np.array(blocks)).max(axis=0)
        found[time] = (float(max(off[0], off[1])), float(off[2]))
    return found


def at_rest(setting: Setting) -> Iterator[Row]:
    """Compare the final places with those that ten independent engines agree on."""
    bodies = collapse(setting, 0.0).to_time(LONGEST).bodies
    for block, x, tolerance, angle in FINAL:
        allowed = HERTZ_TOLERANCE if setting.hertzian else tolerance
        yield absolute(f"block {block}, x", "mm", x, 1e3 * bodies[block - 1].x, allowed)
        yield absolute(f"block {block}, angle", "°", angle, np.degrees(bodies[block - 1].angle), 0.5)
