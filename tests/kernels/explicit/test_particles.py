"""Boundary particles: rows of discs, as bumpy as the equations make them, and the kernel model, which is not."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import POINT, zeros
from blocksim.kernels.common.shapes import to_world
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.models.particles import ROWS, row_direction, row_intervals, seen_from_row
from blocksim.kernels.explicit.models.smoothed import add_row
from blocksim.kernels.sph.functions import kernel_value
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world.build import build_world
from tests.kernels.scenes import pose, touch

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, Records
    from tests.kernels.scenes import Touching


SPACING = 1e-3
COUNT = 32  # discs along the paper's block
RAISED = SPACING * (1.0 - sqrt(0.75))  # how much deeper than face on face two interlocked rows lie
WIDE = 3.0 * WIDTH
STEP = 1e-6  # s


def centres(touching: Touching, body: Record) -> np.ndarray:
    """Return the centres (n, 2) of all discs of a body."""
    particles = touching.world.particles[body.first_particle : body.first_particle + body.particle_count]
    return np.array([to_world(body, particle.x, particle.y) for particle in particles])


def overlaps(touching: Touching) -> list[float]:
    """Return all overlaps of the discs of two blocks, by brute force."""
    a, b = (centres(touching, body) for body in touching.world.bodies[:2])
    gaps = SPACING - np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    return sorted(gaps[gaps > 0.0].tolist())


@given(shift=st.floats(-1.2 * WIDTH, 1.2 * WIDTH), depth=st.floats(1e-7, 4e-4), angle=st.floats(-0.8, 0.8))
def test_two_discs_touch_while_their_centres_are_nearer_than_the_diameter(
    shift: float, depth: float, angle: float
) -> None:
    found = touch("particles", shift=shift, depth=depth, angle=angle)
    assert np.sort(found.points.depth) == pytest.approx(overlaps(found), abs=1e-15)
    assert np.hypot(found.points.nx, found.points.ny) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("below", [None, WIDE])
def test_interlocked_discs_touch_two_each_at_thirty_degrees(below: float | None) -> None:
    shift = 0.0 if below is None else 0.5 * SPACING
    assert not touch("particles", below=below, shift=shift, depth=RAISED - 1e-7).points.size
    found = touch("particles", below=below, shift=shift, depth=RAISED + 1e-7)
    assert len(found.points) == 2 * COUNT
    slopes = np.degrees(np.arcsin(np.abs(found.points.nx)))
    assert slopes == pytest.approx(np.full(2 * COUNT, 30.0), abs=0.02)
    assert found.wrench()[0] == pytest.approx(0.0, abs=1e-18)


def test_contact_keeps_its_history_while_its_disc_begins_and_ends_to_touch_others(pace: int) -> None:
    """A block is dragged over hills and valleys at a height of its own; nothing slips, so springs only stretch."""
    contact = {"model": "particles", "restitution": 1.0}
    world = build_world(scenario_of([{"y": HEIGHT / 2}], contact=contact))
    world.interactions.static_friction = world.interactions.kinetic_friction = 1e6
    block, drag = world.bodies[0], 1e-6 * pace
    block.y -= 1.2 * RAISED
    block.vx = drag / STEP
    assert rebuild_pairs(world)
    before: dict[tuple[int, int], float] = {}
    met, parted = 0, 0
    for n in range(1200 // pace):
        block.x = n * drag
        pair_forces(world, 0, STEP)
        contacts = world.contacts[0, : world.pairs[0].active]
        now = {(int(contact.slot), int(contact.face)): float(contact.spring) for contact in contacts}
        for key, spring in now.items():
            assert abs(spring - before.get(key, 0.0)) <= 1.001 * drag, key
        met += n > 0 and len(now.keys() - before.keys()) > 0 and len(now.keys() & before.keys()) == COUNT
        parted += len(before.keys() - now.keys()) > 0 and len(now) == COUNT
        before = now
    assert (met, parted) == (1, 2)
    assert np.abs(list(before.values())).min() > 1e-4  # remembered since the disc was met


ODD = 1.3e-3
MODELS = {"kernel": 0.0, "particles": 0.5 * ODD}  # and how far their rows lie inside the edge


def body_and_particles(model: str) -> tuple[Record, Records]:
    world = build_world(scenario_of([{"y": 0.5}], contact={"model": model, "particle_spacing": ODD}))
    return world.bodies[0], world.particles


@pytest.mark.parametrize("model", MODELS)
def test_particles_of_a_row_lie_where_the_row_says(model: str) -> None:
    body, particles = body_and_particles(model)
    k = 0
    for row in range(ROWS):
        count = row_intervals(body, row) + (model == "kernel")
        for j in range(count):
            along, above, spacing = seen_from_row(body, MODELS[model], row, particles[k].x, particles[k].y)
            assert along == pytest.approx(j * spacing, abs=1e-15)
            assert above == pytest.approx(0.0, abs=1e-15)
            dx, dy = row_direction(row)
            assert [particles[k].nx, particles[k].ny] == [dy, -dx]
            k += 1
    assert k == particles.size


COARSE, ABOVE, LOWER = 2e-3, 1e-4, 0


@pytest.mark.parametrize("along", [0.0, 0.4 * COARSE, WIDTH / 2, WIDTH])
def test_weight_of_a_row_is_the_integral_of_the_kernel_along_it(along: float) -> None:
    world = pose((0.0, 1.0, 0.0), contact={"model": "kernel", "particle_spacing": COARSE})
    body, controls, sums = world.bodies[0], world.controls[0], zeros(1, POINT)[0]
    add_row(along - body.half_x, -body.half_y - ABOVE, 1.0, body, LOWER, controls, sums)
    places = np.linspace(0.0, WIDTH, round(WIDTH / COARSE) + 1)
    values = [
        kernel_value(int(controls.sph_kernel), float(np.hypot(place - along, ABOVE)), float(controls.smoothing_length))
        for place in places
    ]
    assert sums.weight == pytest.approx(np.trapezoid(values, places), rel=1e-12)


BROAD = 2.2 * WIDTH
SPACINGS = [0.5e-3, 1e-3, 2e-3, 4e-3]
DEPTHS = st.floats(1e-9, 1e-4)


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("below", [None, WIDTH])
def test_face_has_the_stiffness_of_two_corners_at_any_spacing(spacing: float, below: float | None) -> None:
    corners, particles = (touch(model, spacing=spacing, below=below) for model in ("surface", "kernel"))
    assert len(corners.points) == 2
    assert len(particles.points) > WIDTH / spacing
    assert particles.wrench() == pytest.approx(corners.wrench(), abs=1e-18)


@given(shift=st.floats(-0.6 * WIDTH, 0.6 * WIDTH), depth=DEPTHS, spacing=st.sampled_from(SPACINGS))
def test_block_sliding_along_a_flat_face_feels_no_bump(shift: float, depth: float, spacing: float) -> None:
    found = touch("kernel", shift=shift, depth=depth, spacing=spacing, below=BROAD)
    assert np.abs(found.normals[:, 0]).max() < 1e-12
    assert found.points.depth == pytest.approx(depth, rel=1e-6, abs=1e-16)
    is_own = found.points.slot < found.upper.particle_count
    assert found.points.share[is_own].sum() == pytest.approx(1.0, rel=1e-12)  # half of a face, wherever it stands


@given(angle=st.floats(0.15, 0.7), shift=st.floats(-0.5 * WIDTH, 0.5 * WIDTH), depth=DEPTHS)
def test_corner_on_a_flat_face_touches_it_to_its_true_depth(angle: float, shift: float, depth: float) -> None:
    found = touch("kernel", angle=angle, shift=shift, depth=depth, below=BROAD)
    own = found.points[found.points.slot < found.upper.particle_count]
    assert own.size == 2  # the corner is the last particle of one row and the first of the next
    assert own.depth == pytest.approx(depth, rel=1e-6, abs=1e-16)
    assert np.abs(own.nx).max() < 1e-12
    assert own.share.min() > 0.0
