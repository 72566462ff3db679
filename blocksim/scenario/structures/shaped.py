"""Structures that divide a whole into blocks: each block has an outline of its own."""

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from blocksim.scenario import outlines
from blocksim.scenario.models.geometry import Block
from blocksim.scenario.outlines import Corner, Corners
from blocksim.scenario.structures.base import Pose, Structure, UnfitError


class Cell(NamedTuple):
    """One block where it is: its corners (m), counter-clockwise."""

    corners: Sequence[Corner]
    fixed: bool = False
    block: str | None = None  # None: that of the structure
    name: str | None = None  # None: its number


class Shaped(Structure):
    """A structure that shapes its blocks; its `block` has a depth and a material only.

    `left` and `bottom` are those of the box around all blocks.
    """

    @property
    @abstractmethod
    def drawn(self) -> Sequence[Cell]:
        """All blocks, wherever they are; raises UnfitError where keys do not make blocks."""

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All blocks where they start; raises UnfitError."""
        dx, dy = self.shift
        cells = tuple(cell._replace(corners=[(x + dx, y + dy) for x, y in cell.corners]) for cell in self._as_drawn)
        for number, cell in enumerate(cells, start=1):
            for _, message in outlines.faults(cell.corners):
                raise UnfitError("kind", f"block {number} of this structure: {message}")
        return cells

    @cached_property
    def _as_drawn(self) -> Sequence[Cell]:
        return self.drawn

    @property
    def shift(self) -> Corner:
        """How far all blocks move (m) from where they are drawn."""
        low, _ = outlines.box_of([corner for cell in self._as_drawn for corner in cell.corners])
        return self.left - low[0], self.bottom - low[1]

    @property
    def size(self) -> int:
        """Number of blocks; zero where keys do not make blocks."""
        try:
            return len(self.cells)
        except UnfitError:
            return 0

    @property
    def shapes(self) -> Sequence[Corners]:
        """Corners (m) of every block about its centroid."""
        return [outlines.centred(cell.corners) for cell in self.cells]

    def height(self, block: Block) -> float:  # noqa: ARG002 - blocks have the shape that this gives them
        """Upper edge of the highest block."""
        _, high = outlines.box_of([corner for cell in self.cells for corner in cell.corners])
        return high[1] - self.bottom

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the centroids of all blocks, none of them turned."""
        if block.is_shaped:
            raise UnfitError("block", "this structure shapes its blocks; give the block a depth and a material only")
        return [Pose(*outlines.centroid(cell.corners)) for cell in self.cells]

    def start(self, block: Block) -> Sequence[Pose]:
        """Return the poses with the initial velocities; fixed blocks rest. Raises UnfitError."""
        poses = super().start(block)
        return [Pose(*pose[:3]) if cell.fixed else pose for pose, cell in zip(poses, self.cells, strict=True)]
