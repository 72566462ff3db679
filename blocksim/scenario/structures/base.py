"""Common base of all kinds of structure."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Table, Whole
from blocksim.scenario.models.geometry import Block

MAX_COUNT = 100_000
"""Of courses, or of blocks in a row."""
MAX_BLOCKS = 1_000_000
"""In a structure, and in a scenario."""
MAX_SEED = 2**32 - 1

Floats = NDArray[np.float64]
Count = Annotated[int, Whole(1, MAX_COUNT)]
Seed = Annotated[int, Whole(0, MAX_SEED)]


class Pose(NamedTuple):
    """Centre (m), angle (rad, counter-clockwise), velocity (m/s) and spin (rad/s) of one placed block."""

    x: float
    y: float
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0


class UnfitError(ValueError):
    """A structure cannot be built from its block; `key` is the key to change."""

    def __init__(self, key: str, message: str) -> None:
        """Keep the key and the reason."""
        self.key = key
        super().__init__(message)


class Structure(Table, ABC):
    """A generator of bodies; every kind adds its `kind` literal and its own keys."""

    block: str = Field(description="the name of its block")
    left: q.Length = Field(default=0.0, description="left edge of its first block, the lowest and leftmost")
    bottom: q.Length = Field(default=0.0, description="height of that block's lower edge")
    velocity: tuple[q.Speed, q.Speed] = Field(default=(0.0, 0.0), description="velocity of all blocks along x and y")
    shear_velocity: q.Speed = Field(
        default=0.0, description="additional velocity along x at full height, in proportion to the height of the centre"
    )

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of bodies, without placing them."""

    @abstractmethod
    def height(self, block: Block) -> float:
        """Height (m) from the bottom to the upper edge of the highest block."""

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

    rows: Count = Field(description="number of courses, one above the other")

    def height(self, block: Block) -> float:
        """All courses, whether or not the highest has a block left."""
        return self.rows * block.size_y

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        if self.size > MAX_BLOCKS:
            message = f"{self.size} blocks are too many; a structure has at most {MAX_BLOCKS}"
            raise q.invalid(message, "rows")
        return self


def poses_at(x: Floats, y: Floats, angle: Floats | None = None) -> list[Pose]:
    """Return resting poses at centres (m), turned by angles (rad) where some are given."""
    if angle is None:
        return [Pose(*centre) for centre in zip(x.ravel().tolist(), y.ravel().tolist(), strict=True)]
    return [Pose(*pose) for pose in zip(x.ravel().tolist(), y.ravel().tolist(), angle.ravel().tolist(), strict=True)]


def draws(seed: int, *shape: int) -> Floats:
    """Return uniform random numbers in [0, 1), the same for a seed on every machine and with every version of numpy.

    numpy guarantees only the bit stream of PCG64 and its conversion to doubles, not distributions.
    """
    return np.random.Generator(np.random.PCG64(seed)).random(shape)
