"""Single records to call kernels with, and what a run without the compiler (NUMBA_DISABLE_JIT=1) leaves out.

Interpreted kernels take a thousand times longer. Tests then have fewer random examples, and one that steps a scene
farther than an interpreter does in seconds is skipped: shorter ones see the same code.
"""

from __future__ import annotations

import copy
import json
from functools import cache
from math import cos, hypot, sin
from typing import TYPE_CHECKING, Protocol

import numpy as np
import pytest
from hypothesis import settings

from blocksim.kernels.common.arrays import ALL, BODY, NORMAL, zeros
from blocksim.kernels.common.integrate import renew_rotations
from blocksim.kernels.common.jit import config
from blocksim.kernels.common.shapes import place_corners
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.simulation.schemes import Team
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blocksim.kernels.common.arrays import Record, Records, World
    from blocksim.simulation.schemes import Scene

IS_INTERPRETED = bool(config.DISABLE_JIT)
BODY_STEPS = 1000  # a test, times bodies: a second or two of an interpreter
PARTICLES_COST = 15  # a step with boundary particles, in steps of the surface model

if IS_INTERPRETED:
    settings.register_profile("interpreted", settings.get_profile("ci"), max_examples=3)
    settings.load_profile("interpreted")


@pytest.fixture
def compiler() -> None:
    """Skip a test that is about compiled code."""
    if IS_INTERPRETED:
        pytest.skip("is about compiled kernels")


@pytest.fixture(scope="session")
def pace() -> int:
    """Return by what a test divides the length of what it steps by itself: one with the compiler."""
    return 10 if IS_INTERPRETED else 1


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the compiler, skip a test that asks for more steps than it is given."""
    if not IS_INTERPRETED:
        return
    spent, advance = [0], Team.advance

    def advance_scene(team: Team, scene: Scene, last_step: int) -> tuple[Scene, int]:
        world = scene.world
        cost = 1 if world.particles is None else PARTICLES_COST
        spent[0] += (last_step - int(world.clock[0].steps)) * (world.bodies.size - 1) * cost
        if spent[0] > BODY_STEPS:
            pytest.skip("steps a scene too far for an interpreter")
        return advance(team, scene, last_step)

    monkeypatch.setattr(Team, "advance", advance_scene)


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
        place_corners(body)
        return body

    return make


def dashpots_by_definition(points: Records, masses: np.ndarray, ratio: float, step: float) -> np.ndarray:
    """Return the dashpot forces from d = C (u + dt/2 A (f_before - f_spring - d)), solved by numpy.

    `masses` (1/kg) are the inverse ones that the points see of one another.
    """
    root, weighted = np.sqrt(points.stiffness), np.sqrt(points.stiffness * points.weight)
    values, vectors = np.linalg.eigh(root[:, None] * masses * root)
    powers = [value**-0.5 if value > 1e-4 * values.max() else 0.0 for value in values]
    c = 2.0 * ratio * weighted[:, None] * ((vectors * powers) @ vectors.T) * weighted
    free = points.rate + 0.5 * step * masses @ (points.before - points.force)
    return np.asarray(np.linalg.solve(np.eye(points.size) + 0.5 * step * c @ masses, c @ free))


def jacobian(points: Records, a: Record, b: Record, direction: int) -> np.ndarray:
    """Return the closing or slip rates of all points as rows of (v_a, w_a, v_b, w_b)."""
    rows = []
    for point in points:
        ax = (-point.nx, -point.ny) if direction == NORMAL else (-point.ny, point.nx)
        arms = [ax[1] * (point.x - body.x) - ax[0] * (point.y - body.y) for body in (a, b)]
        rows.append([*ax, arms[0], -ax[0], -ax[1], -arms[1]])
    return np.array(rows)


def delassus(points: Records, a: Record, b: Record, direction: int) -> np.ndarray:
    """Return the inverse masses (1/kg) that points see of one another."""
    masses = [a.inverse_mass] * 2 + [a.inverse_inertia] + [b.inverse_mass] * 2 + [b.inverse_inertia]
    rows = jacobian(points, a, b, direction)
    return np.asarray((rows * masses) @ rows.T)


@cache
def blocks_apart(count: int, tables: str) -> World:
    """Return a world of blocks that do not touch, to be copied; `tables` of the scenario in JSON."""
    apart: list[Mapping[str, object]] = [{"x": 0.1 * i, "y": 0.1} for i in range(count)]
    return build_world(scenario_of(apart, **json.loads(tables)))


class Pose(Protocol):
    """Put blocks where a test wants them; the signature of the fixture `pose`."""

    def __call__(self, *poses: tuple[float, float, float], **tables: object) -> World:
        """x, y (m) and angle (rad) of every block; tables of the scenario. Nothing has moved, pairs are listed."""


@pytest.fixture(scope="session")
def pose() -> Pose:
    """Make a world of the paper's blocks in any poses, overlapping ones too."""

    def make(*poses: tuple[float, float, float], **tables: object) -> World:
        world = copy.deepcopy(blocks_apart(len(poses), json.dumps(tables)))
        for body, (x, y, angle) in zip(world.bodies, poses, strict=False):
            body.x, body.y, body.angle = x, y, angle
        renew_rotations(world.bodies)
        assert rebuild_pairs(world)
        return world

    return make
