"""Closed polylines of DXF, also within inserted blocks; nothing else that may be the outline of a block is left out."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from blocksim.scenario import geometry
from blocksim.scenario.structures.drawings import STRAY, Drawing, DrawingError, DrawingOutline, point_of

DXF = "dxf"
DXF_APPLICATION = "BLOCKSIM"
"""Of the extended data of a polyline: the name of a block (text), and whether it is fixed (integer)."""
DXF_TEXT, DXF_INTEGER = 1000, 1070  # group codes
POLYLINES = {"LWPOLYLINE", "POLYLINE"}
FLAT = {"AcDb2dPolyline", "AcDb3dPolyline"}  # kinds of POLYLINE that are no meshes
CURVED = 2 + 4  # flags of a POLYLINE that a curve or a spline was fitted to
DEEPEST = 20  # blocks inserted in blocks
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
