"""Blocks on top of each other, each shifted by the same offset."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Count, Pose, Structure


class Stack(Structure):
    """Block i (from 0) has its left edge at left + i offset and its lower edge at bottom + i size_y."""

    kind: Literal["stack"] = Field(description="kind of structure")
    count: Count = Field(description="number of blocks")
    offset: q.Length = Field(default=0.0, description="shift of each block relative to the one below")

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.count

    def height(self, block: Block) -> float:
        """All blocks on top of each other."""
        return self.count * block.size_y

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses from the ground up."""
        first = self.left + block.size_x / 2
        return [Pose(first + i * self.offset, self.bottom + (i + 0.5) * block.size_y) for i in range(self.count)]
