"""Sliding on level ground (V7, Eq 13) and on a slope (V8), sticking below the friction angle (V9), Coulomb's cone."""

from __future__ import annotations

from math import atan, cos, radians, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.analysis import closed_forms as forms
from blocksim.kernels.arrays import SLOTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conftest import PaperBlock, Simulation, Start


def pushed(start: Start, block: PaperBlock, speed: float, spacing: float = 1e-3) -> Simulation:
    body = {"y": block.height / 2, "velocity": [speed, 0.0]}
    return start([body], ground_friction=0.38, contact={"particle_spacing": spacing})


@pytest.mark.parametrize(("speed", "distance", "time"), [(0.5, 33.53e-3, 0.1341), (1.0, 134.127e-3, 0.2683)])
def test_sliding_block_stops_where_and_when_equation_13_says(
    start: Start, paper_block: PaperBlock, speed: float, distance: float, time: float
) -> None:
    slide = pushed(start, paper_block, speed)
    while slide.bodies[0].vx > 1e-4 * speed:
        slide.to_time(slide.time + 1e-4)
    assert forms.sliding_stop_distance(speed, 0.38) == pytest.approx(distance, rel=2e-4)
    assert slide.time == pytest.approx(forms.sliding_stop_time(speed, 0.38), rel=5e-3)
    assert slide.time == pytest.approx(time, rel=5e-3)
    slide.to_time(slide.time + 0.02)
    assert slide.bodies[0].x == pytest.approx(distance, rel=5e-3)
    assert abs(slide.bodies[0].vx) < 1e-6


def test_particle_spacing_changes_no_bit_of_a_slide(start: Start, paper_block: PaperBlock) -> None:
    slides = [pushed(start, paper_block, 0.5, spacing).to_time(0.01) for spacing in (5e-4, 1e-3, 4e-3)]
    assert len({slide.bodies.tobytes() for slide in slides}) == 1


def on_slope(start: Start, block: PaperBlock, slope: float, friction: float) -> Simulation:
    """Put a block on a slope that goes down towards +x."""
    return start([{"y": block.height / 2}], ground_friction=friction, tilt=-slope)


def test_block_slides_down_a_slope_with_the_expected_acceleration(start: Start, paper_block: PaperBlock) -> None:
    slope = radians(30.0)
    slide = on_slope(start, paper_block, slope, 0.31).to_time(0.1)
    time, speed = slide.time, float(slide.bodies[0].vx)
    slide.to_time(0.3)
    acceleration = (slide.bodies[0].vx - speed) / (slide.time - time)
    assert forms.incline_acceleration(slope, 0.31) == pytest.approx(2.271, abs=5e-4)
    assert acceleration == pytest.approx(9.81 * (sin(slope) - 0.31 * cos(slope)), rel=5e-3)


@pytest.mark.parametrize("friction", [0.31, 0.38])
def test_block_half_a_degree_below_the_friction_angle_does_not_creep(
    start: Start, paper_block: PaperBlock, friction: float
) -> None:
    rest = on_slope(start, paper_block, atan(friction) - radians(0.5), friction).to_time(1.0)
    time, place = rest.time, float(rest.bodies[0].x)
    rest.to_time(6.0)
    assert abs(rest.bodies[0].x - place) / (rest.time - time) < 1e-6
    assert abs(rest.bodies[0].x) < 1e-6


@pytest.mark.parametrize("friction", [0.31, 0.38])
def test_block_half_a_degree_above_the_friction_angle_slips(
    start: Start, paper_block: PaperBlock, friction: float
) -> None:
    slope = atan(friction) + radians(0.5)
    slide = on_slope(start, paper_block, slope, friction).to_time(0.5)
    acceleration = forms.incline_acceleration(slope, friction)
    assert slide.bodies[0].x == pytest.approx(forms.fall_distance(0.5, acceleration), rel=0.02)


@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_shear_force_never_leaves_the_static_cone(start_shipped: Callable[..., Simulation], restitution: float) -> None:
    scene = start_shipped(
        "three_blocks", contact__restitution=restitution, contact__stiffness_scale=1e-3, time__stop_at_rest=False
    )
    world, last, shears = scene.world, 0.35, 0
    while scene.time < last:
        scene.to_step(scene.steps + 5)
        count = int(world.clock[0].pair_count)
        slots = scene.slots
        ground = world.pairs.b[:count] == len(world.bodies) - 1
        static = np.where(ground, 0.38, 0.31)[:, np.newaxis].repeat(SLOTS, axis=1)
        assert np.all(np.abs(slots.shear_force) <= static * slots.normal_force * (1.0 + 1e-12))
        assert np.all(slots.normal_force >= 0.0)
        shears += int(np.count_nonzero(slots.shear_force))
    assert shears > 1000
