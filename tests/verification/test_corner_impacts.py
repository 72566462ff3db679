"""One corner on the ground (V5, V6), two blocks against each other (V16), energy of impacts (coarse V15)."""

from __future__ import annotations

from itertools import product
from math import radians
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.analysis import closed_forms as forms

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Simulation, Start

TILT = radians(30.0)
FALLING = forms.Motion(0.0, -1.0, 0.0)
ANGLES = (0.0, 3.0, 10.0, 20.0, 30.0, 45.0, 52.0, 60.0, 75.0, 89.0)  # degrees
FRICTIONS = (0.0, 0.1, 0.3, 0.6, 1.0)


def arm_of(block: PaperBlock, tilt: float) -> tuple[float, float]:
    return forms.lowest_corner(block.width, block.height, tilt)


def dropped_on_corner(start: Start, block: PaperBlock, tilt: float, e: float, friction: float) -> Simulation:
    lowest = arm_of(block, tilt)[1]
    return start(
        [{"y": -lowest + 1e-6, "velocity": [0.0, -1.0], "angle": tilt}],
        restitution=e,
        ground_friction=friction,
        gravity=0.0,
    )


@pytest.mark.parametrize(("e", "vy", "spin"), [(0.0, -0.2963, -38.95), (0.5, 0.0556, -58.43)])
def test_frictionless_corner_impact_turns_fall_into_spin(
    start: Start, paper_block: PaperBlock, e: float, vy: float, spin: float
) -> None:
    impact = dropped_on_corner(start, paper_block, TILT, e, 0.0).to_step(1500)
    arm = arm_of(paper_block, TILT)
    expected = forms.frictionless_impact(paper_block.mass, paper_block.inertia, arm, FALLING, e)
    assert [expected.vy, expected.spin] == pytest.approx([vy, spin], abs=5e-3)
    assert impact.contacts == 0
    assert impact.bodies[0].vx == 0.0
    assert impact.bodies[0].vy == pytest.approx(expected.vy, abs=0.01)
    assert impact.bodies[0].spin == pytest.approx(expected.spin, abs=0.5)


def test_sticking_corner_impact_stops_the_corner(start: Start, paper_block: PaperBlock) -> None:
    impact = dropped_on_corner(start, paper_block, TILT, 0.0, 2.0).to_step(1500)
    arm = arm_of(paper_block, TILT)
    expected = forms.sticking_impact(paper_block.mass, paper_block.inertia, arm, FALLING, 0.0)
    assert expected.spin == pytest.approx(-13.84, abs=5e-3)
    assert impact.bodies[0].spin == pytest.approx(expected.spin, rel=0.02)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_impacts_never_gain_kinetic_energy(start: Start, paper_block: PaperBlock, e: float) -> None:
    for angle, friction in product(ANGLES, FRICTIONS):
        impact = dropped_on_corner(start, paper_block, radians(angle), e, friction)
        before = impact.kinetic
        for _ in range(20):
            impact.to_step(impact.steps + 100)
            assert impact.kinetic <= before * (1.0 + 1e-12), f"{angle} degrees, friction {friction}"
        assert impact.kinetic < before * (0.999 if e < 0.9 else 1.0)


def momenta(scene: Simulation) -> np.ndarray:
    """Return momentum along x and y and the angular momentum about the origin."""
    b = scene.bodies
    spin = b.inertia * b.spin + b.mass * (b.x * b.vy - b.y * b.vx)
    return np.array([(b.mass * b.vx).sum(), (b.mass * b.vy).sum(), spin.sum()])


@pytest.mark.parametrize("e", [0.0, 0.2, 1.0])
def test_two_blocks_off_centre_keep_momentum_and_angular_momentum(start: Start, e: float) -> None:
    scene = start(
        [
            {"y": 0.1, "velocity": [1.0, 0.1], "spin": 5.0},
            {"y": 0.112, "x": 0.0335, "velocity": [-0.6, 0.0], "angle": 0.05, "spin": -12.0, "width": 0.03},
        ],
        restitution=e,
        gravity=0.0,
    )
    before, energy = momenta(scene), scene.kinetic
    scene.to_step(20_000)
    after = momenta(scene)
    size = np.array([1.0, 1.0, 0.1]) * float(scene.bodies.mass.sum())  # arms of 0.1 m, speeds of 1 m/s
    assert scene.bodies[0].vx < 0.6  # they have met
    assert scene.kinetic < energy
    assert np.all(np.abs(after - before) < scene.steps * np.finfo(float).eps * size)
