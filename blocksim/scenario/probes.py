"""Probes of a scenario: their names, the bodies and supports that they are about, and the joints between bodies."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from blocksim.scenario.events import wall_names
from blocksim.scenario.findings import Finding
from blocksim.scenario.keys import KeyPath
from blocksim.scenario.models.probe import ForceProbe, JointProbe, PointProbe
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.outlines import edges_of
from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.quantities import shown
from blocksim.scenario.segments import TOLERANCE
from blocksim.scenario.spelling import did_you_mean_or_list

GROUND, WALL, WALLS, SUPPORTS = "ground", "wall", "walls", "supports"
LEAST_ANGLE = 1.0
PARALLEL = math.sin(math.radians(LEAST_ANGLE))
"""Sine of the angle between two faces up to which they make a joint: corners of drawings are rounded."""
LEAST_SHARE = 1e-6
"""Of the smallest width of both: what faces share at least, and by how much they may overlap across."""
Point = tuple[float, float]


def probe_names(scenario: Scenario) -> list[str]:
    """Return the names of all probes; one without a name is called by its kind and its number from 1."""
    return [probe.name or f"{probe.kind}{number}" for number, probe in enumerate(scenario.probes, start=1)]


def unfit_probes(scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find names given twice, bodies and supports that do not exist, and bodies without a joint."""
    seen: set[str] = set()
    for number, name in enumerate(probe_names(scenario)):
        if name in seen:
            yield Finding(("probes", number, "name"), f"two probes are named {shown(name)}")
        seen.add(name)
    bodies = {body.name: body for body in placed}
    others = [str(name) for tables in scenario.systems.values() for one in tables if (name := getattr(one, "name", ""))]
    known = [*bodies, *support_words(scenario), *others]
    for number, probe in enumerate(scenario.probes):
        path = ("probes", number)
        match probe:
            case ForceProbe():
                named = {"on": probe.on} if probe.by is None else {"on": probe.on, "by": probe.by}
                yield from _unknown([((*path, key), name) for key, name in named.items()], known)
                if probe.by == probe.on:
                    yield Finding((*path, "by"), f"{shown(probe.by)} exerts no force on itself")
            case PointProbe():
                yield from _unknown([((*path, "body"), probe.body)], [*bodies])
            case JointProbe():
                unknown = [*_unknown([((*path, "bodies", i), name) for i, name in enumerate(probe.bodies)], [*bodies])]
                yield from unknown
                if not unknown and joint_between(*(bodies[name] for name in probe.bodies)) is None:
                    message = (
                        f"bodies {probe.bodies[0]} and {probe.bodies[1]} have no faces that lie opposite each other"
                    )
                    yield Finding((*path, "bodies"), f"{message} at the start, parallel within {LEAST_ANGLE:g} deg")


def support_words(scenario: Scenario) -> list[str]:
    """Return the words that mean supports: ground, walls together and one by one, all supports."""
    return [GROUND, SUPPORTS, *([WALLS] if scenario.walls else []), *wall_names(scenario)]


def _unknown(named: Sequence[tuple[KeyPath, str]], known: Sequence[str]) -> Iterator[Finding]:
    for path, name in named:
        if name not in known:
            yield Finding(path, f"unknown body {shown(name)}, {did_you_mean_or_list(name, known)}")


class Joint(NamedTuple):
    """A joint between bodies a and b at the start, in the own axes of each (m).

    Its two ends as points of a and of b, straight across the gap that there is at each of them, the outward normal of
    a's face, and the tangent along it, which is the normal turned by -90 degrees: towards +x where b lies on a. The
    first end is the one farther back along the tangent.
    """

    ends_of_a: tuple[Point, Point]
    ends_of_b: tuple[Point, Point]
    normal: Point
    tangent: Point


def joint_between(a: PlacedBody, b: PlacedBody) -> Joint | None:
    """Return the joint between the faces of two bodies that lie opposite each other, None where none do.

    The faces are parallel but for `PARALLEL`, and overlap along each other. Of several such pairs that with the widest
    gap is the joint.
    """
    found = [one for one in (_facing(a, b, *edge) for edge in edges_of(a.corners)) if one is not None]
    return max(found, key=lambda one: one[0])[1] if found else None


def _facing(a: PlacedBody, b: PlacedBody, begin: Point, end: Point, normal: Point) -> tuple[float, Joint] | None:
    """Return the least gap (m) and the joint between a face of a and the face of b opposite it."""
    opposite = _opposite(a, b, normal)
    if opposite is None:
        return None
    tangent = (normal[1], -normal[0])
    across, along = np.array(opposite) @ np.array(normal), np.array(opposite) @ np.array(tangent)
    half = _dot(begin, normal)
    first, last = max(float(along.min()), _dot(end, tangent)), min(float(along.max()), _dot(begin, tangent))
    smallest = min(a.least_width, b.least_width)
    order = np.argsort(along)
    gaps = (np.interp((first, last), along[order], across[order]) - half).tolist()
    if min(gaps) < -max(TOLERANCE, LEAST_SHARE * smallest) or last - first < LEAST_SHARE * smallest:
        return None
    ends = [(half * normal[0] + s * tangent[0], half * normal[1] + s * tangent[1]) for s in (first, last)]
    places = [(x + gap * normal[0], y + gap * normal[1]) for (x, y), gap in zip(ends, gaps, strict=True)]
    of_b = [_local(b, *_placed(a, *point)) for point in places]
    return min(gaps), Joint((ends[0], ends[1]), (of_b[0], of_b[1]), normal, tangent)


def _opposite(a: PlacedBody, b: PlacedBody, normal: Point) -> tuple[Point, Point] | None:
    """Return the ends of the face of b that is parallel to one of a with this normal and faces it, in the axes of a."""
    edges = edges_of([_local(a, *_placed(b, *corner)) for corner in b.corners])
    begin, end, of_b = min(edges, key=lambda edge: _dot(edge[2], normal))
    return (begin, end) if abs(of_b[0] * normal[1] - of_b[1] * normal[0]) <= PARALLEL else None


def _dot(one: Point, other: Point) -> float:
    return one[0] * other[0] + one[1] * other[1]


def _placed(body: PlacedBody, x: float, y: float) -> Point:
    """Return where a point of a body is (m), given in its own axes."""
    cosine, sine = math.cos(body.angle), math.sin(body.angle)
    return body.x + cosine * x - sine * y, body.y + sine * x + cosine * y


def _local(body: PlacedBody, x: float, y: float) -> Point:
    """Return a point (m) in the own axes of a body."""
    cosine, sine = math.cos(body.angle), math.sin(body.angle)
    return cosine * (x - body.x) + sine * (y - body.y), cosine * (y - body.y) - sine * (x - body.x)
