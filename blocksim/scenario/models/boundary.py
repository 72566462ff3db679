"""Boundary: the ground and walls."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Self

from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Table

Point = tuple[q.Length, q.Length]


def _slips(points: Sequence[tuple[float, float]]) -> Iterator[tuple[int, str]]:
    """Yield the number of every invalid point of a profile, and why."""
    for number, ((x_before, y_before), (x, y)) in enumerate(pairwise(points), start=1):
        if (x, y) == (x_before, y_before):
            yield number, "the same point as the one before"
        elif x < x_before:
            yield number, f"x goes back from {x_before:.6g} m to {x:.6g} m; a profile runs towards +x"
        if number > 1 and points[number - 2][0] == x_before == x:
            turns = (y_before - points[number - 2][1]) * (y - y_before) < 0.0
            if turns:
                yield number, "the profile goes back over its own vertical segment"


class Ground(Table):
    """The half-plane below y = 0, or the region below a profile; a tilt turns gravity, x stays along the ground."""

    tilt: q.TiltAngle = Field(default=0.0, description="slope of the ground, positive where its +x end is raised")
    material: str | None = Field(default=None, description="the name of its material (default: the blocks' own)")
    profile: tuple[Point, ...] | None = Field(
        default=None,
        description="points [x, y] of its surface towards +x, level beyond both ends (default: level at y = 0)",
        json_schema_extra={"minItems": 2},
    )

    @model_validator(mode="after")
    def _profile_is_a_surface(self) -> Self:
        if self.profile is None:
            return self
        if len(self.profile) < 2:  # noqa: PLR2004 - two points make a piece
            message = "a profile needs at least two points [x, y]"
            raise q.invalid(message, "profile")
        for number, message in _slips(self.profile):
            raise q.invalid(message, "profile", number)
        return self


class Wall(Table):
    """Straight segment of boundary with one face: the solid is on the right of the way from `from` to `to`."""

    start: Point = Field(
        alias="from", description="[x, y] of its start; the solid is on the right of the way to its end"
    )
    end: Point = Field(alias="to", description="[x, y] of its end")
    material: str | None = Field(default=None, description="the name of its material (default: as the ground)")

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.start == self.end:
            message = "start and end of a wall must differ"
            raise q.invalid(message, "to")
        return self
