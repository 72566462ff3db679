"""Gravity: its size, and coefficients of a pseudo-static earthquake."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import pydantic

from blocksim.scenario import units as q
from blocksim.scenario.models.base import setting
from blocksim.scenario.models.contact import Short

MAGNITUDE = q.Quantity(q.ACCELERATION, at_least=0.0)


class GravityField(Short):
    """Acceleration of all bodies and soil. A bare acceleration in the file is its magnitude, without coefficients."""

    bare = MAGNITUDE.json_schema({"type": "number"})
    magnitude: Annotated[float, MAGNITUDE] = setting("acceleration of gravity, turned by ground.tilt", q.USUAL_GRAVITY)
    horizontal: q.Number = setting("coefficient kh: adds kh magnitude along +x, of blocks and soil alike", 0.0)
    vertical: Annotated[float, q.Quantity(q.NUMBER, above=-1.0, below=1.0)] = setting(
        "coefficient kv: takes kv magnitude away, normal to the ground", 0.0
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _table(cls, value: object) -> object:
        return value if isinstance(value, Mapping | GravityField) else {"magnitude": MAGNITUDE.read(value)}

    @pydantic.model_serializer(mode="wrap")
    def _bare(self, write: pydantic.SerializerFunctionWrapHandler) -> Any:
        return write(self) if self.horizontal or self.vertical else self.magnitude

    def pull(self, tilt: float) -> tuple[float, float]:
        """Return the acceleration (m/s2) along x and y where the magnitude is turned by a tilt (rad)."""
        g = self.magnitude
        return -g * (math.sin(tilt) - self.horizontal), -g * (math.cos(tilt) - self.vertical)

    @property
    def size(self) -> float:
        """The size of all of it (m/s2) on level ground."""
        return self.magnitude * math.hypot(self.horizontal, 1.0 - self.vertical)
