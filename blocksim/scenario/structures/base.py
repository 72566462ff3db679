"""What every kind of structure has in common."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import BeforeValidator, Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Table
from blocksim.scenario.models.geometry import Block

MAX_COUNT = 100_000


def _count(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MAX_COUNT:
        message = f"{q.shown(value)} is not a whole number from 1 to {MAX_COUNT}"
        raise q.invalid(message)
    return value


Count = Annotated[int, BeforeValidator(_count), Field(json_schema_extra={"minimum": 1, "maximum": MAX_COUNT})]


@dataclass(frozen=True, slots=True)
class Pose:
    """Centre (m) and angle (rad, counter-clockwise) of one placed block."""

    x: float
    y: float
    angle: float = 0.0


class UnfitError(ValueError):
    """A structure cannot be built from its block; `key` is the key to change."""

    def __init__(self, key: str, message: str) -> None:
        """Keep the key and what is wrong with its value."""
        self.key = key
        super().__init__(message)


class Structure(Table, ABC):
    """A generator of bodies; every kind adds its `kind` literal and its own keys."""

    block: str = Field(description="the name of the block it is made of")

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of bodies, told without placing them."""

    @abstractmethod
    def place(self, block: Block) -> Sequence[Pose]:
        """Return the pose of every block, lowest first; raises UnfitError where keys do not suit it."""
