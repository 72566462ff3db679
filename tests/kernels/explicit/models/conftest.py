"""Two blocks that overlap as a test wants it, and the contact points that a model finds between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import cos, sin
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pytest

from blocksim.kernels.common.shapes import place_corners
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.models import contact_points
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, World


@dataclass(frozen=True)
class Touching:
    """A block on a fixed one, or on the ground, and the points between them; normals point towards the upper one."""

    world: World
    upper: Record  # the block above
    points: Any  # (n,) POINT: a record array

    @property
    def normals(self) -> np.ndarray:
        """Normals (n, 2)."""
        return np.stack([self.points.nx, self.points.ny], axis=1)

    def wrench(self) -> np.ndarray:
        """Return force along x and y and torque (m) about the upper block's centre for springs of one corner each."""
        points = self.points
        pushes = points.share * points.depth
        arms = (points.x - self.upper.x) * points.ny - (points.y - self.upper.y) * points.nx
        return np.array([(pushes * points.nx).sum(), (pushes * points.ny).sum(), (pushes * arms).sum()])


@cache
def world_of(model: str, spacing: float, width: float, below: float | None) -> World:
    """Return the world of two blocks far apart; calls with the same arguments share it."""
    ground = [] if below is None else [{"y": 0.5 * HEIGHT, "width": below, "fixed": True}]
    bodies = [{"y": 0.5, "width": width}, *ground]
    return build_world(scenario_of(bodies, contact={"model": model, "particle_spacing": spacing}))


class Touch(Protocol):
    """Let a block touch the one below it, or the ground; the signature of the fixture `touch`."""

    def __call__(
        self,
        model: str,
        *,
        shift: float = 0.0,
        depth: float = 1e-6,
        angle: float = 0.0,
        spacing: float = 1e-3,
        width: float = WIDTH,
        below: float | None = WIDTH,
    ) -> Touching:
        """`shift`, `depth`, `spacing`, `width` of the blocks above and `below` (None: the ground) in m; `angle` rad."""


@pytest.fixture(scope="session")
def touch() -> Touch:
    """Let a block touch the one below it."""

    def place(
        model: str,
        *,
        shift: float = 0.0,
        depth: float = 1e-6,
        angle: float = 0.0,
        spacing: float = 1e-3,
        width: float = WIDTH,
        below: float | None = WIDTH,
    ) -> Touching:
        world = world_of(model, spacing, width, below)
        upper = world.bodies[0]
        upper.angle, upper.cos, upper.sin = angle, cos(angle), sin(angle)
        upper.x = shift
        upper.y = 0.0 if below is None else HEIGHT
        upper.y += abs(upper.sin) * upper.half_x + upper.cos * upper.half_y - depth
        place_corners(upper)
        assert rebuild_pairs(world)
        assert world.clock[0].pair_count <= 1
        count = contact_points(world, 0) if world.clock[0].pair_count else 0
        return Touching(world, upper.copy(), world.points[:count].copy())

    return place
