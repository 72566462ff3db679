"""Loads and held bodies that do not fit those of a scenario: unknown or fixed ones, points outside, covered faces."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain

from blocksim.scenario.findings import Finding
from blocksim.scenario.models.loads import Face, Force, Gravity, OnBody, Pressure
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.outlines import Corner, edges_of, holds
from blocksim.scenario.overlap import Outlines, Rectangles, crossings, near_pairs, penetration
from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.quantities import shown
from blocksim.scenario.segments import profile_segments, wall_segments
from blocksim.scenario.spelling import did_you_mean_or_list

MAX_LOADS = 1000
STRIP = 1e-3
"""Thickness of the strip before a face in which nothing else may lie, in smaller sides of the body."""
NORMALS: Mapping[Face, tuple[float, float]] = {
    "left": (-1.0, 0.0),
    "right": (1.0, 0.0),
    "top": (0.0, 1.0),
    "bottom": (0.0, -1.0),
}
"""Outward normals of faces, in the body."""
PARALLEL = 1e-6
"""Sine of the angle between the normal of a face and the axis of an outline that it is named after, at most."""


def unfit_loads(scenario: Scenario, bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find loads that do not fit the placed bodies, and bodies that cannot be held; all is valid otherwise."""
    loads = scenario.loads
    if len(loads) > MAX_LOADS:
        yield Finding(("loads",), f"{len(loads)} loads are too many; at most {MAX_LOADS} are allowed")
        return
    by_name = {body.name: body for body in bodies} if loads or scenario.start.hold else {}
    names: set[str] = set()
    turns = False
    for number, load in enumerate(loads):
        if load.name is not None and load.name in names:
            yield Finding(("loads", number, "name"), f"two loads are named {shown(load.name)}")
        names.add(load.name or "")
        if isinstance(load, Gravity):
            if turns:
                yield Finding(("loads", number), "gravity turns already; one load of this kind is allowed")
            turns = True
        elif isinstance(load, OnBody):
            yield from _on_body(scenario, number, load, by_name)
    for number, name in enumerate(scenario.start.hold):
        if name not in by_name:
            hint = did_you_mean_or_list(name, by_name)
            yield Finding(("start", "hold", number), f"unknown body {shown(name)}, {hint}")
        elif by_name[name].fixed:
            yield Finding(("start", "hold", number), f"body {shown(name)} is fixed and cannot be released")


def _on_body(scenario: Scenario, number: int, load: OnBody, bodies: Mapping[str, PlacedBody]) -> Iterator[Finding]:
    path = ("loads", number)
    body = bodies.get(load.body)
    if body is None:
        hint = did_you_mean_or_list(load.body, bodies)
        yield Finding((*path, "body"), f"unknown body {shown(load.body)}, {hint}")
    elif body.fixed:
        yield Finding((*path, "body"), f"body {shown(load.body)} is fixed; a load has no effect on it")
    elif isinstance(load, Force):
        half = (0.5 * body.size_x, 0.5 * body.size_y)
        if body.outline:
            is_inside = holds(body.outline, load.point, _margin(body))
        else:
            is_inside = all(abs(at) <= side * (1.0 + STRIP) for at, side in zip(load.point, half, strict=True))
        if not is_inside:
            size = f"{1e3 * body.size_x:g} x {1e3 * body.size_y:g} mm"
            about = f"an outline in a box of {size}" if body.outline else f"{size} about its centre"
            yield Finding((*path, "point"), f"the point lies outside of body {shown(load.body)}, {about}")
    elif isinstance(load, Pressure) and face_of(body, load.face) is None:
        message = f"the outline of body {shown(load.body)} has no face whose normal points exactly that way"
        yield Finding((*path, "face"), message)
    elif isinstance(load, Pressure):
        other = next(_covers(scenario, load, body, [*bodies.values()]), None)
        if other is not None:
            message = f"this face of body {shown(load.body)} is covered by {other}; pressure needs a free face"
            yield Finding((*path, "face"), message)


def face_of(body: PlacedBody, face: Face) -> tuple[Corner, Corner] | None:
    """Return the middle of a face and half its extents along x and y (m, in the body); None where there is none."""
    nx, ny = NORMALS[face]
    for (ax, ay), (bx, by), (x, y) in edges_of(body.corners):
        if nx * x + ny * y > 0.0 and abs(nx * y - ny * x) <= PARALLEL:
            return (0.5 * (ax + bx), 0.5 * (ay + by)), (0.5 * abs(bx - ax), 0.5 * abs(by - ay))
    return None


def _covers(scenario: Scenario, load: Pressure, body: PlacedBody, bodies: Sequence[PlacedBody]) -> Iterator[str]:
    """Yield what lies against a part of a face that is more than a line."""
    strip = strip_before(body, load.face)
    if scenario.ground.profile is None and float(Outlines.of([strip]).bottom[0]) < -_margin(body):
        yield "the ground"
    for _, segment, depth in crossings([strip], (*profile_segments(scenario), *wall_segments(scenario))):
        if depth > _margin(body):
            yield "the ground" if segment < len(profile_segments(scenario)) else "a wall"
    boxes = Rectangles.of([strip, *bodies])
    for one, other in chain.from_iterable(zip(*pairs, strict=True) for pairs in near_pairs(boxes)):
        first, second = sorted((int(one), int(other)))
        if first == 0 and bodies[second - 1] is not body:
            depth = float(penetration(Outlines.of([strip]), Outlines.of([bodies[second - 1]]))[0])
            if depth > _margin(body):
                yield f"body {shown(bodies[second - 1].name)}"


def _margin(body: PlacedBody) -> float:
    """Return how far (m) anything may reach into the strip: half of it."""
    return 0.5 * STRIP * body.least_width


def strip_before(body: PlacedBody, face: Face) -> PlacedBody:
    """Return the strip before a face of a body, a little shorter than the face at both ends."""
    thickness = STRIP * body.least_width
    nx, ny = NORMALS[face]
    (x, y), (half_x, half_y) = face_of(body, face) or ((0.0, 0.0), (0.0, 0.0))
    x, y = x + 0.5 * nx * thickness, y + 0.5 * ny * thickness
    size_x, size_y = (thickness, 2.0 * (half_y - thickness)) if nx else (2.0 * (half_x - thickness), thickness)
    cosine, sine = math.cos(body.angle), math.sin(body.angle)
    return body._replace(
        size_x=size_x,
        size_y=size_y,
        x=body.x + cosine * x - sine * y,
        y=body.y + sine * x + cosine * y,
        outline=(),
    )
