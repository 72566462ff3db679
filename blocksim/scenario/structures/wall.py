"""A wall of whole blocks in courses, in running or stack bond, with or without holes."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.structures.base import Count, Courses, Pose, Seed, draws, poses_at

Bond = Literal["running", "stack"]
BONDS: tuple[Bond, ...] = ("running", "stack")
PLACE = 2  # numbers of the position of a hole


def _hole(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != PLACE:
        raise q.invalid(f"{q.shown(value)} is not a hole; write [row, column], counted from 1 at the lower left")
    return value


Hole = Annotated[tuple[Count, Count], BeforeValidator(_hole)]


class BlockWall(Courses):
    """Block j of course i (both from 0) begins at x = left + j (size_x + gap) and y = bottom + i size_y.

    In running bond every second course is shifted to the right by half of that distance; all courses have whole blocks
    and the same number of them, so that the ends are toothed. A missing block does not support the ones above,
    which fall into the hole as far as their neighbours allow.
    """

    kind: Literal["wall"] = Field(description="kind of structure")
    columns: Count = Field(description="number of blocks in a course")
    bond: Annotated[Bond, OneOf(BONDS)] = Field(
        default="running", description="running: every second course is shifted by half a block; stack: none is"
    )
    gap: q.NonNegativeLength = Field(default=0.0, description="gap between neighbours in a course")
    holes: tuple[Hole, ...] = Field(
        default=(), description="blocks to leave out, [row, column] from 1, the lowest and leftmost first"
    )
    missing: q.Share = Field(default=0.0, description="share of the other blocks to leave out at random")
    offset: q.NonNegativeLength = Field(
        default=0.0, description="largest random shift of a block along x, to either side; at most half of the gap"
    )
    seed: Seed = Field(default=0, description="random seed of shifts and blocks left out")

    @model_validator(mode="after")
    def _holes_are_inside_and_neighbours_apart(self) -> Self:
        seen = set()
        for number, (row, column) in enumerate(self.holes):
            if row > self.rows or column > self.columns:
                message = f"[{row}, {column}] is outside a wall of {self.rows} rows and {self.columns} columns"
                raise q.invalid(message, "holes", number)
            if (row, column) in seen:
                raise q.invalid(f"[{row}, {column}] is left out twice", "holes", number)
            seen.add((row, column))
        if self.size == 0:
            message = "this wall has no block left"
            raise q.invalid(message, "holes" if len(self.holes) == self.rows * self.columns else "missing")
        if self.offset > 0.5 * self.gap:
            message = (
                f"two neighbours shifted by {self.offset * 1e3:g} mm could overlap; "
                f"at most half of the gap, {0.5e3 * self.gap:g} mm, is allowed"
            )
            raise q.invalid(message, "offset")
        return self

    @property
    def size(self) -> int:
        """Number of blocks that are not left out."""
        others = self.rows * self.columns - len(self.holes)
        return others - self._random_holes(others)

    def _random_holes(self, others: int) -> int:
        return round(self.missing * others)

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the poses course by course, each from left to right."""
        random = draws(self.seed, 2, self.rows, self.columns)
        pitch = block.size_x + self.gap
        row, column = np.indices((self.rows, self.columns))
        shift = np.where(row % 2 == 1, 0.5 * pitch, 0.0) if self.bond == "running" else np.zeros(row.shape)
        x = self.left + 0.5 * block.size_x + column * pitch + shift + self.offset * (2.0 * random[0] - 1.0)
        y = self.bottom + (row.astype(np.float64) + 0.5) * block.size_y
        kept = np.ones(row.shape, dtype=np.bool_)
        for hole_row, hole_column in self.holes:
            kept[hole_row - 1, hole_column - 1] = False
        others = np.flatnonzero(kept)
        lowest = np.argsort(random[1].ravel()[others], kind="stable")[: self._random_holes(others.size)]
        kept.ravel()[others[lowest]] = False
        return poses_at(x[kept], y[kept])
