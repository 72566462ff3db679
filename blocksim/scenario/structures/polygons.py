"""Blocks by their corners where they are: written out, or from polygons in GeoJSON or closed polylines in DXF."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import ValidationInfo, model_validator

from blocksim.errors import BlocksimError
from blocksim.extras import load_module
from blocksim.scenario import geometry, input_files, units as q
from blocksim.scenario.models.base import Identifier, Table, setting, table_path
from blocksim.scenario.models.geometry import COUNTS, Point
from blocksim.scenario.structures.base import Cell, PolygonStructure

MOST_BYTES = 20 * input_files.MEGABYTE
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


class DrawingOutline(NamedTuple):
    """One outline of a drawing, its coordinates as they are there."""

    outline: list[geometry.Corner]
    name: str  # for messages
    properties: Mapping[str, Any]  # block, fixed, name


class DrawingError(ValueError):
    """A drawing that cannot be read, or an outline in it that no block can have; the text says which."""


def read_drawing(path: Path) -> list[DrawingOutline]:
    """Return the outlines in a drawing; points within straight edges are left out.

    Raises DrawingError, and UnavailableError for DXF without its package.
    """
    is_dxf = path.suffix.lower() == f".{DXF}"
    ezdxf = load_module("ezdxf", f"reading {path.name}", DXF) if is_dxf else None
    damage = DAMAGE if ezdxf is None else (ezdxf.DXFError, *DAMAGE)
    try:
        content = input_files.read_limited(path, MOST_BYTES)  # no file that is larger, no pipe
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
    found = [one._replace(outline=simplify(one.outline)) for one in found]
    for one in found:
        for number, message in geometry.faults(one.outline):
            place = "" if number is None else ", corner ({:g}, {:g})".format(*one.outline[number])
            raise DrawingError(f"{one.name}{place}: {message}")
    return found


def simplify(points: Sequence[geometry.Corner]) -> list[geometry.Corner]:
    """Return an outline without points that repeat or lie within a straight edge, and not closed."""
    corners = [point for number, point in enumerate(points) if point != points[(number + 1) % len(points)]]
    low, high = geometry.box_of(corners) if corners else ((0.0, 0.0), (0.0, 0.0))
    near = STRAY * math.dist(low, high)
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


def _polygons(node: Any, name: str, properties: Mapping[str, Any], depth: int) -> Iterator[DrawingOutline]:
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
        for rings in [coordinates] if kind == "Polygon" else coordinates:
            if not rings:
                raise DrawingError(f"{place}a polygon without corners")
            if len(rings) > 1:
                holes = "a hole" if len(rings) == 2 else f"{len(rings) - 1} holes"
                raise DrawingError(f"{place}a polygon with {holes}; blocks have none")
            yield DrawingOutline([_point(point) for point in rings[0]], name or "polygon", properties)
    else:
        raise DrawingError(f"{place}{q.toml(kind)} is not a polygon")


def _part(node: Mapping[str, Any], key: str, kind: type, place: str) -> Any:
    """Return what a part of a file has under a key, of the kind that belongs there."""
    found = node.get(key)
    if not isinstance(found, kind):
        raise DrawingError(f"{place}it has no {key}")
    return found


def _point(values: Any) -> geometry.Corner:
    x, y = (float(value) for value in values[:2])
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST):
        raise DrawingError(f"({x:g}, {y:g}) is not a place")
    return x, y


def _polylines(space: Any) -> Iterator[DrawingOutline]:
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
        yield DrawingOutline(points, name, layer | names | fixed)


MOST_SHRINK = 0.01  # of the least width of a block


class DrawnBlock(Table):
    """One block of a drawing."""

    outline: tuple[Point, ...] = setting("corners [x, y] of a convex block, in either sense", json_schema_extra=COUNTS)
    block: str | None = setting("the name of its block (default: that of the structure)", None)
    fixed: bool = setting("true for a body that never moves", default=False)
    name: Identifier | None = setting("name in tables (default: its number, from 1)", None)

    def _check(self) -> None:
        for number, message in geometry.faults(self.outline):
            raise q.invalid(message, "outline", *(() if number is None else (number,)))


class Polygons(PolygonStructure):
    """Blocks in `cells`, or in a GeoJSON or DXF file, of which results keep the blocks and not the file.

    A polygon of GeoJSON may have the properties block, fixed and name; the layer of a DXF polyline other than 0 is the
    name of its block. The block has the material, and [pairs] of materials say how joints behave.
    """

    kind: Literal["polygons"] = setting("kind of structure")
    cells_given: tuple[DrawnBlock, ...] = setting(
        "blocks, each with its outline; give these or table", (), alias="cells"
    )
    table: str | None = setting("GeoJSON or DXF file with an outline for each block", None)
    unit: q.PositiveLength = setting("unit of the coordinates in the file", 1.0)
    in_place: bool = setting("true keeps all coordinates, whatever left and bottom are", default=False)
    shrink: q.NonNegativeLength = setting(
        "how far every edge moves inwards, so that rounded coordinates, or blocks at rest, do not overlap", 0.0
    )

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: object, info: ValidationInfo) -> object:
        if not isinstance(data, Mapping) or "table" not in data:
            return data
        if "cells" in data:
            raise q.invalid("table and cells are both given; keep one of them", "table")
        unit = q.Quantity(q.LENGTH, above=0.0).read(data.get("unit", 1.0))
        path = table_path(data["table"], (info.context or {}).get("folder"), "wall.geojson", "table")
        try:
            drawn = read_drawing(path)
        except DrawingError as error:
            raise q.invalid(f"{path.name}: {error}", "table") from None
        cells = []
        for one in drawn:
            if "material" in one.properties and "block" not in one.properties:
                raise q.invalid(f"{path.name}: {one.name}: material is not read; name a block, which has one", "table")
            known = {key: one.properties.get(key) for key in ("block", "fixed", "name")}
            known = {key: value for key, value in known.items() if value is not None}
            cells.append({"outline": tuple((x * unit, y * unit) for x, y in one.outline), **known})
        return {**{key: value for key, value in data.items() if key not in ("table", "unit")}, "cells": tuple(cells)}

    def _check(self) -> None:
        if not 0 < len(self.cells_given) <= MOST_OUTLINES:
            message = f"{len(self.cells_given)} blocks; 1 to {MOST_OUTLINES} are allowed, in cells or in the file table"
            raise q.invalid(message)
        if not self.shrink:
            return
        width = min(geometry.least_width(tuple(one.outline)) for one in self.cells_given)
        if self.shrink > MOST_SHRINK * width:
            most = f"at most {MOST_SHRINK:g} of the least width of a block, {1e3 * MOST_SHRINK * width:.4g} mm"
            raise q.invalid(f"{1e3 * self.shrink:g} mm is too much; {most}", "shrink")
        for number, one in enumerate(self.cells_given):
            if any(geometry.faults(geometry.shrink_outline(one.outline, self.shrink))):
                raise q.invalid(f"block {number + 1} loses an edge; shrink less", "shrink")

    def divide(self) -> Sequence[Cell]:
        """Return all blocks in their order."""
        outlines: list[Sequence[geometry.Corner]] = [one.outline for one in self.cells_given]
        if self.shrink:
            outlines = [geometry.shrink_outline(one, self.shrink) for one in outlines]
        named = zip(outlines, self.cells_given, strict=True)
        return [Cell(outline, one.fixed, one.block, one.name) for outline, one in named]
