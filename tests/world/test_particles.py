"""Boundary particles of all bodies of a world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from blocksim.verification.scene import scenario_of
from blocksim.world.bodies import division, slots_of_a_pair
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from blocksim.kernels.common.arrays import Records, World
    from blocksim.scenario import Scenario

sides = st.floats(1e-2, 0.1)
spacings = st.floats(5e-4, 3e-3)
WITH_PARTICLES = ["kernel", "particles"]


def scenario(bodies: Sequence[Mapping[str, object]], model: str, spacing: float, **tables: Any) -> Scenario:
    return scenario_of(bodies, contact={"model": model, "particle_spacing": spacing}, **tables)


def particles_of(world: World, body: int) -> Records:
    """Return the particles of one body."""
    record = world.bodies[body]
    found: Records = world.particles[record.first_particle : record.first_particle + record.particle_count]
    return found


@settings(max_examples=30)
@given(width=sides, height=sides, spacing=spacings)
def test_kernel_particles_lie_on_the_edge_and_share_every_face(width: float, height: float, spacing: float) -> None:
    world = build_world(scenario([{"y": 0.5, "width": width, "height": height}], "kernel", spacing))
    particles = particles_of(world, 0)
    assert particles.length.sum() == pytest.approx(2.0 * (width + height), rel=1e-12)
    assert np.maximum(np.abs(particles.x) - width / 2, np.abs(particles.y) - height / 2) == pytest.approx(
        0.0, abs=1e-15
    )
    for normal in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)):
        face = particles[(particles.nx == normal[0]) & (particles.ny == normal[1])]
        outward = face.x * normal[0] + face.y * normal[1]
        assert outward == pytest.approx(np.abs(0.5 * np.array([width, height]) @ normal), abs=1e-15)
        assert face.share.sum() == pytest.approx(1.0, rel=1e-12)
        along = np.sort(face.x * normal[1] - face.y * normal[0])
        assert np.diff(along).max() <= spacing * (1.0 + 1e-9)
        assert along[-1] - along[0] == pytest.approx(height if normal[1] == 0.0 else width, rel=1e-12)
    assert (
        particles.size == 2 * (division(width, spacing) + division(height, spacing)) + 4
    )  # corners belong to two faces


def test_round_off_in_the_division_adds_no_particle() -> None:
    assert division(0.3, 0.1) == 3  # 0.3/0.1 is just below 3, 0.1 * 3 just above 0.3
    assert [division(side, 1e-3) for side in (0.032, 0.025)] == [32, 25]


@settings(max_examples=30)
@given(width=sides, height=sides, spacing=spacings)
def test_discs_fit_into_the_block_and_share_all_four_faces(width: float, height: float, spacing: float) -> None:
    world = build_world(scenario([{"y": 0.5, "width": width, "height": height}], "particles", spacing))
    particles = particles_of(world, 0)
    inner = (width - spacing, height - spacing)
    beyond = np.maximum(np.abs(particles.x) - inner[0] / 2, np.abs(particles.y) - inner[1] / 2)
    assert beyond == pytest.approx(0.0, abs=1e-15)
    assert particles.length.sum() == pytest.approx(2.0 * sum(inner), rel=1e-12)
    assert particles.share.sum() == pytest.approx(4.0, rel=1e-12)
    assert len(set(zip(particles.x.tolist(), particles.y.tolist(), strict=True))) == particles.size
    assert particles.size == 2 * sum(division(side, spacing) for side in inner)
    ring = np.stack([particles.x, particles.y], axis=1)
    assert np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).max() <= spacing * (1.0 + 1e-9)


@pytest.mark.parametrize("model", WITH_PARTICLES)
def test_rows_follow_one_another_counter_clockwise(model: str) -> None:
    world = build_world(scenario([{"y": 0.5}], model, 1.7e-3))
    particles, body = particles_of(world, 0), world.bodies[0]
    rows = [body.row_x, body.row_y, body.row_x, body.row_y]
    begins = np.cumsum([0, *(row + (model == "kernel") for row in rows)])
    signs = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    for begin, sign in zip(begins, signs, strict=False):
        assert (np.sign(particles.x[begin]), np.sign(particles.y[begin])) == sign
    assert begins[-1] == particles.size


@pytest.mark.parametrize("model", WITH_PARTICLES)
def test_pair_of_the_two_largest_bodies_has_a_slot_for_every_contact(model: str) -> None:
    small, large = {"y": 0.5}, {"y": 0.5, "x": 0.2, "width": 0.064}
    world = build_world(scenario([small, large, {**large, "x": 0.4}], model, 1e-3))
    most = int(world.bodies[1].particle_count)
    assert slots_of_a_pair(world.bodies, model) == (2 if model == "kernel" else 4) * most
    assert world.candidates.shape[1] == world.contacts.shape[1] == slots_of_a_pair(world.bodies, model)
    assert world.points.size == world.contacts.shape[1] + 1


def test_slabs_of_ground_have_particles_at_their_free_ends_only() -> None:
    hill = {"profile": [[0.0, 0.0], [0.1, 0.1], [0.2, 0.0]]}
    world = build_world(scenario([{"y": 0.5}], "kernel", 1e-3, ground=hill))
    counts = world.bodies.particle_count[1:-1].tolist()
    assert counts == [0, 1, 0, 0]
    peak, slab = particles_of(world, 2)[0], world.bodies[2]
    x = slab.x + slab.cos * peak.x - slab.sin * peak.y
    y = slab.y + slab.sin * peak.x + slab.cos * peak.y
    assert [x, y] == pytest.approx([0.1, 0.1], abs=1e-12)
    discs = build_world(scenario([{"y": 0.5}], "particles", 1e-3, ground=hill))
    assert discs.bodies.particle_count[1:-1].tolist() == [0, 0, 0, 0]
