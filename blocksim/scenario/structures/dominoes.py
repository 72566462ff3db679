"""Upright blocks in a row, of which the first may be pushed over."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Count, Pose, Structure


class Dominoes(Structure):
    """Block i (from 0) has its left edge at left + i (size_x + spacing).

    A push turns the first domino about its lower edge on the side that it falls to, without slip: its centre moves
    along x at the speed of the push and rises at push size_x / size_y, its spin is 2 push / size_y.
    """

    kind: Literal["dominoes"] = Field(description="kind of structure")
    count: Count = Field(description="number of blocks")
    spacing: q.PositiveLength = Field(description="clear distance between neighbours")
    push: q.Speed = Field(
        default=0.0,
        description="speed along x of the centre of the first domino, which turns about its lower edge",
    )

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.count

    def height(self, block: Block) -> float:
        """One block."""
        return block.size_y

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses from left to right."""
        pitch, y = block.size_x + self.spacing, self.bottom + 0.5 * block.size_y
        first = Pose(
            self.left + 0.5 * block.size_x,
            y,
            vx=self.push,
            vy=abs(self.push) * block.size_x / block.size_y,
            spin=-2.0 * self.push / block.size_y,
        )
        return [first, *(Pose(first.x + i * pitch, y) for i in range(1, self.count))]
