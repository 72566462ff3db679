"""Single records to call kernels with."""

from __future__ import annotations

from math import cos, hypot, sin
from typing import TYPE_CHECKING, Protocol

import pytest

from blocksim.kernels.arrays import ALL, BODY, zeros

if TYPE_CHECKING:
    from blocksim.kernels.arrays import Record


class MakeBody(Protocol):
    """Make the record of one body; the signature of the fixture `make_body`."""

    def __call__(
        self,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        *,
        width: float = 0.032,
        height: float = 0.025,
        mass: float = 0.1,
    ) -> Record:
        """Pose (m, rad), sides (m) and mass (kg)."""


@pytest.fixture(scope="session")
def make_body() -> MakeBody:
    """Make the record of one body at rest."""

    def make(
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        *,
        width: float = 0.032,
        height: float = 0.025,
        mass: float = 0.1,
    ) -> Record:
        body = zeros(1, BODY)[0]
        body.x, body.y, body.angle = x, y, angle
        body.cos, body.sin = cos(angle), sin(angle)
        body.faces = body.corners = ALL
        body.half_x, body.half_y, body.radius = width / 2, height / 2, hypot(width, height) / 2
        body.mass, body.inertia = mass, mass * (width**2 + height**2) / 12
        body.inverse_mass, body.inverse_inertia = 1.0 / body.mass, 1.0 / body.inertia
        return body

    return make
