"""Drawings: outlines in a file, what it says about itself, and why it cannot be read.

Polygons are read from GeoJSON, and from DXF closed polylines, also within inserted blocks; nothing else that may be the
outline of a block is left out.
"""

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from blocksim.errors import BlocksimError
from blocksim.extras import load_module
from blocksim.scenario import geometry, input_files, units as q

STRAY = 1e-6
"""Of the size of a block: how far its ends may be apart, and a point from the line between its neighbours."""
FARTHEST = 1e12
COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
DEEPEST = 20  # collections in collections, blocks inserted in blocks
EARTH = (180.0, 90.0)  # largest longitude and latitude
SMALL_IN_DEGREES, FAR_IN_DEGREES = 0.02, 10.0
"""Extent (2 km as degrees, 20 mm as metres), and distance from the origin in extents, of longitudes and latitudes."""
MOST_BYTES = 20 * input_files.MEGABYTE
MOST_OUTLINES, MOST_CORNERS = 2000, 16_000
"""In a drawing; the scenario that is kept with the results has them all, and a scenario has a megabyte at most."""
DAMAGE = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""What readers raise for a file that is no drawing."""
DXF_DAMAGE = (AssertionError, RuntimeError, StopIteration)  # what else that of DXF raises, without words in the end


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

    def __init__(self, text: str) -> None:
        """Take the text; bytes of names that are no characters are written as numbers."""
        super().__init__(text.encode(errors="backslashreplace").decode())


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


def read_drawing(path: Path) -> Drawing:
    """Return the outlines in a drawing; points within straight edges are left out.

    Raises DrawingError, and UnavailableError for DXF without its package.
    """
    is_dxf = path.suffix.lower() == f".{DXF}"
    ezdxf = load_module("ezdxf", f"reading {path.name}", DXF) if is_dxf else None
    damage = DAMAGE if ezdxf is None else (ezdxf.DXFError, *DXF_DAMAGE, *DAMAGE)
    try:
        content = input_files.read_limited(path, MOST_BYTES)  # no file that is larger, no pipe
        found = read_geojson(content) if ezdxf is None else read_dxf(ezdxf.readfile(path))
    except DrawingError:
        raise
    except BlocksimError as error:
        raise DrawingError(str(error)) from None
    except damage as error:
        # the package repeats the path, which may be long
        words = str(error).replace(str(path), path.name)[:100] or "it is cut off"
        raise DrawingError(f"not a {'DXF' if is_dxf else 'GeoJSON'} file: {words}") from None
    outlines = found.outlines
    if len(outlines) == 0:
        raise DrawingError("no closed polyline in it" if is_dxf else "no polygon in it")
    if len(outlines) > MOST_OUTLINES or sum(len(one.outline) for one in outlines) > MOST_CORNERS:
        most = f"at most {MOST_OUTLINES} with {MOST_CORNERS} corners are allowed"
        raise DrawingError(f"{len(outlines)} outlines are too many; {most}")
    return found._replace(outlines=[one._replace(outline=simplify(one.outline)) for one in outlines])


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


DXF = "dxf"
DXF_APPLICATION = "BLOCKSIM"
"""Of the extended data of a polyline: the name of a block (text), and whether it is fixed (integer)."""
DXF_TEXT, DXF_INTEGER = 1000, 1070  # group codes
POLYLINES = {"LWPOLYLINE", "POLYLINE"}
FLAT = {"AcDb2dPolyline", "AcDb3dPolyline"}  # kinds of POLYLINE that are no meshes
CURVED = 2 + 4  # flags of a POLYLINE that a curve or a spline was fitted to
MOST_NAMED = 3
ANNOTATIONS = {
    *("TEXT", "MTEXT", "ATTDEF", "ATTRIB", "DIMENSION", "ARC_DIMENSION", "LEADER", "MULTILEADER", "TOLERANCE"),
    *("POINT", "RAY", "XLINE", "VIEWPORT", "IMAGE", "WIPEOUT", "PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY"),
}
"""What cannot be the outline of a block; it is counted."""
UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 4: ("millimetres", 1e-3), 5: ("centimetres", 1e-2), 6: ("metres", 1.0),
    7: ("kilometres", 1e3), 10: ("yards", 0.9144), 14: ("decimetres", 0.1),
}  # fmt: skip
"""Name and size (m) by the number $INSUNITS."""


class _Entity(NamedTuple):
    """An entity in its place, the layer that it is drawn in, and what it is called in messages."""

    entity: Any
    layer: str
    name: str
    is_hidden: bool


def read_dxf(document: Any) -> Drawing:
    """Return the closed polylines in model space. Raises DrawingError with all else that may be a block."""
    outlines, refused, counts = list[DrawingOutline](), list[str](), Counter[str]()
    for one in _entities(document.modelspace(), document.layers, None, DEEPEST):
        try:
            if one.entity.dxftype() in ANNOTATIONS:
                counts[one.entity.dxftype()] += 1
            else:
                outlines.append(_outline(one))
        except DrawingError as error:
            refused.append(str(error))
    if refused:
        more = len(refused) - MOST_NAMED
        raise DrawingError("; ".join(refused[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else ""))
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
    unit = document.header.get("$INSUNITS", 0)
    remarks = [f"{kinds} not read, as no outlines of blocks"] if kinds else []
    if unit and unit not in UNITS:
        remarks.append(f"$INSUNITS {unit} is not known")
    return Drawing(outlines, tuple(remarks), UNITS.get(unit))


def _entities(space: Any, layers: Any, insert: _Entity | None, depth: int) -> Iterator[_Entity]:
    """Yield the entities of model space or of an inserted block, where they are, without the INSERT themselves."""
    skipped: list[tuple[Any, str]] = []
    note = {} if insert is None else {"skipped_entity_callback": lambda *one: skipped.append(one)}
    entities = space.virtual_entities(**note) if note else space
    for entity in entities:
        one = _entity(entity, layers, insert)
        if entity.dxftype() != "INSERT":
            yield one
            continue
        block = entity.block()
        if block is None or block.block.is_xref or depth == 0:
            why = "is nested too deeply" if block is not None and depth == 0 else "has no block in this file"
            raise DrawingError(f"{one.name}: {why}")
        for copy in entity.multi_insert() if entity.mcount > 1 else [entity]:
            yield from _entities(copy, layers, one, depth - 1)
    for entity, reason in skipped:
        raise DrawingError(f"{_entity(entity, layers, insert).name}: {reason}")


def _entity(entity: Any, layers: Any, insert: _Entity | None) -> _Entity:
    """Return an entity with the layer that it is drawn in: in an inserted block layer 0 is that of the INSERT."""
    kind, layer, handle = entity.dxftype(), entity.dxf.layer, entity.dxf.handle
    if insert is not None and layer == "0":
        layer = insert.layer
    state = layers.get(layer) if layers.has_entry(layer) else None
    is_hidden = bool(entity.dxf.get("invisible", 0)) or (state is not None and (state.is_off() or state.is_frozen()))
    name = f"{'polyline' if kind in POLYLINES else kind}{f' {handle}' if handle else ''} in layer {layer}"
    if insert is None:
        return _Entity(entity, layer, name, is_hidden)
    return _Entity(entity, layer, f"{name} of {insert.name}", is_hidden or insert.is_hidden)


def _outline(one: _Entity) -> DrawingOutline:
    """Return the outline that an entity is. Raises DrawingError where it is none."""
    entity, kind = one.entity, one.entity.dxftype()
    if kind not in POLYLINES or (kind == "POLYLINE" and entity.get_mode() not in FLAT):
        raise DrawingError(f"{one.name}: blocks are read from closed polylines; redraw or remove it")
    if one.is_hidden:
        raise DrawingError(f"{one.name}: is hidden, off or frozen; show or remove it")
    if entity.has_arc or (kind == "POLYLINE" and entity.dxf.flags & CURVED):
        raise DrawingError(f"{one.name}: has arcs; blocks have straight edges")
    places = [*(entity.vertices_in_wcs() if kind == "LWPOLYLINE" else entity.points_in_wcs())]
    points, heights = [point_of((place.x, place.y), one.name) for place in places], [place.z for place in places]
    size = math.dist(*geometry.box_of(points)) if points else 0.0
    gap = math.dist(points[0], points[-1]) if points else 0.0
    if heights and max(heights) - min(heights) > STRAY * size:
        raise DrawingError(f"{one.name}: is not parallel to the plane of x and y")
    if not (entity.closed if kind == "LWPOLYLINE" else entity.is_closed) and gap > STRAY * size:
        raise DrawingError(f"{one.name}: is open, its ends {gap:.6g} units apart; close or remove it")
    return DrawingOutline(points, one.name, _properties(entity, one.layer))


def _properties(entity: Any, layer: str) -> Mapping[str, Any]:
    """Return block, name and whether it is fixed, by layer and by what `blocksim export` has written."""
    tags = entity.get_xdata(DXF_APPLICATION) if entity.has_xdata(DXF_APPLICATION) else ()
    values = {tag.code: tag.value for tag in tags}
    block = {} if layer == "0" else {"block": layer}
    names = {"name": str(values[DXF_TEXT])} if DXF_TEXT in values else {}
    fixed = {"fixed": bool(values[DXF_INTEGER])} if DXF_INTEGER in values else {}
    return block | names | fixed
