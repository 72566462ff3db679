"""Separate blocks in rows and columns, shifted and turned at random."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Count, Courses, Pose, Seed, UnfitError, draws, poses_at


class Grid(Courses):
    """Place j of row i (both from 0) begins at x = left + j (size_x + gap_x) and y = bottom + i (size_y + gap_y).

    Each block is shifted along x and along y and turned by random amounts of up to `offset` and `turn`, to either side.
    """

    kind: Literal["grid"] = Field(description="kind of structure")
    columns: Count = Field(description="number of blocks in a row")
    gap_x: q.NonNegativeLength = Field(description="gap between neighbours along x, before they are shifted and turned")
    gap_y: q.NonNegativeLength = Field(description="gap between neighbours along y, before they are shifted and turned")
    offset: q.NonNegativeLength = Field(
        default=0.0, description="largest random shift of a block along x and along y, to either side"
    )
    turn: q.HalfTurn = Field(default=0.0, description="largest random angle of a block, to either side")
    seed: Seed = Field(default=0, description="random seed of shifts and angles")

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.rows * self.columns

    def height(self, block: Block) -> float:
        """All rows, before blocks are shifted and turned."""
        return self.rows * block.size_y + (self.rows - 1) * self.gap_y

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses row by row, each from left to right."""
        needs = {  # gaps in which two neighbours, shifted and turned towards each other, cannot overlap
            "gap_x": (self.columns, self.gap_x, _growth(block.size_x, block.size_y, self.turn)),
            "gap_y": (self.rows, self.gap_y, _growth(block.size_y, block.size_x, self.turn)),
        }
        for key, (count, gap, growth) in needs.items():
            least = 2.0 * self.offset + growth
            if count > 1 and gap < least:
                message = (
                    f"{gap * 1e3:g} mm is too small for such random shifts and angles; at least {least * 1e3:g} mm"
                )
                raise UnfitError(key, f"{message} is needed")
        shift_x, shift_y, turn = 2.0 * draws(self.seed, 3, self.rows, self.columns) - 1.0
        row, column = np.indices((self.rows, self.columns))
        x = self.left + 0.5 * block.size_x + column * (block.size_x + self.gap_x) + self.offset * shift_x
        y = self.bottom + 0.5 * block.size_y + row * (block.size_y + self.gap_y) + self.offset * shift_y
        return poses_at(x, y, self.turn * turn)


def _growth(side: float, other: float, turn: float) -> float:
    """Return the largest growth (m) of a rectangle along a side when it is turned by up to `turn` (rad)."""
    widest = min(turn, math.atan2(other, side))
    return side * math.cos(widest) + other * math.sin(widest) - side
