"""Prescribed motion of the support as the kernels want it: a cubic polynomial of displacement for every stretch."""

import math

from blocksim.kernels.arrays import MOTION_PIECE, Records, zeros
from blocksim.scenario import Scenario


def motion_direction(scenario: Scenario) -> tuple[float, float]:
    """Return the direction (unit vector) of the support's motion; zero where it does not move."""
    motion = getattr(scenario, "motion", None)
    return (0.0, 0.0) if motion is None else (math.cos(motion.direction), math.sin(motion.direction))


def motion_records(scenario: Scenario) -> Records:
    """Return the pieces of the displacement, the last one constant: where the support stays."""
    return zeros(1, MOTION_PIECE)
