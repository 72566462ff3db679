"""Blocks stacked with a constant overlap, each shifted to the right of the one below: the paper's set-up."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Count, Pose, Structure, UnfitError


class Staircase(Structure):
    """Block i (from 0) has its left edge at left + i (size_x - overlap) and its lower edge at bottom + i size_y."""

    kind: Literal["staircase"] = Field(description="kind of structure")
    count: Count = Field(description="number of blocks")
    overlap: q.PositiveLength = Field(description="length over which a block lies on the one below")

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.count

    def height(self, block: Block) -> float:
        """All blocks on top of each other."""
        return self.count * block.size_y

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses from the ground up."""
        if self.overlap > block.size_x:
            raise UnfitError(
                "overlap",
                f"{self.overlap * 1e3:g} mm is more than the block's {block.size_x * 1e3:g} mm along x",
            )
        step = block.size_x - self.overlap
        first = self.left + block.size_x / 2
        return [Pose(first + i * step, self.bottom + (i + 0.5) * block.size_y) for i in range(self.count)]
