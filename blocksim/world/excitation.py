"""What a scenario prescribes: loads and motions as arrays, and bounds of what they do.

The motion of supports and of driven bodies is a cubic polynomial of displacement for every stretch of time.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common import arrays
from blocksim.scenario import PlacedBody, Scenario, motion, open_faces
from blocksim.scenario.model import Model, derived
from blocksim.scenario.models import actuators, loads
from blocksim.scenario.placement import GEOMETRY

COEFFICIENTS = ("c0", "c1", "c2", "c3")
STANDSTILL = arrays.zeros(1, arrays.MOTION_PIECE)


class LoadArrays(NamedTuple):
    """The loads of one scene."""

    loads: arrays.Records  # (l,) LOAD
    pieces: arrays.Records  # (k,) LOAD_PIECE
    push: float  # m/s2: no load gives a point of a body more, with water no deeper than at the start
    end: float  # s: from then on none changes with time


@derived(*GEOMETRY, "loads", "actuators", "gravity")
def load_arrays(model: Model) -> LoadArrays:
    """Return the loads of a scenario in its order, then its actuators, whose stiffness follows from the step."""
    scenario, placed, acting = model.scenario, model.bodies, model.acting_loads
    numbers = {body.name: number for number, body in enumerate(placed)} if scenario.actuators else {}
    records = arrays.zeros(len(acting) + len(scenario.actuators), arrays.LOAD)
    rows: list[loads.Stretch] = []
    pushes, end = {open_faces.ALL: 0.0}, 0.0  # by body
    for record, one in zip(records, acting, strict=False):
        load = one.load
        stretches = loads.stretches_of(load, scenario.ground.tilt)
        largest = max(abs(one.value) for one in stretches)
        fields, own = _fields(scenario, one, placed, largest)
        for name, value in fields.items():
            record[name] = value
        record["body"] = max(one.body, 0)
        record["first_piece"], record["last_piece"] = len(rows), len(rows) + len(stretches)
        level = 1.0  # m: of water the history is that of the level
        if isinstance(load, loads.Pressure) and load.water_level is not None:
            level = load.water_level
        rows += [part._replace(value=level * part.value, rate=level * part.rate) for part in stretches]
        pushes[one.body] = pushes.get(one.body, 0.0) + own
        end = max(end, stretches[-1].start)
    push = pushes.pop(open_faces.ALL) + max(pushes.values(), default=0.0)
    for record, actuator in zip(records[len(acting) :], scenario.actuators, strict=True):
        path, body = actuators.stretches_of(actuator.displacement), placed[numbers[actuator.body]]
        record.kind, record.body, (record.x, record.y) = arrays.LOAD_ACTUATOR, numbers[actuator.body], actuator.point
        record.fx, record.fy = math.cos(actuator.direction), math.sin(actuator.direction)
        record.base_x, record.base_y = body.ground_point(*actuator.point)
        record.least = 0.0 if actuator.sense == "push" else -math.inf
        record.most = 0.0 if actuator.sense == "pull" else math.inf
        record.fastest = max(abs(one.rate) for one in path)
        record.first_piece, record.last_piece = len(rows), len(rows) + len(path)
        rows += path
        end = max(end, path[-1].start)
    pieces = arrays.zeros(len(rows), arrays.LOAD_PIECE)
    for name, column in zip(loads.Stretch._fields, zip(*rows, strict=True), strict=False):
        pieces[name] = column
    return LoadArrays(records, pieces, push, end)


def _fields(
    scenario: Scenario, acting: open_faces.ActingLoad, placed: Sequence[PlacedBody], largest: float
) -> tuple[dict[str, float], float]:
    """Return the fields of the record of a load as it acts, but for its body and pieces, and a bound of its push.

    That is what it gives a point of a body (m/s2) beyond gravity of its usual size, with a factor of `largest`.
    """
    load, tilt, gravity = acting.load, scenario.ground.tilt, scenario.gravity.magnitude
    if isinstance(load, loads.Gravity):  # its magnitude turns; both together get larger by twice the coefficients
        kept_x, kept_y = gravity * scenario.gravity.horizontal, gravity * scenario.gravity.vertical
        fields = {"kind": arrays.LOAD_TILT, "fx": gravity, "base_x": kept_x, "base_y": kept_y}
        return fields, 2.0 * math.hypot(kept_x, kept_y)
    if isinstance(load, loads.Horizontal):
        size = load.magnitude * gravity
        fields = {"kind": arrays.LOAD_FIELD, "fx": size * math.cos(tilt), "fy": -size * math.sin(tilt)}
        return fields, largest * abs(load.magnitude) * gravity
    body = placed[acting.body]
    radius = body.radius
    if isinstance(load, loads.Moment):
        fields = {"kind": arrays.LOAD_FORCE, "torque": load.magnitude}
        return fields, largest * (abs(load.magnitude) * radius / body.inertia)
    if isinstance(load, loads.Force):
        x, y = load.point
        fx, fy = load.magnitude * math.cos(load.direction), load.magnitude * math.sin(load.direction)
        fields = {"kind": arrays.LOAD_FORCE, "x": x, "y": y, "fx": fx, "fy": fy, "turns": load.axes == "body"}
        base_x, base_y = body.ground_point(x, y)
        fields |= {"stays": load.line == "space", "base_x": base_x, "base_y": base_y}
        force, arm = abs(load.magnitude), math.hypot(*load.point)
    else:
        (x0, y0), (x1, y1), (nx, ny) = acting.edge
        length = math.hypot(x1 - x0, y1 - y0)
        fields = {"kind": arrays.LOAD_FORCE, "x": 0.5 * (x0 + x1), "y": 0.5 * (y0 + y1), "turns": 1.0}
        if load.magnitude is not None:
            force = load.magnitude * length * body.depth
            fields |= {"fx": -nx * force, "fy": -ny * force}
        else:
            fields |= {"kind": arrays.LOAD_WATER, "x": x0, "y": y0, "end_x": x1, "end_y": y1}
            fields |= {"fx": -nx * body.depth, "fy": -ny * body.depth}
            fields |= {"unit_weight": load.unit_weight * length, "up_x": math.sin(tilt), "up_y": math.cos(tilt)}
        deepest = abs(load.magnitude or 0.0)
        if load.water_level is not None:
            deepest = load.unit_weight * (load.water_level + math.hypot(body.x, body.y) + radius)
        force, arm = deepest * (length * body.depth), radius
    return fields, largest * (force / body.mass + force * arm * radius / body.inertia)


STIFF = 0.2
"""Frequency of an actuator alone with its body, times the substep, where contacts are rigid: stable up to 0.82."""
STIFF_ON_SPRINGS = 1.0 / 30.0
"""The same where contacts are springs: a third of the fastest of those, at the usual step."""


def compliances(model: Model) -> list[float]:
    """Return what a force at the point of each actuator accelerates it by, at most (1/kg)."""
    jacks = model.scenario.actuators
    bodies = {body.name: body for body in model.bodies} if jacks else {}
    held = [(bodies[one.body], math.hypot(*one.point)) for one in jacks]
    return [1.0 / body.mass + arm**2 / body.inertia for body, arm in held]


def springs_of(model: Model, step: float) -> list[tuple[float, float]]:
    """Return stiffness (N/m) and damping (N s/m) of all actuators of a run with steps of this length (s).

    Where no stiffness is given the body alone would swing as fast on it as a substep resolves well. The dashpot damps
    that critically.
    """
    scenario = model.scenario
    share = STIFF_ON_SPRINGS if scenario.time.has_springs else STIFF
    frequency = share * scenario.time.parts / step
    springs = []
    for one, compliance in zip(scenario.actuators, compliances(model), strict=True):
        stiffness = frequency**2 / compliance if one.stiffness is None else one.stiffness
        springs.append((stiffness, 2.0 * math.sqrt(stiffness / compliance)))
    return springs


def greatest_frequency(model: Model) -> float:
    """Return the greatest angular frequency (1/s) of bodies on actuators whose stiffness is given; zero without."""
    pairs = zip(model.scenario.actuators, compliances(model), strict=True)
    return max((math.sqrt(one.stiffness * compliance) for one, compliance in pairs if one.stiffness), default=0.0)


def greatest_head_speed(scenario: Scenario) -> float:
    """Return the greatest speed (m/s) of the head of an actuator."""
    paths = (actuators.stretches_of(one.displacement) for one in scenario.actuators)
    return max((abs(one.rate) for path in paths for one in path), default=0.0)


def steepest_tilt(scenario: Scenario) -> float:
    """Return the greatest slope (rad) that gravity has in a run, without its sign."""
    tilt = scenario.ground.tilt
    turns = (loads.stretches_of(load, tilt) for load in scenario.loads if isinstance(load, loads.Gravity))
    return max(map(abs, (tilt, *(one.value for stretches in turns for one in stretches))))


class Drives(NamedTuple):
    """Driven bodies of one scene, and the pieces of all motions."""

    driven: arrays.Records  # (d,) MOVED
    pieces: arrays.Records  # (m,) MOTION_PIECE: of all paths of driven bodies, then of the support
    paths: int  # how many pieces the former have


@derived(*GEOMETRY, "motion", "time")
def drive_records(model: Model) -> Drives:
    """Return all that moves as prescribed in a scenario."""
    drives, placed, support = model.drives, model.bodies, STANDSTILL
    if model.scenario.motion is not None:  # where it ends before the run, its last piece is constant
        support = _piece_records(model.motion)
        support = support if support.size else STANDSTILL
    driven, pieces, count = arrays.zeros(len(drives), arrays.MOVED), [], 0
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
            pieces.append(_piece_records(one))
    if not drives:
        return Drives(driven, support, 0)
    together = arrays.zeros(count + support.size, arrays.MOTION_PIECE)
    together[:] = np.concatenate([*pieces, support])
    return Drives(driven, together, count)


def _piece_records(pieces: motion.MotionPieces) -> arrays.Records:
    records = arrays.zeros(len(pieces.coefficients), arrays.MOTION_PIECE)
    records["start"] = pieces.times[:-1]
    for k, name in enumerate(COEFFICIENTS):
        records[name] = pieces.coefficients[:, k]
    return records


def drive_bounds(model: Model) -> tuple[float, float]:
    """Return the greatest speed (m/s) of any point of a driven body, and how far (m) these may lift what lies on them.

    They lift it as far as they go up along their path; one that turns also by twice its distance from the point. Both
    are zero where no body is driven.
    """
    speed = rise = 0.0
    for drive in model.drives:
        body = model.bodies[drive.body]
        reach = math.dist((body.x, body.y), drive.about) + body.radius
        speed = max(speed, motion.greatest_rate(drive.shift) + reach * motion.greatest_rate(drive.turn))
        c0, c1, c2, c3 = drive.shift.coefficients.T
        length = np.diff(drive.shift.times)[: len(c0)]
        ends = np.concatenate([c0, c0 + length * (c1 + length * (c2 + length * c3))])
        up = max(0.0, float(np.max(drive.along[1] * ends)))
        rise = max(rise, up + (2.0 * reach if drive.turn.coefficients[:, 1:].any() else 0.0))
    return speed, rise
