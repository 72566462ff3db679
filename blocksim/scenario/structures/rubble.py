"""Heaps of random convex blocks, apart from one another at the start: they fall and settle."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from blocksim.scenario import outlines
from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Whole
from blocksim.scenario.structures.base import Floats, Seed, draws
from blocksim.scenario.structures.shaped import Cell, Shaped

MOST_BLOCKS = 20_000
MOST_SIDES = 10
JITTER = 0.35
"""Largest shift of a corner along its ellipse, in distances of corners."""
FLATTEST = 0.6
"""Shorter over longer axis of the flattest ellipse."""
PER_BLOCK = 4
"""Random numbers of a block beside those of its corners."""


class Rubble(Shaped):
    """Blocks of random shape and size in rows, each in a square as wide as the largest block.

    Corners lie on an ellipse of random flatness and direction. Sizes, the longest axes of ellipses, follow a power law
    between the smallest and the largest: the number of blocks above d goes with d^-exponent.
    """

    kind: Literal["rubble"] = Field(description="kind of structure")
    count: Annotated[int, Whole(1, MOST_BLOCKS)] = Field(description="number of blocks")
    columns: Annotated[int, Whole(1, MOST_BLOCKS)] = Field(description="number of blocks in a row")
    smallest: q.PositiveLength = Field(description="size of the smallest block")
    largest: q.PositiveLength = Field(description="size of the largest block")
    exponent: q.NonNegativeNumber = Field(
        default=2.0, description="of the power law of sizes; 0: even in the logarithm"
    )
    fewest_sides: Annotated[int, Whole(outlines.FEWEST, MOST_SIDES)] = Field(
        default=4, description="least number of sides"
    )
    most_sides: Annotated[int, Whole(outlines.FEWEST, MOST_SIDES)] = Field(
        default=8, description="most number of sides"
    )
    gap: q.NonNegativeLength = Field(default=0.0, description="least distance of neighbours")
    seed: Seed = Field(default=1, description="seed of shapes and sizes")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.smallest > self.largest:
            raise q.invalid(f"the smallest size is above the largest, {1e3 * self.largest:g} mm", "smallest")
        if self.fewest_sides > self.most_sides:
            raise q.invalid(f"the least number of sides is above the most, {self.most_sides}", "fewest_sides")
        return self

    @property
    def drawn(self) -> Sequence[Cell]:
        """Blocks row by row from below, each from left to right."""
        pitch = self.largest + self.gap
        random = draws(self.seed, self.count, PER_BLOCK + MOST_SIDES)
        cells = []
        for number, numbers in enumerate(random):
            row, column = divmod(number, self.columns)
            corners = self._corners(numbers)
            x, y = outlines.middle_of(corners)
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

    def _corners(self, random: Floats) -> list[outlines.Corner]:
        share, flat, turn, sides, *shifts = random.tolist()
        count = self.fewest_sides + int(sides * (self.most_sides - self.fewest_sides + 1))
        half = 0.5 * self._size(share)
        flatness = FLATTEST + (1.0 - FLATTEST) * flat
        angle = 2.0 * math.pi * turn
        c, s = math.cos(angle), math.sin(angle)
        corners = []
        for number, shift in enumerate(shifts[:count]):
            place = 2.0 * math.pi * (number + JITTER * (2.0 * shift - 1.0)) / count
            u, v = half * math.cos(place), half * flatness * math.sin(place)
            corners.append((c * u - s * v, s * u + c * v))
        return corners
