"""Sets of particles that the SPH tests share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
import pytest

from blocksim.kernels.sph.fields import Particles

if TYPE_CHECKING:
    from blocksim.kernels.sph.fields import KernelName


class Scatter(Protocol):
    """Make disordered particles; the signature of the fixture `scatter`."""

    def __call__(self, kernel: KernelName = "wendland-c2", seed: int = 0) -> Particles:
        """`seed` of places, masses and densities."""


@pytest.fixture(scope="session")
def scatter() -> Scatter:
    """Throw 12 x 12 particles, 0.1 m apart and moved by up to 0.03 m, with masses and densities that differ."""

    def scatter_particles(kernel: KernelName = "wendland-c2", seed: int = 0) -> Particles:
        random = np.random.default_rng(seed)
        lattice = np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1).reshape(-1, 2)
        positions = 0.1 * (lattice + random.uniform(-0.3, 0.3, lattice.shape)) - 0.5
        density = random.uniform(1000.0, 2000.0, len(lattice))
        return Particles(positions, density * 0.01 * random.uniform(0.8, 1.2, len(lattice)), density, 0.15, kernel)

    return scatter_particles
