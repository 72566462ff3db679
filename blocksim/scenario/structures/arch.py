"""Circular arches of equal voussoirs."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Whole, require_one
from blocksim.scenario.outlines import Corner
from blocksim.scenario.structures.base import UnfitError
from blocksim.scenario.structures.shaped import Cell, Shaped

MOST_VOUSSOIRS = 1000
MOST_TURN = 0.9 * math.pi
ABUTMENT = 2.0
"""Width of an abutment in thicknesses of the arch; it is half as deep behind its joint."""


class Arch(Shaped):
    """Voussoirs between radial joints, from the left springing to the right one, then two fixed abutments.

    Inner and outer faces are straight, with their ends on the circles of intrados and extrados. Abutments are
    rectangles of twice the thickness whose faces are the springing joints.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["radius"]}, {"required": ["span"]}]})

    kind: Literal["arch"] = Field(description="kind of structure")
    radius: q.PositiveLength | None = Field(default=None, description="mean radius; give this or span")
    span: q.PositiveLength | None = Field(
        default=None, description="clear distance of the springings of the intrados; give this or radius"
    )
    thickness: q.PositiveLength = Field(description="thickness of the ring")
    embrace: q.Embrace = Field(default=math.pi, description="angle between the springing joints")
    count: Annotated[int, Whole(1, MOST_VOUSSOIRS)] = Field(description="number of voussoirs")
    abutments: bool = Field(default=True, description="whether fixed blocks hold the springings")

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        missing = "the size is missing: give radius (of the middle of the ring) or span"
        require_one(missing, radius=self.radius, span=self.span)
        if self.mean_radius <= 0.5 * self.thickness:
            message = f"a ring of {1e3 * self.thickness:g} mm needs a mean radius of more than half of that"
            raise q.invalid(message, "thickness")
        return self

    @property
    def mean_radius(self) -> float:
        """Radius (m) of the middle of the ring."""
        if self.radius is not None:
            return self.radius
        return 0.5 * (self.span or math.nan) / math.sin(0.5 * self.embrace) + 0.5 * self.thickness

    @property
    def drawn(self) -> Sequence[Cell]:
        """Voussoirs about the centre of the circles; raises UnfitError for one that turns by half a circle or more."""
        if self.embrace / self.count > MOST_TURN:
            raise UnfitError("count", f"a voussoir of {math.degrees(self.embrace / self.count):.4g} deg is not convex")
        inner, outer = self.mean_radius - 0.5 * self.thickness, self.mean_radius + 0.5 * self.thickness
        joints = [0.5 * math.pi + self.embrace * (0.5 - number / self.count) for number in range(self.count + 1)]
        ends = [(_at(inner, angle), _at(outer, angle)) for angle in joints]
        ring = [Cell([one[0], other[0], other[1], one[1]]) for one, other in pairwise(ends)]
        return [*ring, *([self._abutment(joints[0], 1.0), self._abutment(joints[-1], -1.0)] if self.abutments else [])]

    def _abutment(self, angle: float, way: float) -> Cell:
        """Return the fixed block behind a joint; `way` is 1 where it lies counter-clockwise of it."""
        inner, outer = (self.mean_radius + 0.5 * sign * ABUTMENT * self.thickness for sign in (-1.0, 1.0))
        back = way * self.thickness
        dx, dy = -back * math.sin(angle), back * math.cos(angle)
        (x0, y0), (x1, y1) = _at(inner, angle), _at(outer, angle)
        return Cell([(x0, y0), (x1, y1), (x1 + dx, y1 + dy), (x0 + dx, y0 + dy)], fixed=True)


def _at(radius: float, angle: float) -> Corner:
    return radius * math.cos(angle), radius * math.sin(angle)
