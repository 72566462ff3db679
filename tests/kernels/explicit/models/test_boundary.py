"""Rows of boundary particles as the narrow phases look them up, against the particles themselves."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.explicit.models.particles import (
    ROWS,
    first_within,
    is_particle_near,
    last_within,
    row_direction,
    row_intervals,
    seen_from_row,
)
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, Records

SPACING = 1.3e-3
MODELS = {"kernel": 0.0, "particles": 0.5 * SPACING}  # and how far their rows lie inside the edge


def body_and_particles(model: str) -> tuple[Record, Records]:
    world = build_world(scenario_of([{"y": 0.5}], contact={"model": model, "particle_spacing": SPACING}))
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


body_and_particles_of = {model: body_and_particles(model) for model in MODELS}


@given(
    along=st.floats(-0.05, 0.05), width=st.floats(1e-5, 0.02), spacing=st.floats(1e-4, 5e-3), last=st.integers(0, 60)
)
def test_particles_within_a_width_are_those_between_first_and_last(
    along: float, width: float, spacing: float, last: int
) -> None:
    found = set(range(first_within(along, width, spacing), last_within(along, width, spacing, last) + 1))
    for j in range(last + 1):
        distance = abs(along - j * spacing)
        if abs(distance - width) > 1e-12:
            assert (j in found) == (distance < width)


@given(x=st.floats(-0.06, 0.06), y=st.floats(-0.06, 0.06), angle=st.floats(-4.0, 4.0), reach=st.floats(0.0, 0.02))
def test_particle_is_near_when_it_lies_in_the_grown_rectangle(x: float, y: float, angle: float, reach: float) -> None:
    body, particles = body_and_particles_of["kernel"]
    owner, touched = body.copy(), body.copy()
    owner.x, owner.y, owner.angle, owner.cos, owner.sin = x, y, angle, cos(angle), sin(angle)
    touched.x = touched.y = 0.0
    for k in (0, 7, 31):
        particle = particles[k]
        px = x + cos(angle) * particle.x - sin(angle) * particle.y
        py = y + sin(angle) * particle.x + cos(angle) * particle.y
        beyond = max(abs(px) - touched.half_x, abs(py) - touched.half_y)
        if abs(beyond - reach) > 1e-12:
            assert is_particle_near(owner, particle, touched, reach) == (beyond < reach)
