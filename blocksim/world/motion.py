"""Prescribed motion of the support as the kernels want it: a cubic polynomial of displacement for every stretch."""

import numpy as np

from blocksim.kernels.arrays import MOTION_PIECE, MOVED, Records, zeros
from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_direction, motion_pieces

STANDSTILL = zeros(1, MOTION_PIECE)


def support_direction(scenario: Scenario) -> tuple[float, float]:
    """Return the direction (unit vector) of the support's motion; zero where it does not move."""
    return (0.0, 0.0) if scenario.motion is None else motion_direction(scenario)


def moved_records(bodies: Records) -> Records:
    """Return where all bodies (..., n + 1) that move with the support start; in every scene there are equally many."""
    is_moved = bodies["is_moved"] != 0
    numbers = np.nonzero(is_moved)[-1].reshape(*is_moved.shape[:-1], -1)
    records = zeros(numbers.shape, MOVED)
    records["body"] = numbers
    for name in ("x", "y"):
        records[name] = np.take_along_axis(bodies[name], numbers, -1)
    return records


def motion_records(scenario: Scenario) -> Records:
    """Return the pieces of the displacement over time; where a motion ends before the run, the last one is constant."""
    if scenario.motion is None:
        return STANDSTILL
    pieces = motion_pieces(scenario)
    count = len(pieces.coefficients)
    records = zeros(max(1, count), MOTION_PIECE)
    records["start"][:count] = pieces.times[:-1]
    for k, name in enumerate(("c0", "c1", "c2", "c3")):
        records[name][:count] = pieces.coefficients[:, k]
    return records
