"""Structures that divide a whole into blocks: arches, columns, Voronoi cells, rubble."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import ConfigDict

from blocksim.scenario import geometry, units as q
from blocksim.scenario.models.base import Whole, require_one, setting
from blocksim.scenario.models.geometry import COUNTS, Point
from blocksim.scenario.structures.base import Cell, PolygonStructure, Seed, UnfitError, draws

MOST_TURN = 0.9 * math.pi
ABUTMENT = 2.0
"""Width of an abutment in thicknesses of the arch; it is half as deep behind its joint."""


class Arch(PolygonStructure):
    """Voussoirs between radial joints, from the left springing to the right one, then two fixed abutments.

    Inner and outer faces are straight, with their ends on the circles of intrados and extrados. Abutments are
    rectangles of twice the thickness whose faces are the springing joints.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["radius"]}, {"required": ["span"]}]})

    kind: Literal["arch"] = setting("kind of structure")
    radius: q.PositiveLength | None = setting("mean radius; give this or span", None)
    span: q.PositiveLength | None = setting(
        "clear distance of the springings of the intrados; give this or radius", None
    )
    thickness: q.PositiveLength = setting("thickness of the ring")
    embrace: q.Embrace = setting("angle between the springing joints", math.pi)
    count: Annotated[int, Whole(1, 1000)] = setting("number of voussoirs")
    abutments: bool = setting("whether fixed blocks hold the springings", default=True)

    def _check(self) -> None:
        missing = "the size is missing: give radius (of the middle of the ring) or span"
        require_one(missing, radius=self.radius, span=self.span)
        if self.mean_radius <= 0.5 * self.thickness:
            message = f"a ring of {1e3 * self.thickness:g} mm needs a mean radius of more than half of that"
            raise q.invalid(message, "thickness")

    @property
    def mean_radius(self) -> float:
        """Radius (m) of the middle of the ring."""
        if self.radius is not None:
            return self.radius
        return 0.5 * (self.span or math.nan) / math.sin(0.5 * self.embrace) + 0.5 * self.thickness

    def divide(self) -> Sequence[Cell]:
        """Return voussoirs about the centre of the circles; raises UnfitError for one that turns by half a circle."""
        if self.embrace / self.count > MOST_TURN:
            raise UnfitError("count", f"a voussoir of {math.degrees(self.embrace / self.count):.4g} deg is not convex")
        inner, outer = self.mean_radius - 0.5 * self.thickness, self.mean_radius + 0.5 * self.thickness
        joints = [0.5 * math.pi + self.embrace * (0.5 - number / self.count) for number in range(self.count + 1)]
        ways = [(math.cos(angle), math.sin(angle)) for angle in joints]
        ends = [((inner * c, inner * s), (outer * c, outer * s)) for c, s in ways]
        cells = [Cell([one[0], other[0], other[1], one[1]]) for one, other in pairwise(ends)]
        inner, outer = (self.mean_radius + 0.5 * sign * ABUTMENT * self.thickness for sign in (-1.0, 1.0))
        for (c, s), side in ((ways[0], 1.0), (ways[-1], -1.0)) if self.abutments else ():  # behind it, to this side
            dx, dy = -side * self.thickness * s, side * self.thickness * c
            x0, y0, x1, y1 = inner * c, inner * s, outer * c, outer * s
            cells.append(Cell([(x0, y0), (x1, y1), (x1 + dx, y1 + dy), (x0 + dx, y0 + dy)], fixed=True))
        return cells


class Column(PolygonStructure):
    """Drums of equal height one above the other, their sides on straight lines from the lower to the upper width."""

    kind: Literal["column"] = setting("kind of structure")
    count: Annotated[int, Whole(1, 1000)] = setting("number of drums")
    tall: q.PositiveLength = setting("height of the column", alias="height")
    width: q.PositiveLength = setting("width at its foot")
    top_width: q.PositiveLength | None = setting("width at its top (default: width)", None)

    def divide(self) -> Sequence[Cell]:
        """Return the drums from the ground up."""
        top = self.width if self.top_width is None else self.top_width
        levels = [number / self.count for number in range(self.count + 1)]
        halves = [0.5 * (self.width + (top - self.width) * level) for level in levels]
        heights = [self.tall * level for level in levels]
        return [
            Cell([(-half, low), (half, low), (upper, high), (-upper, high)])
            for (half, low), (upper, high) in pairwise(zip(halves, heights, strict=True))
        ]


MOST_ROUNDS = 20
TRIALS = 8  # random points in the box for each cell; a thin region has fewer cells
LEAST_EDGE, LEAST_WIDTH = 0.02, 0.1
"""Shortest edge of a cell and its least width by default, in sides of a square of the mean area."""


class Voronoi(PolygonStructure):
    """Cells of random points in a rectangle or a convex region.

    Cells below the smallest width are rejected: their neighbours take their place. Edges shorter than a fiftieth of a
    mean cell become corners, which leaves small openings between the cells and never an overlap.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["width", "height"]}, {"required": ["region"]}]}
    )

    kind: Literal["voronoi"] = setting("kind of structure")
    count: Annotated[int, Whole(1, 5000)] = setting("number of cells, before small ones are rejected")
    width: q.PositiveLength | None = setting("width of a wall; give this and height, or region", None)
    tall: q.PositiveLength | None = setting("height of a wall", None, alias="height")
    region: tuple[Point, ...] | None = setting(
        "corners [x, y] of a convex region, such as a slope", None, json_schema_extra=COUNTS
    )
    seed: Seed = setting("seed of the random points", 1)
    relax: Annotated[int, Whole(0, 20)] = setting(
        "how often points move to the centroids of their cells, which makes cells more alike", 2
    )
    smallest: q.PositiveLength | None = setting(
        "least width of a cell (default: a tenth of the side of a square of the mean area)", None
    )

    def _check(self) -> None:
        sides = (self.width, self.tall)
        if self.region is None and None in sides:
            raise q.invalid("the size is missing: give width and height of a wall, or region")
        if self.region is not None and sides != (None, None):
            raise q.invalid("region and the sides of a wall are both given; keep one of them", "region")
        for number, message in geometry.faults(self.region) if self.region is not None else ():
            raise q.invalid(message, "region", *(() if number is None else (number,)))

    def divide(self) -> Sequence[Cell]:
        """Return cells from the lowest to the highest centroid; raises UnfitError where none is large enough."""
        width, tall = self.width or 0.0, self.tall or 0.0
        whole = [(0.0, 0.0), (width, 0.0), (width, tall), (0.0, tall)]
        if self.region is not None:
            x, y = geometry.centroid(self.region)
            whole = [(x + u, y + v) for u, v in geometry.centre_outline(self.region)]
        (left, bottom), (right, top) = geometry.box_of(whole)
        random = draws(self.seed, TRIALS * self.count, 2).tolist()
        places = ((left + u * (right - left), bottom + v * (top - bottom)) for u, v in random)
        inside = [place for place in places if geometry.holds(whole, place, 0.0)]
        points = inside[: self.count] or [geometry.centroid(whole)]
        for _ in range(self.relax):  # Lloyd
            points = [geometry.centroid(cell) for cell in geometry.voronoi(points, whole)]
        side = math.sqrt(geometry.area_of(whole) / self.count)
        least = LEAST_WIDTH * side if self.smallest is None else self.smallest
        for _ in range(MOST_ROUNDS if points else 0):
            cells = [geometry.clean_cell(cell, LEAST_EDGE * side) for cell in geometry.voronoi(points, whole)]
            is_large = [not any(geometry.faults(one)) and geometry.least_width(tuple(one)) >= least for one in cells]
            if all(is_large):
                return [Cell(cell) for cell in sorted(cells, key=lambda cell: geometry.centroid(cell)[::-1])]
            points = [point for point, stays in zip(points, is_large, strict=True) if stays]
            if not points:
                break
        message = f"no division into cells of at least {1e3 * least:g} mm was found"
        key = "count" if self.smallest is None else "smallest"
        raise UnfitError(key, f"{message}; give a smaller width, or fewer cells")


MOST_BLOCKS = 20_000
MOST_SIDES = 10
JITTER = 0.35  # largest shift of a corner along its ellipse, in distances of corners
FLATTEST = 0.6  # shorter over longer axis of the flattest ellipse
PER_BLOCK = 4  # random numbers of a block beside those of its corners


class Rubble(PolygonStructure):
    """Blocks of random shape and size in rows, each in a square as wide as the largest block.

    Corners lie on an ellipse of random flatness and direction. Sizes, the longest axes of ellipses, follow a power law
    between the smallest and the largest: the number of blocks above d goes with d^-exponent.
    """

    kind: Literal["rubble"] = setting("kind of structure")
    count: Annotated[int, Whole(1, MOST_BLOCKS)] = setting("number of blocks")
    columns: Annotated[int, Whole(1, MOST_BLOCKS)] = setting("number of blocks in a row")
    smallest: q.PositiveLength = setting("size of the smallest block")
    largest: q.PositiveLength = setting("size of the largest block")
    exponent: q.NonNegativeNumber = setting("of the power law of sizes; 0: even in the logarithm", 2.0)
    fewest_sides: Annotated[int, Whole(geometry.FEWEST, MOST_SIDES)] = setting("least number of sides", 4)
    most_sides: Annotated[int, Whole(geometry.FEWEST, MOST_SIDES)] = setting("most number of sides", 8)
    gap: q.NonNegativeLength = setting("least distance of neighbours", 0.0)
    seed: Seed = setting("seed of shapes and sizes", 1)

    def _check(self) -> None:
        if self.smallest > self.largest:
            raise q.invalid(f"the smallest size is above the largest, {1e3 * self.largest:g} mm", "smallest")
        if self.fewest_sides > self.most_sides:
            raise q.invalid(f"the least number of sides is above the most, {self.most_sides}", "fewest_sides")

    def divide(self) -> Sequence[Cell]:
        """Return blocks row by row from below, each from left to right."""
        pitch, cells = self.largest + self.gap, []
        for number, random in enumerate(draws(self.seed, self.count, PER_BLOCK + MOST_SIDES).tolist()):
            share, flat, turn, sides, *shifts = random
            count = self.fewest_sides + int(sides * (self.most_sides - self.fewest_sides + 1))
            half, flatness = 0.5 * self._size(share), FLATTEST + (1.0 - FLATTEST) * flat
            c, s = math.cos(2.0 * math.pi * turn), math.sin(2.0 * math.pi * turn)
            corners = []
            for place, shift in enumerate(shifts[:count]):
                angle = 2.0 * math.pi * (place + JITTER * (2.0 * shift - 1.0)) / count
                u, v = half * math.cos(angle), half * flatness * math.sin(angle)
                corners.append((c * u - s * v, s * u + c * v))
            row, column = divmod(number, self.columns)
            x, y = geometry.middle_of(corners)
            dx, dy = pitch * column - x, pitch * row - y
            cells.append(Cell([(u + dx, v + dy) for u, v in corners]))
        return cells

    def _size(self, share: float) -> float:
        """Return the size (m) above which a share of the blocks is."""
        ratio = self.smallest / self.largest
        if self.exponent == 0.0 or ratio == 1.0:
            return float(self.largest * ratio**share)
        try:
            return float(self.largest * (1.0 + share * (ratio**-self.exponent - 1.0)) ** (-1.0 / self.exponent))
        except OverflowError:  # so steep that all blocks are small
            return self.smallest
