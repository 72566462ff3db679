"""Blocks by their corners where they are: written out, or from polygons in GeoJSON or closed polylines in DXF."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, Self

from pydantic import ModelWrapValidatorHandler, PrivateAttr, ValidationError, ValidationInfo, model_validator

from blocksim.scenario import geometry, units as q
from blocksim.scenario.models.base import Identifier, Table, setting, table_path
from blocksim.scenario.models.geometry import COUNTS, Point
from blocksim.scenario.structures.base import Cell, PolygonStructure
from blocksim.scenario.structures.drawings import (
    MOST_OUTLINES,
    Drawing,
    DrawingError,
    DrawingOutline,
    place_text,
    read_drawing,
)

AS_READ = "; results keep the blocks as they were read"
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


def _blocks_in(path: Path, given: float | None) -> tuple[Drawing, tuple[DrawnBlock, ...]]:
    """Return a drawing and its blocks, in a unit (m) or in that of the drawing. Raises DrawingError."""
    drawing = read_drawing(path)
    if given is None and drawing.degrees:
        raise DrawingError(drawing.degrees)
    name, own = drawing.unit or ("", 1.0)
    unit, remarks = given or own, [*drawing.remarks]
    if name and unit != own:
        remarks.append(f"$INSUNITS says {name}, but unit = {unit:g} m is taken")
    elif name and given is None and unit != 1.0:
        remarks.append(f"coordinates are taken as {name}, as $INSUNITS says")
    blocks = tuple(_drawn_block(one, unit) for one in drawing.outlines)
    return drawing._replace(remarks=tuple(f"{path.name}: {text}{AS_READ}" for text in remarks)), blocks


def _drawn_block(one: DrawingOutline, unit: float) -> DrawnBlock:
    """Return the block of an outline in a unit (m). Raises DrawingError with its place."""
    if "material" in one.properties and "block" not in one.properties:
        raise DrawingError(f"{one.name}: material is not read; name a block, which has one")
    known = {key: one.properties.get(key) for key in ("block", "fixed", "name")}
    known = {key: value for key, value in known.items() if value is not None}
    data = {"outline": tuple((x * unit, y * unit) for x, y in one.outline), **known}
    try:
        return DrawnBlock.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        own = first.get("ctx", {})  # of errors of this package, which give a key and a message
        key, *corner = [*map(str, first["loc"]), *map(str, own.get("key", ()))]
        if key == "outline":
            key = f"corner {place_text(*one.outline[int(corner[0])])}" if corner else ""
        message = own.get("message", f"{q.toml(first['input'])}{first['msg'].replace('Input should be', ' is not')}")
        raise DrawingError(f"{', '.join(filter(None, (one.name, key)))}: {message}") from None


class Polygons(PolygonStructure):
    """Blocks in `cells`, or in a GeoJSON or DXF file, of which results keep the blocks and not the file.

    A polygon of GeoJSON may have the properties block, fixed and name; several of a feature are NAME-1, NAME-2. The
    layer of a DXF polyline other than 0 is the name of its block; inserted blocks are read at all levels. What may be
    the outline of a block and cannot be read is refused by entity, layer and handle; annotations are counted. The block
    has the material, and [pairs] of materials say how joints behave.
    """

    kind: Literal["polygons"] = setting("kind of structure")
    cells_given: tuple[DrawnBlock, ...] = setting(
        "blocks, each with its outline; give these or table", (), alias="cells"
    )
    table: str | None = setting("GeoJSON or DXF file with an outline for each block", None)
    unit: q.PositiveLength = setting("unit of coordinates in the file (default: $INSUNITS of DXF, else metres)", 1.0)
    in_place: bool = setting("true keeps all coordinates, whatever left and bottom are", default=False)
    shrink: q.NonNegativeLength = setting(
        "how far every edge moves inwards, so that rounded coordinates, or blocks at rest, do not overlap", 0.0
    )

    _drawing: Drawing = PrivateAttr(Drawing([]))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was not read of its drawing, or decided by it."""
        return self._drawing.remarks

    def place_of(self, number: int) -> str:
        """Return where a block is in its drawing, for messages; empty for one of `cells`."""
        return f"{self._drawing.outlines[number].name}: " if self._drawing.outlines else ""

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, data: object, handler: ModelWrapValidatorHandler["Polygons"], info: ValidationInfo) -> "Polygons":
        if not isinstance(data, Mapping) or "table" not in data:
            return handler(data)
        if "cells" in data:
            raise q.invalid("table and cells are both given; keep one of them", "table")
        unit = q.Quantity(q.LENGTH, above=0.0).read(data["unit"]) if "unit" in data else None
        path = table_path(data["table"], (info.context or {}).get("folder"), "wall.geojson", "table")
        try:
            drawing, cells = _blocks_in(path, unit)
        except DrawingError as error:
            raise q.invalid(f"{path.name}: {error}", "table") from None
        rest = {key: value for key, value in data.items() if key not in ("table", "unit")}
        return handler({**rest, "cells": cells}).drawn_in(drawing)

    def drawn_in(self, drawing: Drawing) -> Self:
        """Keep where its blocks come from, until it is written."""
        self._drawing = drawing
        return self

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
