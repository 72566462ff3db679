"""Courses of which each has one block less than the one below."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Courses, Pose, poses_at


class Pyramid(Courses):
    """Course i (from 0) has rows - i blocks, each in the middle above two of the course below."""

    kind: Literal["pyramid"] = Field(description="kind of structure")
    gap: q.NonNegativeLength = Field(default=0.0, description="gap between neighbours in a course")

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.rows * (self.rows + 1) // 2

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses course by course, each from left to right."""
        row = np.repeat(np.arange(self.rows), np.arange(self.rows, 0, -1))
        column = np.concatenate([np.arange(count) for count in range(self.rows, 0, -1)])
        pitch = block.size_x + self.gap
        x = self.left + 0.5 * block.size_x + (column + 0.5 * row) * pitch
        y = self.bottom + (row.astype(np.float64) + 0.5) * block.size_y
        return poses_at(x, y)
