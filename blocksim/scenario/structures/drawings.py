"""Drawings, whatever their format: outlines, what a file says about itself, why it cannot be read; and GeoJSON."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from blocksim.scenario import geometry, units as q

STRAY = 1e-6
"""Of the size of a block: how far its ends may be apart, and a point from the line between its neighbours."""
FARTHEST = 1e12
COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
DEEPEST = 20
EARTH = (180.0, 90.0)  # largest longitude and latitude
SMALL_IN_DEGREES, FAR_IN_DEGREES = 0.02, 10.0
"""Extent (2 km as degrees, 20 mm as metres), and distance from the origin in extents, of longitudes and latitudes."""


class DrawingOutline(NamedTuple):
    """One outline of a drawing, its coordinates as they are there."""

    outline: list[geometry.Corner]
    name: str  # for messages
    properties: Mapping[str, Any]  # block, fixed, name


class Drawing(NamedTuple):
    """The outlines in a drawing."""

    outlines: list[DrawingOutline]
    remarks: tuple[str, ...] = ()  # what was not read
    unit: tuple[str, float] | None = None  # its name and size (m), where the file has one
    degrees: str = ""  # why coordinates look like longitudes and latitudes


class DrawingError(ValueError):
    """A drawing that cannot be read, or an outline in it that no block can have; the text says which."""


def place_text(x: float, y: float) -> str:
    """Return a place with all digits that matter."""
    return f"({x:.12g}, {y:.12g})"


def point_of(values: Any, name: str) -> geometry.Corner:
    """Return the first two coordinates of a point. Raises DrawingError with the name of its outline."""
    try:
        x, y = (float(value) for value in values[:2])
    except (TypeError, ValueError):
        raise DrawingError(f"{name}: {str(values)[:40]} is not a pair of numbers") from None
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST):
        raise DrawingError(f"{name}: {place_text(x, y)} is not a place")
    return x, y


def simplify(points: Sequence[geometry.Corner]) -> list[geometry.Corner]:
    """Return an outline without points that repeat or lie within a straight edge, and not closed."""
    low, high = geometry.box_of(points) if points else ((0.0, 0.0), (0.0, 0.0))
    near = STRAY * math.dist(low, high)
    following = [*points[1:], *points[:1]]
    corners = [point for point, after in zip(points, following, strict=True) if math.dist(point, after) > near]
    number = 0
    while number < len(corners) > geometry.FEWEST:
        before, here, after = corners[number - 1], corners[number], corners[(number + 1) % len(corners)]
        (x, y), (u, v) = ((x1 - before[0], y1 - before[1]) for x1, y1 in (after, here))
        length = math.hypot(x, y)
        if length > 0.0 and abs(x * v - y * u) <= near * length and 0.0 <= x * u + y * v <= length * length:
            corners.pop(number)
        else:
            number += 1
    return corners


def read_geojson(content: bytes) -> Drawing:
    """Return the polygons of a file. Raises DrawingError, and what reading JSON raises."""
    found = [*_polygons(json.loads(content), "", {}, DEEPEST)]
    points = [point for one in found for point in one.outline]
    high = sum(len(point) > 2 for point in points)
    remarks = (f"third coordinates of {high} points are not read",) if high else ()
    outlines = [
        one._replace(outline=[point_of(point, one.name) for point in one.outline], properties=_texts(one.properties))
        for one in found
    ]
    return Drawing(outlines, remarks, degrees=_degrees([point for one in outlines for point in one.outline]))


def _texts(properties: Mapping[str, Any]) -> dict[str, Any]:
    """Return properties whose names of blocks are text where they are numbers."""
    numbers = {
        key: str(value)
        for key in ("name", "block")
        if isinstance(value := properties.get(key), int | float) and not isinstance(value, bool)
    }
    return {**properties, **numbers}


def _degrees(points: list[geometry.Corner]) -> str:
    """Return why the coordinates look like longitudes and latitudes; empty if they do not."""
    low, high = geometry.box_of(points or [(0.0, 0.0)])
    extent, far = math.dist(low, high), max(min(abs(a), abs(b)) for a, b in zip(low, high, strict=True))
    is_on_earth = all(max(abs(a), abs(b)) <= most for a, b, most in zip(low, high, EARTH, strict=True))
    if not (is_on_earth and extent < SMALL_IN_DEGREES and far > FAR_IN_DEGREES * extent):
        return ""
    ends = f"{place_text(*low)} to {place_text(*high)}"
    return f"{ends} look like degrees of longitude and latitude; project them to metres, or give their unit"


def _polygons(node: Any, name: str, properties: Mapping[str, Any], depth: int) -> Iterator[DrawingOutline]:
    """Yield the polygons of a part of a file, points as they are; `name` is that part in messages, empty for a file."""
    place = f"{name}: " if name else ""
    kind = node.get("type") if isinstance(node, dict) else None
    if depth == 0:
        raise DrawingError(f"{place}collections are nested too deeply")
    if kind is None:
        raise DrawingError(f"{place}it has no type" if name else "not a GeoJSON file: it has no type")
    if kind in COLLECTIONS:
        for number, part in enumerate(_part(node, COLLECTIONS[kind], list, place), start=1):
            inner = f"feature {number}" if kind == "FeatureCollection" else f"geometry {number}"
            yield from _polygons(part, ", ".join(filter(None, (name, inner))), properties, depth - 1)
    elif kind == "Feature":
        own = node.get("properties") or {}
        if not isinstance(own, dict):
            raise DrawingError(f"{place}its properties are no names with values")
        called = own.get("name")
        name = name if called is None else f"{name or 'feature'} {q.toml(str(called))}"
        parts = [*_polygons(_part(node, "geometry", dict, f"{name}: " if name else ""), name, own, depth - 1)]
        is_divided = len(parts) > 1 and called is not None
        for number, part in enumerate(parts, start=1):
            yield part._replace(properties=own | {"name": f"{called}-{number}"}) if is_divided else part
    elif kind in ("Polygon", "MultiPolygon"):
        coordinates = _part(node, "coordinates", list, place)
        several = [coordinates] if kind == "Polygon" else coordinates
        for number, rings in enumerate(several, start=1):
            inner = f"polygon {number}" if len(several) > 1 else ""
            place = ", ".join(filter(None, (name, inner))) or "polygon"
            if not rings:
                raise DrawingError(f"{place}: a polygon without corners")
            if len(rings) > 1:
                holes = "a hole" if len(rings) == 2 else f"{len(rings) - 1} holes"
                raise DrawingError(f"{place}: a polygon with {holes}; blocks have none")
            yield DrawingOutline([*rings[0]], place, properties)
    else:
        raise DrawingError(f"{place}{q.toml(kind)} is not a polygon")


def _part(node: Mapping[str, Any], key: str, kind: type, place: str) -> Any:
    """Return what a part of a file has under a key, of the kind that belongs there."""
    found = node.get(key)
    if not isinstance(found, kind):
        raise DrawingError(f"{place}it has no {key}")
    return found
