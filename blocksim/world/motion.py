"""Prescribed motion of the support as the kernels want it: a cubic polynomial of displacement for every stretch."""

import numpy as np

from blocksim.kernels.arrays import MOTION_PIECE, MOVED, Records, zeros
from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_direction, motion_pieces


def support_direction(scenario: Scenario) -> tuple[float, float]:
    """Return the direction (unit vector) of the support's motion; zero where it does not move."""
    return (0.0, 0.0) if scenario.motion is None else motion_direction(scenario)


def moved_records(bodies: Records) -> Records:
    """Return where all bodies that move with the support start."""
    numbers = np.flatnonzero(bodies.is_moved)
    records = zeros(numbers.size, MOVED)
    records["body"] = numbers
    records["x"], records["y"] = bodies.x[numbers], bodies.y[numbers]
    return records


def motion_records(scenario: Scenario) -> Records:
    """Return the pieces of the displacement over time; where a motion ends before the run, the last one is constant."""
    pieces = motion_pieces(scenario)
    records = zeros(max(1, len(pieces.coefficients)), MOTION_PIECE)
    if len(pieces.coefficients) > 0:
        records["start"] = pieces.times[:-1]
        for k, name in enumerate(("c0", "c1", "c2", "c3")):
            records[name] = pieces.coefficients[:, k]
    return records
