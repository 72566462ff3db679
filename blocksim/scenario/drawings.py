"""Outlines of blocks in drawings: polygons of a GeoJSON file and closed polylines of a DXF file."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from blocksim.errors import BlocksimError
from blocksim.extras import loaded
from blocksim.scenario import outlines
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.scenario.outlines import Corner
from blocksim.scenario.quantities import shown

MOST_BYTES = 20 * MEGABYTE
MOST_OUTLINES, MOST_CORNERS = 2000, 16_000
"""In a drawing; the scenario that is kept with the results has them all, and a scenario has a megabyte at most."""
STRAY = 1e-6
"""Distance of a point from the line through its neighbours, in sizes of the block, up to which it is left out."""
DXF = "dxf"
DXF_APPLICATION = "BLOCKSIM"
"""Of the extended data of a polyline: the name of a block (text), and whether it is fixed (integer)."""
DXF_TEXT, DXF_INTEGER = 1000, 1070  # group codes
FARTHEST = 1e12
COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
DEEPEST = 20
DAMAGE = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""What readers raise for a file that is no drawing."""


class Drawn(NamedTuple):
    """One outline of a drawing, its coordinates as they are there."""

    outline: list[Corner]
    name: str  # for messages
    properties: Mapping[str, Any]  # block, fixed, name


class DrawingError(ValueError):
    """A drawing that cannot be read, or an outline in it that no block can have; the text says which."""


def read_drawing(path: Path) -> list[Drawn]:
    """Return the outlines in a drawing; points within straight edges are left out.

    Raises DrawingError, and UnavailableError for DXF without its package.
    """
    is_dxf = path.suffix.lower() == f".{DXF}"
    ezdxf = loaded("ezdxf", f"reading {path.name}", DXF) if is_dxf else None
    damage = DAMAGE if ezdxf is None else (ezdxf.DXFError, *DAMAGE)
    try:
        content = read_limited(path, MOST_BYTES)  # no file that is larger, no pipe
        if ezdxf is not None:
            found = [*_polylines(ezdxf.readfile(path).modelspace())]
        else:
            found = [*_polygons(json.loads(content), "", {}, DEEPEST)]
    except DrawingError:
        raise
    except BlocksimError as error:
        raise DrawingError(str(error)) from None
    except damage as error:
        raise DrawingError(f"not a {'DXF' if is_dxf else 'GeoJSON'} file: {str(error)[:100]}") from None
    if not found:
        raise DrawingError("no closed polyline in it" if is_dxf else "no polygon in it")
    if len(found) > MOST_OUTLINES or sum(len(one.outline) for one in found) > MOST_CORNERS:
        most = f"at most {MOST_OUTLINES} with {MOST_CORNERS} corners are allowed"
        raise DrawingError(f"{len(found)} outlines are too many; {most}")
    outlines_found = [one._replace(outline=simplified(one.outline)) for one in found]
    for one in outlines_found:
        for number, message in outlines.faults(one.outline):
            place = "" if number is None else ", corner ({:g}, {:g})".format(*one.outline[number])
            raise DrawingError(f"{one.name}{place}: {message}")
    return outlines_found


def simplified(points: Sequence[Corner]) -> list[Corner]:
    """Return an outline without points that repeat or lie within a straight edge, and not closed."""
    corners = [point for number, point in enumerate(points) if point != points[(number + 1) % len(points)]]
    low, high = outlines.box_of(corners) if corners else ((0.0, 0.0), (0.0, 0.0))
    near = STRAY * math.dist(low, high)
    number = 0
    while number < len(corners) > outlines.FEWEST:
        before, here, after = corners[number - 1], corners[number], corners[(number + 1) % len(corners)]
        (x, y), (u, v) = ((x1 - before[0], y1 - before[1]) for x1, y1 in (after, here))
        length = math.hypot(x, y)
        if length > 0.0 and abs(x * v - y * u) <= near * length and 0.0 <= x * u + y * v <= length * length:
            corners.pop(number)
        else:
            number += 1
    return corners


def _polygons(node: Any, name: str, properties: Mapping[str, Any], depth: int) -> Iterator[Drawn]:
    """Yield the polygons of a part of a file; `name` is that part in messages, empty for the whole file."""
    place = f"{name}: " if name else ""
    kind = node.get("type") if isinstance(node, dict) else None
    if depth == 0:
        raise DrawingError("collections are nested too deeply")
    if kind is None:
        raise DrawingError(f"{place}it has no type" if name else "not a GeoJSON file: it has no type")
    if kind in COLLECTIONS:
        for number, part in enumerate(_part(node, COLLECTIONS[kind], list, place), start=1):
            inner = f"feature {number}" if kind == "FeatureCollection" else f"geometry {number}"
            yield from _polygons(part, inner, properties, depth - 1)
    elif kind == "Feature":
        own = node.get("properties") or {}
        if not isinstance(own, dict):
            raise DrawingError(f"{place}its properties are no names with values")
        yield from _polygons(_part(node, "geometry", dict, place), name, own, depth - 1)
    elif kind in ("Polygon", "MultiPolygon"):
        coordinates = _part(node, "coordinates", list, place)
        several = [coordinates] if kind == "Polygon" else coordinates
        yield from (_polygon(rings, name, properties) for rings in several)
    else:
        raise DrawingError(f"{place}{shown(kind)} is not a polygon")


def _part(node: Mapping[str, Any], key: str, kind: type, place: str) -> Any:
    """Return what a part of a file has under a key, of the kind that belongs there."""
    found = node.get(key)
    if not isinstance(found, kind):
        raise DrawingError(f"{place}it has no {key}")
    return found


def _polygon(rings: Any, name: str, properties: Mapping[str, Any]) -> Drawn:
    place = f"{name}: " if name else ""
    if not rings:
        raise DrawingError(f"{place}a polygon without corners")
    if len(rings) > 1:
        holes = "a hole" if len(rings) == 2 else f"{len(rings) - 1} holes"
        raise DrawingError(f"{place}a polygon with {holes}; blocks have none")
    return Drawn([_point(point) for point in rings[0]], name or "polygon", properties)


def _point(values: Any) -> Corner:
    x, y = (float(value) for value in values[:2])
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST):
        raise DrawingError(f"({x:g}, {y:g}) is not a place")
    return x, y


def _polylines(space: Any) -> Iterator[Drawn]:
    for entity in space.query("LWPOLYLINE POLYLINE"):
        name = f"polyline {entity.dxf.handle} in layer {entity.dxf.layer}"
        is_light = entity.dxftype() == "LWPOLYLINE"
        places = entity.get_points("xy") if is_light else [(place.x, place.y) for place in entity.points()]
        points = [_point(place) for place in places]
        if not (entity.closed if is_light else entity.is_closed) and points[:1] != points[-1:]:
            continue
        if entity.has_arc:
            raise DrawingError(f"{name}: has arcs; blocks have straight edges")
        layer = {} if entity.dxf.layer == "0" else {"block": entity.dxf.layer}
        tags = entity.get_xdata(DXF_APPLICATION) if entity.has_xdata(DXF_APPLICATION) else ()
        values = {tag.code: tag.value for tag in tags}  # as `blocksim export` has written them
        names = {"name": str(values[DXF_TEXT])} if DXF_TEXT in values else {}
        fixed = {"fixed": bool(values[DXF_INTEGER])} if DXF_INTEGER in values else {}
        yield Drawn(points, name, layer | names | fixed)
