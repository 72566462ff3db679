"""What a scenario prescribes: loads and driven bodies as arrays, and bounds of what they do."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import (
    LOAD,
    LOAD_FIELD,
    LOAD_FORCE,
    LOAD_PIECE,
    LOAD_TILT,
    LOAD_WATER,
    MOTION_PIECE,
    MOVED,
    Records,
    zeros,
)
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.geometry import Corner
from blocksim.scenario.models.loads import (
    AnyLoad,
    Face,
    Force,
    Gravity,
    Horizontal,
    Moment,
    OnBody,
    Pressure,
    Stretch,
    stretches_of,
)
from blocksim.scenario.motion import Drive, MotionPieces, drives_of, greatest_rate
from blocksim.scenario.start import NORMALS, face_of


class LoadArrays(NamedTuple):
    """The loads of one scene."""

    loads: Records  # (l,) LOAD
    pieces: Records  # (k,) LOAD_PIECE
    push: float  # m/s2: no load gives a point of a body more, with water no deeper than at the start
    end: float  # s: from then on none changes with time


def load_arrays(scenario: Scenario, placed: Sequence[PlacedBody]) -> LoadArrays:
    """Return the loads of a scenario, in its order."""
    numbers = {body.name: number for number, body in enumerate(placed)} if scenario.loads else {}
    histories = [stretches_of(load, scenario.ground.tilt) for load in scenario.loads]
    loads = zeros(len(scenario.loads), LOAD)
    first = 0
    for record, load, stretches in zip(loads, scenario.loads, histories, strict=True):
        values = _values(scenario, load, placed[numbers[load.body]] if isinstance(load, OnBody) else None)
        for name, value in values.items():
            record[name] = value
        record["body"] = numbers[load.body] if isinstance(load, OnBody) else 0
        record["first_piece"], record["last_piece"] = first, first + len(stretches)
        first += len(stretches)
    pieces = zeros(first, LOAD_PIECE)
    rows = [_in_units(load, one) for load, some in zip(scenario.loads, histories, strict=True) for one in some]
    for number, name in enumerate(Stretch._fields):
        pieces[name] = [row[number] for row in rows]
    return LoadArrays(
        loads, pieces, sum(_pushes(scenario, placed)), max((one[-1].start for one in histories), default=0.0)
    )


def _in_units(load: AnyLoad, one: Stretch) -> Stretch:
    """Return a stretch of what a load evaluates: of water the level (m)."""
    if not isinstance(load, Pressure) or load.water_level is None:
        return one
    return Stretch(one.start, load.water_level * one.value, load.water_level * one.rate)


def _values(scenario: Scenario, load: AnyLoad, body: PlacedBody | None) -> dict[str, float]:
    """Return the fields of the record of a load, but for its body and pieces."""
    tilt = scenario.ground.tilt
    if isinstance(load, Gravity):
        return {"kind": LOAD_TILT, "fx": scenario.gravity}
    if isinstance(load, Horizontal):
        size = load.magnitude * scenario.gravity
        return {"kind": LOAD_FIELD, "fx": size * math.cos(tilt), "fy": -size * math.sin(tilt)}
    if isinstance(load, Moment):
        return {"kind": LOAD_FORCE, "torque": load.magnitude}
    if isinstance(load, Force):
        x, y = load.point
        fx, fy = load.magnitude * math.cos(load.direction), load.magnitude * math.sin(load.direction)
        return {"kind": LOAD_FORCE, "x": x, "y": y, "fx": fx, "fy": fy, "turns": load.axes == "body"}
    assert body is not None  # noqa: S101 - a pressure acts on a body
    return _pressure(load, body, tilt)


def _face(body: PlacedBody, face: Face) -> tuple[Corner, Corner]:
    """Return the middle of a face and half its extents (m, in the body), of which one is zero."""
    nx, ny = NORMALS[face]
    found = face_of(body, face)
    assert found is not None  # noqa: S101 - a scenario without this face is refused
    middle, (half_x, half_y) = found
    return middle, (abs(ny) * half_x, abs(nx) * half_y)


def _pressure(load: Pressure, body: PlacedBody, tilt: float) -> dict[str, float]:
    nx, ny = NORMALS[load.face]
    (x, y), (along_x, along_y) = _face(body, load.face)
    length = 2.0 * (along_x + along_y)
    values = {"x": x, "y": y, "turns": 1.0}
    if load.magnitude is not None:
        force = load.magnitude * length * body.depth
        return {**values, "kind": LOAD_FORCE, "fx": -nx * force, "fy": -ny * force}
    return {
        **values,
        "kind": LOAD_WATER,
        "x": x - along_x,
        "y": y - along_y,
        "end_x": x + along_x,
        "end_y": y + along_y,
        "fx": -nx * body.depth,
        "fy": -ny * body.depth,
        "unit_weight": load.unit_weight * length,
        "up_x": math.sin(tilt),
        "up_y": math.cos(tilt),
    }


def _pushes(scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[float]:
    """Yield a bound (m/s2) of what each load gives a point of a body, beyond gravity of its usual size."""
    bodies = {body.name: body for body in placed} if scenario.loads else {}
    for load in scenario.loads:
        if isinstance(load, Gravity):
            continue  # it turns, and gets no larger
        largest = max(abs(one.value) for one in stretches_of(load, 0.0))
        if isinstance(load, Horizontal):
            yield largest * abs(load.magnitude) * scenario.gravity
        else:
            yield largest * _push_on(load, bodies[load.body])


def _push_on(load: OnBody, body: PlacedBody) -> float:
    """Return the largest acceleration (m/s2) of a point of a body for a factor of one."""
    radius = body.radius
    if isinstance(load, Moment):
        return abs(load.magnitude) * radius / body.inertia
    if isinstance(load, Force):
        force, arm = abs(load.magnitude), math.hypot(*load.point)
    else:
        _, (along_x, along_y) = _face(body, load.face)
        area = 2.0 * (along_x + along_y) * body.depth
        deepest = abs(load.magnitude or 0.0)
        if load.water_level is not None:
            deepest = load.unit_weight * (load.water_level + math.hypot(body.x, body.y) + radius)
        force, arm = deepest * area, radius
    return force / body.mass + force * arm * radius / body.inertia


def greatest_push(scenario: Scenario) -> float:
    """Return the bound (m/s2) of what loads give a point of a body, beyond gravity of its usual size."""
    return sum(_pushes(scenario, place_bodies(scenario))) if scenario.loads else 0.0


def steepest_tilt(scenario: Scenario) -> float:
    """Return the greatest slope (rad) that gravity has in a run, without its sign."""
    tilt = scenario.ground.tilt
    turns = [stretches_of(load, tilt) for load in scenario.loads if isinstance(load, Gravity)]
    return max(abs(one) for one in (tilt, *(stretch.value for stretches in turns for stretch in stretches)))


def stack_loads(applied: Sequence[LoadArrays]) -> tuple[Records, Records]:
    """Return loads (m, l) and pieces (m, k) of scenes of one shape."""
    loads, pieces = (zeros((len(applied), one.size), one.dtype) for one in applied[0][:2])
    for number, one in enumerate(applied):
        loads.view(np.ndarray)[number] = one.loads
        pieces.view(np.ndarray)[number] = one.pieces
    return loads, pieces


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
