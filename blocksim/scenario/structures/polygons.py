"""Blocks by their corners where they are: written out, or taken from a drawing."""

from collections.abc import Mapping, Sequence
from typing import Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from blocksim.scenario import outlines
from blocksim.scenario import quantities as q
from blocksim.scenario.drawings import MOST_OUTLINES, DrawingError, read_drawing
from blocksim.scenario.models.base import Identifier, Table, table_path
from blocksim.scenario.models.geometry import Point
from blocksim.scenario.structures.shaped import Cell, Shaped

MOST_SHRINK = 0.01  # of the least width of a block


class DrawnBlock(Table):
    """One block of a drawing."""

    outline: tuple[Point, ...] = Field(
        description="corners [x, y] of a convex block, in either sense",
        json_schema_extra={"minItems": outlines.FEWEST, "maxItems": outlines.MOST},
    )
    block: str | None = Field(default=None, description="the name of its block (default: that of the structure)")
    fixed: bool = Field(default=False, description="true for a body that never moves")
    name: Identifier | None = Field(default=None, description="name in tables (default: its number, from 1)")

    @model_validator(mode="after")
    def _convex(self) -> Self:
        for number, message in outlines.faults(self.outline):
            raise q.invalid(message, "outline", *(() if number is None else (number,)))
        return self


class Polygons(Shaped):
    """Blocks in `cells`, or in a GeoJSON or DXF file, of which results keep the blocks and not the file.

    A polygon of GeoJSON may have the properties block, fixed and name; the layer of a DXF polyline other than 0 is the
    name of its block. The block has the material, and [pairs] of materials say how joints behave.
    """

    kind: Literal["polygons"] = Field(description="kind of structure")
    cells_given: tuple[DrawnBlock, ...] = Field(
        default=(), alias="cells", description="blocks, each with its outline; give these or table"
    )
    table: str | None = Field(default=None, description="GeoJSON or DXF file with an outline for each block")
    unit: q.PositiveLength = Field(default=1.0, description="unit of the coordinates in the file")
    in_place: bool = Field(default=False, description="true keeps all coordinates, whatever left and bottom are")
    shrink: q.NonNegativeLength = Field(
        default=0.0,
        description="how far every edge moves inwards, so that rounded coordinates, or blocks at rest, do not overlap",
    )

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: object, info: ValidationInfo) -> object:
        if not isinstance(data, Mapping) or "table" not in data:
            return data
        if "cells" in data:
            raise q.invalid("table and cells are both given; keep one of them", "table")
        unit = q.Quantity(q.LENGTH, above=0.0).read(data.get("unit", 1.0))
        path = table_path(data["table"], (info.context or {}).get("folder"), "wall.geojson")
        try:
            drawn = read_drawing(path)
        except DrawingError as error:
            raise q.invalid(f"{path.name}: {error}", "table") from None
        for one in drawn:
            if "material" in one.properties and "block" not in one.properties:
                raise q.invalid(f"{path.name}: {one.name}: material is not read; name a block, which has one", "table")
        cells = []
        for one in drawn:
            known = {
                key: one.properties[key] for key in ("block", "fixed", "name") if one.properties.get(key) is not None
            }
            cells.append({"outline": tuple((x * unit, y * unit) for x, y in one.outline), **known})
        return {**{key: value for key, value in data.items() if key not in ("table", "unit")}, "cells": tuple(cells)}

    @model_validator(mode="after")
    def _some_and_not_shrunk_away(self) -> Self:
        if not 0 < len(self.cells_given) <= MOST_OUTLINES:
            message = f"{len(self.cells_given)} blocks; 1 to {MOST_OUTLINES} are allowed, in cells or in the file table"
            raise q.invalid(message)
        if not self.shrink:
            return self
        width = min(outlines.least_width(tuple(one.outline)) for one in self.cells_given)
        if self.shrink > MOST_SHRINK * width:
            most = f"at most {MOST_SHRINK:g} of the least width of a block, {1e3 * MOST_SHRINK * width:.4g} mm"
            raise q.invalid(f"{1e3 * self.shrink:g} mm is too much; {most}", "shrink")
        for number, one in enumerate(self.cells_given):
            if any(outlines.faults(self._outline(one))):
                raise q.invalid(f"block {number + 1} loses an edge; shrink less", "shrink")
        return self

    @property
    def drawn(self) -> Sequence[Cell]:
        """All blocks in their order."""
        return [Cell(self._outline(one), one.fixed, one.block, one.name) for one in self.cells_given]

    def _outline(self, one: DrawnBlock) -> Sequence[Point]:
        return outlines.shrunk(one.outline, self.shrink) if self.shrink else one.outline

    @property
    def shift(self) -> tuple[float, float]:
        """How far all blocks move (m)."""
        return (0.0, 0.0) if self.in_place else super().shift
