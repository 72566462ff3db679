"""Prescribed motion of the support as the kernels want it: a cubic polynomial of displacement for every stretch."""

import numpy as np

from blocksim.kernels.arrays import MOTION_PIECE, Records, zeros
from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_direction, motion_pieces


def support_direction(scenario: Scenario) -> tuple[float, float]:
    """Return the direction (unit vector) of the support's motion; zero where it does not move."""
    return (0.0, 0.0) if scenario.motion is None else motion_direction(scenario)


def motion_records(scenario: Scenario) -> Records:
    """Return the pieces of the displacement over time; the last one is constant: where the support stays at the end.

    Where the motion is cut off by the end of the simulated time, that piece is never reached.
    """
    times, coefficients = motion_pieces(scenario)
    records = zeros(len(coefficients) + 1, MOTION_PIECE)
    if scenario.motion is None:
        return records
    records["start"] = times
    for k, name in enumerate(("c0", "c1", "c2", "c3")):
        records[name][:-1] = coefficients[:, k]
    records["c0"][-1] = coefficients[-1] @ (times[-1] - times[-2]) ** np.arange(4)
    return records
