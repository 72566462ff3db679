"""Common base of all kinds of structure, and of those that shape their blocks."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, units as q
from blocksim.scenario.models.base import Table, Whole, setting
from blocksim.scenario.models.geometry import Block

MAX_BLOCKS = 1_000_000  # in a structure, and in a scenario
MAX_SEED = 2**32 - 1

Floats = NDArray[np.float64]
Count = Annotated[int, Whole(1, 100_000)]  # of courses, or of blocks in a row
Seed = Annotated[int, Whole(0, MAX_SEED)]


class Pose(NamedTuple):
    """Centre (m), angle (rad, counter-clockwise), velocity (m/s) and spin (rad/s) of one placed block.

    A block that is cut has a width (m) of its own.
    """

    x: float
    y: float
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    width: float | None = None


class UnfitError(ValueError):
    """A structure cannot be built from its block; `key` is the key to change."""

    def __init__(self, key: str, message: str) -> None:
        """Keep the key and the reason."""
        self.key = key
        super().__init__(message)


class Structure(Table, ABC):
    """A generator of bodies; every kind adds its `kind` literal and its own keys."""

    block: str = setting("the name of its block")
    left: q.Length = setting("left edge of its first block, the lowest and leftmost", 0.0)
    bottom: q.Length = setting("height of that block's lower edge", 0.0)
    velocity: tuple[q.Speed, q.Speed] = setting("velocity of all blocks along x and y", (0.0, 0.0))
    shear_velocity: q.Speed = setting(
        "additional velocity along x at full height, in proportion to the height of the centre", 0.0
    )

    counted_by: ClassVar[tuple[str, ...]] = ("count",)
    stacked_by: ClassVar[str | None] = "count"  # key whose blocks stand one above the other; None: a single course

    @property
    def size(self) -> int:
        """Number of bodies, without placing them: the product of the keys `counted_by`."""
        return math.prod(getattr(self, key) for key in self.counted_by)

    def height(self, block: Block) -> float:
        """Height (m) from the bottom to the upper edge of the highest course, whether or not it has a block left."""
        return block.size_y if self.stacked_by is None else getattr(self, self.stacked_by) * block.size_y

    @abstractmethod
    def place(self, block: Block) -> Sequence[Pose]:
        """Return the pose of every block, lowest first, before the initial velocities are added; raises UnfitError."""

    @np.errstate(over="ignore", invalid="ignore")  # positions that are not finite are found later
    def start(self, block: Block) -> Sequence[Pose]:
        """Return the poses with the initial velocities: v_x = velocity_x + shear_velocity (y - bottom) / height.

        Raises UnfitError where keys do not suit the block.
        """
        poses = self.place(block)
        vx, vy = self.velocity
        if (vx, vy, self.shear_velocity) == (0.0, 0.0, 0.0):
            return poses
        height, shear = self.height(block), self.shear_velocity
        return [
            pose._replace(vx=pose.vx + vx + shear * ((pose.y - self.bottom) / height), vy=pose.vy + vy)
            for pose in poses
        ]


class Courses(Structure):
    """A structure of several courses, one above the other."""

    stacked_by = "rows"
    rows: Count = setting("number of courses, one above the other")

    def _check(self) -> None:
        if self.size > MAX_BLOCKS:
            raise q.invalid(f"{self.size} blocks are too many; a structure has at most {MAX_BLOCKS}", "rows")


def poses_at(x: Floats, y: Floats, angle: Floats | None = None) -> list[Pose]:
    """Return resting poses at centres (m), turned by angles (rad) where some are given."""
    values = (x, y) if angle is None else (x, y, angle)
    return [Pose(*pose) for pose in zip(*(one.ravel().tolist() for one in values), strict=True)]


def draws(seed: int, *shape: int) -> Floats:
    """Return uniform random numbers in [0, 1), the same for a seed on every machine and with every version of numpy.

    numpy guarantees only the bit stream of PCG64 and its conversion to doubles, not distributions.
    """
    return np.random.Generator(np.random.PCG64(seed)).random(shape)


class Cell(NamedTuple):
    """One block where it is: its corners (m), counter-clockwise."""

    corners: Sequence[geometry.Corner]
    fixed: bool = False
    block: str | None = None  # None: that of the structure
    name: str | None = None  # None: its number


class PolygonStructure(Structure):
    """A structure that shapes its blocks; its `block` has a depth and a material only.

    `left` and `bottom` are those of the box around all blocks.
    """

    @abstractmethod
    def divide(self) -> Sequence[Cell]:
        """Return all blocks, wherever they are; raises UnfitError where keys do not make blocks."""

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All blocks where they start; raises UnfitError."""
        cells = self.divide()
        (x, y), _ = geometry.box_of([corner for cell in cells for corner in cell.corners])
        is_in_place = getattr(self, "in_place", False)  # as of drawings that keep their coordinates
        dx, dy = (0.0, 0.0) if is_in_place else (self.left - x, self.bottom - y)
        cells = tuple(cell._replace(corners=[(x + dx, y + dy) for x, y in cell.corners]) for cell in cells)
        for number, cell in enumerate(cells, start=1):
            for _, message in geometry.faults(cell.corners):
                raise UnfitError("kind", f"block {number} of this structure: {message}")
        return cells

    @property
    def size(self) -> int:
        """Number of blocks; zero where keys do not make blocks."""
        try:
            return len(self.cells)
        except UnfitError:
            return 0

    def height(self, block: Block) -> float:  # noqa: ARG002 - blocks have the shape that this gives them
        """Upper edge of the highest block."""
        _, high = geometry.box_of([corner for cell in self.cells for corner in cell.corners])
        return high[1] - self.bottom

    def place(self, block: Block) -> Sequence[Pose]:
        """Return the centroids of all blocks, none of them turned."""
        if block.size_x > 0.0:
            raise UnfitError("block", "this structure shapes its blocks; give the block a depth and a material only")
        return [Pose(*geometry.centroid(cell.corners)) for cell in self.cells]

    def start(self, block: Block) -> Sequence[Pose]:
        """Return the poses with the initial velocities; fixed blocks rest. Raises UnfitError."""
        poses = super().start(block)
        return [Pose(*pose[:3]) if cell.fixed else pose for pose, cell in zip(poses, self.cells, strict=True)]
