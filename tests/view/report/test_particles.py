"""Particles of a report lie where the world has them."""

import numpy as np
import pytest

from blocksim.scenario import load_scenario
from blocksim.view.report.particles import boundary_particles
from blocksim.world.build import build_world
from tests.view.report.folders import SCENARIOS


def test_surface_model_has_none() -> None:
    assert len(boundary_particles(load_scenario(SCENARIOS / "three_blocks.toml"), 0.05, 0.025)) == 0


@pytest.mark.parametrize("model", ["particles", "kernel"])
def test_particles_are_those_of_the_world(model: str) -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks_particles.toml", {"contact.model": model})
    world = build_world(scenario)
    body = world.bodies[0]
    own = world.particles[int(body.first_particle) : int(body.first_particle + body.particle_count)]
    expected = np.unique(np.stack([own.x, own.y], axis=-1).round(9), axis=0)
    drawn = boundary_particles(scenario, 2.0 * float(body.half_x), 2.0 * float(body.half_y))
    assert np.unique(drawn.round(9), axis=0) == pytest.approx(expected)
