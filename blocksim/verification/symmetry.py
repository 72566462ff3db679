"""V19 mirror image, relabelled blocks, moved origin; V21 the ground as a fixed block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Row, Setting, absolute
from blocksim.verification.collapse import staircase
from blocksim.verification.scene import HEIGHT

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from blocksim.verification.scene import Simulation

BEFORE, AFTER = 0.2, 0.45  # s: just before the first impact; all impacts are over
MIRROR = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])  # x, y, angle, vx, vy, spin
RELABELLED = (2, 1, 0)
SHIFT = 1.0  # m
CORNER = 0.03  # m, from the centre of a block
PLINTH: dict[str, object] = {"x": 0.0, "y": 0.05, "width": 1.0, "height": 0.1, "fixed": True}
LANDING = 0.3  # s
SAME, REORDERED = 1e-9, 1e-6  # m, before impacts
SOLVED = {"velocity_tolerance": 1e-12}  # m/s: round-off may decide on one sweep more or less of rigid contacts


def symmetries(setting: Setting) -> Iterator[Row]:
    """Let the three blocks collapse in a mirror, under other numbers, and one metre aside.

    Rigid contacts are gone through one after the other, in an order that goes by the numbers of blocks, once a position
    pass. So overlaps depend on the numbers by a share of themselves (1e-9 m at a step h of 1e-5 s), and with them the
    step in which a point of a face lifts off, after 0.1 s. One step sooner changes a velocity by less than g h, and a
    place by less than g h 0.1 s until the first impact, which is 1e-5 m; a tenth of that is allowed.
    """
    usual = states(setting, staircase())
    mirrored = [state * MIRROR for state in states(setting, staircase(side=-1.0))]
    relabelled = [state[np.argsort(RELABELLED)] for state in states(setting, staircase(RELABELLED))]
    back = np.array([SHIFT, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved = [state - back for state in states(setting, staircase(shift=SHIFT))]
    for name, other in (("mirrored", mirrored), ("relabelled", relabelled), ("moved 1 m", moved)):
        before, after = (distance(one, two) for one, two in zip(usual, other, strict=True))
        allowed = SAME if setting.has_springs or other is not relabelled else REORDERED
        yield absolute(f"{name}, before impacts", "m", 0.0, before, allowed)
        yield absolute(f"{name}, at the end", "mm", 0.0, 1e3 * after, 0.05)


def states(setting: Setting, bodies: Sequence[dict[str, object]]) -> list[NDArray[np.float64]]:
    """Return the state just before the first impact and that after the last one."""
    collapse = setting.start(bodies, time={} if setting.has_springs else SOLVED)
    return [collapse.to_time(time).state() for time in (BEFORE, AFTER)]


def distance(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    """Return how far (m) centres or corners of two states are apart at most."""
    apart = np.abs(one - two)
    return float(max(apart[:, :2].max(), CORNER * apart[:, 2].max()))


def fixed_block(setting: Setting) -> Iterator[Row]:
    """Let a block tumble over the ground and over a fixed block, at one step: the same motion."""
    plinth = tumbling(setting, [PLINTH], 0.1)
    ground = tumbling(setting, [], 0.0, step=plinth.step)
    apart = 0.0
    for time in np.linspace(0.0, LANDING, 31)[1:]:
        one, two = (scene.to_time(float(time)).state()[:1] for scene in (ground, plinth))
        apart = max(apart, distance(one, two - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])))
    yield absolute("motions apart", "µm", 0.0, 1e6 * apart, 1.0)


def tumbling(setting: Setting, others: Sequence[dict[str, object]], level: float, step: float = 0.0) -> Simulation:
    """Drop a tilted block that slides and turns onto a level (m); `step` (s) is the scene's own where zero."""
    body = {"y": level + HEIGHT, "angle": 0.4, "velocity": [0.3, -0.5]}
    time = {"step": step} if step else {}
    return setting.start([body, *others], friction=0.38, ground_friction=0.38, time=time)
