"""Prescribed motion of single bodies over time: shift along a line and turn about a point, as piecewise cubics."""

from typing import NamedTuple

import numpy as np

from blocksim.scenario.models.drive import Ramp, Rotation
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.motion import (
    BEYOND,
    MotionPieces,
    from_zero_to,
    motion_direction,
    motion_pieces,
    through,
)

PIECES_OF_A_RAMP = 200
"""Of a smooth one, which is of fifth order: they are off by less than 1e-9 of the way."""
STILL = MotionPieces(np.zeros(2), np.zeros((1, 4)), 0.0)


class Drive(NamedTuple):
    """Motion of one body: pieces as in blocksim.scenario.motion, of its shift (m) and its turn (rad)."""

    body: int  # its place among all bodies
    along: tuple[float, float]  # unit vector of the shift
    shift: MotionPieces
    about: tuple[float, float]  # m: the point about which it turns, which is shifted with it
    turn: MotionPieces

    @property
    def rest_time(self) -> float:
        """Time (s) from when on the body rests, infinite where it never does."""
        return max(_end(self.shift), _end(self.turn))


def drives_of(scenario: Scenario) -> tuple[Drive, ...]:
    """Return the motions of all driven bodies, in the order of the bodies."""
    first, end = sum(structure.size for structure in scenario.structures), BEYOND * scenario.time.end
    drives = []
    for number, body in enumerate(scenario.bodies, start=first):
        motion, centre = body.motion, (body.x, body.y)
        if isinstance(motion, Rotation):
            turn = _course(motion, motion.angle, end)
            drives.append(Drive(number, (1.0, 0.0), STILL, motion.about or centre, turn))
        elif motion is not None:
            alone = scenario.model_copy(update={"motion": motion})  # as if it were that of the supports
            shift = _course(motion, motion.distance, end) if isinstance(motion, Ramp) else motion_pieces(alone)
            drives.append(Drive(number, motion_direction(alone), shift, centre, STILL))
    return tuple(drives)


def _course(motion: Ramp | Rotation, way: float, end: float) -> MotionPieces:
    """Return the pieces of a way (m or rad) from the start of a motion on, until `end` (s) at least."""
    count = PIECES_OF_A_RAMP if motion.course == "smooth" else 1
    share = np.linspace(0.0, 1.0, count + 1)
    times = motion.start + motion.resolved_duration * share
    if count == 1:
        pieces = MotionPieces(times, np.array([[0.0, way / motion.resolved_duration, 0.0, 0.0]]), 0.0)
    else:
        values = way * share**3 * (10.0 - 15.0 * share + 6.0 * share * share)
        rates = way / motion.resolved_duration * 30.0 * (share * (1.0 - share)) ** 2
        pieces = through(times, values, rates)
    pieces = from_zero_to(end, pieces)
    last = pieces.coefficients[-1]
    if not last[1:].any():  # constant: exactly at the end of the way
        last[0] = way
    return pieces


def _end(pieces: MotionPieces) -> float:
    is_moving = np.asarray(pieces.coefficients[:, 1:].any(axis=1))
    if not is_moving.any():
        return 0.0
    last = int(np.flatnonzero(is_moving)[-1])
    return np.inf if last == is_moving.size - 1 else float(pieces.times[last + 1])


def greatest_rate(pieces: MotionPieces) -> float:
    """Return the greatest speed (m/s, or rad/s) of a motion."""
    _, c1, c2, c3 = pieces.coefficients.T
    length = np.diff(pieces.times)[: len(c1)]
    with np.errstate(divide="ignore", invalid="ignore"):  # straight and parabolic pieces are fastest at an end
        middle = np.nan_to_num(-c2 / (3.0 * c3), posinf=0.0, neginf=0.0)
    rates = [np.abs(c1 + s * (2.0 * c2 + 3.0 * s * c3)) for s in (0.0 * length, np.clip(middle, 0.0, length), length)]
    return float(max(np.max(rate, initial=0.0) for rate in rates))
