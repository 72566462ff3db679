"""Friction that couples so much into the normal impulse that sweeps alone would not end: corners of tall bodies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.tolerances import LATE
from tests.kernels.nonsmooth.references import dense
from tests.kernels.nonsmooth.scenes import Block, after_substep, velocities

if TYPE_CHECKING:
    from numpy.random import Generator

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth

FEW = 250  # sweeps, of 1000 that are allowed and that it took where they swung
TALL = ((0.0, 0.0), (0.02, 0.0), (0.01, 0.05))  # m, a triangle
SETTING: dict[str, Any] = {
    "velocity_tolerance": 1e-9,
    "velocity_sweeps": 1000,
    "substeps": 1,
    "restitution": 0.0,
    "gravity": 0.0,
}


def on_a_corner(random: Generator, outline: tuple[tuple[float, float], ...]) -> Block:
    """Return a body of 20 x 60 mm, or with an outline, with its lowest corner on the ground and any motion."""
    angle = random.uniform(0.1, 1.4) * random.choice([-1.0, 1.0])
    corners = np.array(outline or [(-0.01, -0.03), (0.01, -0.03), (0.01, 0.03), (-0.01, 0.03)])
    corners = corners - corners.mean(axis=0)
    heights = math.sin(angle) * corners[:, 0] + math.cos(angle) * corners[:, 1]
    vx, vy, spin = random.normal(size=3) * (3.0, 0.3, 15.0)
    return Block(0.0, -heights.min() - 1e-9, angle, vx, vy, spin, width=0.02, height=0.06, outline=outline)


def solved(body: Block, friction: float) -> tuple[Nonsmooth, bool]:
    """Return a scene of a body after a substep, and whether its sweeps were late."""
    scene = after_substep([body], friction=friction, ground_friction=friction, **SETTING)
    return scene, bool(scene.contacts.stepping[0].sweeps > LATE)


@pytest.mark.parametrize("outline", [(), TALL], ids=["rectangle", "triangle"])
@pytest.mark.parametrize("friction", [1.6, 4.0])
def test_sweeps_end_and_obey_coulomb_where_friction_couples_strongly(
    outline: tuple[tuple[float, float], ...], friction: float
) -> None:
    random = np.random.default_rng(5)
    sliding = 0
    for _ in range(60):
        scene, is_late = solved(on_a_corner(random, outline), friction)
        if not scene.contacts.stepping[0].pack_count:
            continue
        assert scene.contacts.stepping[0].sweeps < FEW
        all_of = dense(scene)
        now = velocities(scene.contacts.states).ravel()
        counts = all_of.counts
        normal, shear, slip = all_of.impulses.sum(), float(all_of.shears[0]), float((all_of.tangents @ now)[0])
        rates = (all_of.normals @ now - all_of.targets)[counts]
        assert all_of.impulses.min() >= 0.0
        assert rates.min(initial=0.0) > -1e-7
        assert abs(shear) <= friction * normal + 1e-9
        if normal > 0.0 and abs(slip) > 1e-6:
            sliding += is_late
            assert shear == pytest.approx(-math.copysign(friction * normal, slip), abs=1e-8)
    assert sliding > 4
