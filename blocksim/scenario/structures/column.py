"""Columns of drums, tapered upwards."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Whole
from blocksim.scenario.structures.shaped import Cell, Shaped

MOST_DRUMS = 1000


class Column(Shaped):
    """Drums of equal height one above the other, their sides on straight lines from the lower to the upper width."""

    kind: Literal["column"] = Field(description="kind of structure")
    count: Annotated[int, Whole(1, MOST_DRUMS)] = Field(description="number of drums")
    tall: q.PositiveLength = Field(alias="height", description="height of the column")
    width: q.PositiveLength = Field(description="width at its foot")
    top_width: q.PositiveLength | None = Field(default=None, description="width at its top (default: width)")

    @property
    def drawn(self) -> Sequence[Cell]:
        """Drums from the ground up."""
        top = self.width if self.top_width is None else self.top_width
        levels = [number / self.count for number in range(self.count + 1)]
        halves = [0.5 * (self.width + (top - self.width) * level) for level in levels]
        ends = [
            ((-half, self.tall * level), (half, self.tall * level)) for half, level in zip(halves, levels, strict=True)
        ]
        return [Cell([low[0], low[1], high[1], high[0]]) for low, high in pairwise(ends)]
