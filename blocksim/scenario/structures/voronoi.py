"""Walls and slopes of Voronoi cells: jointed rock and rubble masonry without gaps."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from blocksim.scenario import outlines
from blocksim.scenario import quantities as q
from blocksim.scenario.cells import cleaned, relaxed, voronoi
from blocksim.scenario.models.base import Whole
from blocksim.scenario.models.geometry import Point
from blocksim.scenario.outlines import Corner
from blocksim.scenario.structures.base import Seed, UnfitError, draws
from blocksim.scenario.structures.shaped import Cell, Shaped

MOST_CELLS = 5000
MOST_ROUNDS = 20
TRIALS = 8
"""Random points in the box for each cell; a thin region has fewer cells."""
LEAST_EDGE, LEAST_WIDTH = 0.02, 0.1
"""Shortest edge of a cell and its least width by default, in sides of a square of the mean area."""


class Voronoi(Shaped):
    """Cells of random points in a rectangle or a convex region.

    Cells below the smallest width are rejected: their neighbours take their place. Edges shorter than a fiftieth of a
    mean cell become corners, which leaves small openings between the cells and never an overlap.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["width", "height"]}, {"required": ["region"]}]}
    )

    kind: Literal["voronoi"] = Field(description="kind of structure")
    count: Annotated[int, Whole(1, MOST_CELLS)] = Field(description="number of cells, before small ones are rejected")
    width: q.PositiveLength | None = Field(default=None, description="width of a wall; give this and height, or region")
    tall: q.PositiveLength | None = Field(default=None, alias="height", description="height of a wall")
    region: tuple[Point, ...] | None = Field(
        default=None,
        description="corners [x, y] of a convex region, such as a slope",
        json_schema_extra={"minItems": outlines.FEWEST, "maxItems": outlines.MOST},
    )
    seed: Seed = Field(default=1, description="seed of the random points")
    relax: Annotated[int, Whole(0, 20)] = Field(
        default=2, description="how often points move to the centroids of their cells, which makes cells more alike"
    )
    smallest: q.PositiveLength | None = Field(
        default=None, description="least width of a cell (default: a tenth of the side of a square of the mean area)"
    )

    @model_validator(mode="after")
    def _one_region(self) -> Self:
        sides = (self.width, self.tall)
        if self.region is None and None in sides:
            raise q.invalid("the size is missing: give width and height of a wall, or region")
        if self.region is not None and sides != (None, None):
            raise q.invalid("region and the sides of a wall are both given; keep one of them", "region")
        for number, message in outlines.faults(self.region) if self.region is not None else ():
            raise q.invalid(message, "region", *(() if number is None else (number,)))
        return self

    @property
    def whole(self) -> Sequence[Corner]:
        """Corners (m) of what is divided, counter-clockwise."""
        if self.region is not None:
            x, y = outlines.centroid(self.region)
            return [(x + u, y + v) for u, v in outlines.centred(self.region)]
        width, tall = self.width or 0.0, self.tall or 0.0
        return [(0.0, 0.0), (width, 0.0), (width, tall), (0.0, tall)]

    @property
    def drawn(self) -> Sequence[Cell]:
        """Cells from the lowest to the highest centroid; raises UnfitError where none is large enough."""
        side = math.sqrt(outlines.area_of(self.whole) / self.count)
        least = LEAST_WIDTH * side if self.smallest is None else self.smallest
        points = relaxed(self._points(), self.whole, self.relax)
        for _ in range(MOST_ROUNDS):
            found = [cleaned(cell, LEAST_EDGE * side) for cell in voronoi(points, self.whole)]
            is_large = [_width(cell) >= least for cell in found]
            if all(is_large):
                return [Cell(cell) for cell in sorted(found, key=lambda cell: outlines.centroid(cell)[::-1])]
            points = [point for point, stays in zip(points, is_large, strict=True) if stays]
            if not points:
                break
        message = (
            f"no division into cells of at least {1e3 * least:g} mm was found; give a smaller width, or fewer cells"
        )
        raise UnfitError("count" if self.smallest is None else "smallest", message)

    def _points(self) -> list[Corner]:
        """Return random points in the region, the same for a seed."""
        (left, bottom), (right, top) = outlines.box_of(self.whole)
        random = draws(self.seed, TRIALS * self.count, 2).tolist()
        places = ((left + u * (right - left), bottom + v * (top - bottom)) for u, v in random)
        found = [place for place in places if outlines.holds(self.whole, place, 0.0)]
        return found[: self.count] or [outlines.centroid(self.whole)]


def _width(cell: Sequence[Corner]) -> float:
    """Return the least width (m), zero for an outline that no block may have."""
    if len(cell) < outlines.FEWEST or next(outlines.faults(cell), None) is not None:
        return 0.0
    return outlines.least_width(tuple(cell))
