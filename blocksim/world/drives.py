"""Driven bodies as arrays, and how fast and how far up they go: time steps are chosen by that."""

import math
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import MOTION_PIECE, MOVED, Records, zeros
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.drives import Drive, drives_of, greatest_rate
from blocksim.scenario.motion import MotionPieces

COEFFICIENTS = ("c0", "c1", "c2", "c3")


class DriveRecords(NamedTuple):
    """Driven bodies of one scene, and the pieces of all their paths."""

    driven: Records  # (d,) MOVED
    paths: Records  # (q,) MOTION_PIECE


def drive_records(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> DriveRecords:
    """Return the driven bodies of a scenario; both arrays are empty where there are none."""
    drives = drives_of(scenario)
    driven, pieces, count = zeros(len(drives), MOVED), [], 0
    for record, drive in zip(driven, drives, strict=True):
        body = placed[drive.body]
        record.body, record.rest_time = drive.body, drive.rest_time
        record.x, record.y, record.angle = body.x, body.y, body.angle
        record.along_x, record.along_y = drive.along
        record.about_x, record.about_y = drive.about
        for name, one in (("shift", drive.shift), ("turn", drive.turn)):
            record[name] = count
            count += len(one.coefficients)
            record[f"{name}_end"] = count
            pieces.append(piece_records(one))
    paths = zeros(count, MOTION_PIECE)
    if pieces:
        paths[:] = np.concatenate(pieces)
    return DriveRecords(driven, paths)


def piece_records(pieces: MotionPieces) -> Records:
    """Return the pieces of one function of time."""
    records = zeros(len(pieces.coefficients), MOTION_PIECE)
    records["start"] = pieces.times[:-1]
    for k, name in enumerate(COEFFICIENTS):
        records[name] = pieces.coefficients[:, k]
    return records


def driven_speed(scenario: Scenario) -> float:
    """Return the greatest speed (m/s) of any point of a driven body, zero where there are none."""
    drives = drives_of(scenario)
    placed = place_bodies(scenario) if drives else ()
    reaches = [(drive, _reach(drive, placed[drive.body])) for drive in drives]
    return max((greatest_rate(one.shift) + reach * greatest_rate(one.turn) for one, reach in reaches), default=0.0)


def _reach(drive: Drive, body: PlacedBody) -> float:
    """Return how far (m) a point of a driven body is from what it turns about, at most."""
    return math.dist((body.x, body.y), drive.about) + body.radius


def highest_rise(scenario: Scenario) -> float:
    """Return how far (m) driven bodies may lift what lies on them above where it was, zero where there are none."""
    return max((_rise(drive, scenario) for drive in drives_of(scenario)), default=0.0)


def _rise(drive: Drive, scenario: Scenario) -> float:
    """Return how far a body goes up along its path; one that turns may lift by twice its distance from the point."""
    pieces = drive.shift
    ends = [pieces.coefficients[:, 0]]
    length = np.diff(pieces.times)[: len(pieces.coefficients)]
    c0, c1, c2, c3 = pieces.coefficients.T
    ends.append(c0 + length * (c1 + length * (c2 + length * c3)))
    up = max(0.0, float(np.max(drive.along[1] * np.concatenate(ends))))
    reach = _reach(drive, place_bodies(scenario)[drive.body])
    return up + (2.0 * reach if drive.turn.coefficients[:, 1:].any() else 0.0)
