"""Loads of a scenario as the arrays that kernels read, and bounds of what they do."""

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
    Records,
    zeros,
)
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.load_places import NORMALS, face_of
from blocksim.scenario.models.history import Stretch
from blocksim.scenario.models.loads import AnyLoad, Face, Force, Gravity, Horizontal, Moment, OnBody, Pressure
from blocksim.scenario.outlines import Corner


class Applied(NamedTuple):
    """The loads of one scene."""

    loads: Records  # (l,) LOAD
    pieces: Records  # (k,) LOAD_PIECE
    push: float  # m/s2: no load gives a point of a body more, with water no deeper than at the start
    end: float  # s: from then on none changes with time


def applied_loads(scenario: Scenario, placed: Sequence[PlacedBody]) -> Applied:
    """Return the loads of a scenario, in its order."""
    numbers = {body.name: number for number, body in enumerate(placed)} if scenario.loads else {}
    histories = [stretches_of(scenario, load) for load in scenario.loads]
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
    return Applied(
        loads, pieces, sum(_pushes(scenario, placed)), max((one[-1].start for one in histories), default=0.0)
    )


def stretches_of(scenario: Scenario, load: AnyLoad) -> tuple[Stretch, ...]:
    """Return the factor of a load, or the tilt (rad) of gravity that turns, over time."""
    return load.stretches_from(scenario.ground.tilt) if isinstance(load, Gravity) else load.stretches()


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
        largest = max(abs(one.value) for one in load.stretches())
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
    tilts = [one.value for load in scenario.loads if isinstance(load, Gravity) for one in stretches_of(scenario, load)]
    return max(abs(tilt) for tilt in (scenario.ground.tilt, *tilts))


def stacked(applied: Sequence[Applied]) -> tuple[Records, Records]:
    """Return loads (m, l) and pieces (m, k) of scenes of one shape."""
    loads, pieces = (zeros((len(applied), one.size), one.dtype) for one in applied[0][:2])
    for number, one in enumerate(applied):
        loads.view(np.ndarray)[number] = one.loads
        pieces.view(np.ndarray)[number] = one.pieces
    return loads, pieces
