"""Measured orders of convergence, against what Taylor expansion and Fourier transforms of the sums say.

The error at a point depends on the particles within its support only, so a case is a small patch of particles around
one point of a smooth field, and the spacing can be as small as it takes to see an order clearly. With disorder the
root mean square over some patches counts; the same disorder is scaled with the spacing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np
import pytest

from blocksim.kernels.sph.fields import GradientForm, InterpolationForm, KernelName, Particles, gradient, interpolate
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Floats

PLACE = np.array([0.4, 0.3])
RATIO = 1.3  # h/dx
DISORDER = 0.2  # of dx, each way along x and y
SPACINGS = (1.0 / 1024.0, 1.0 / 4096.0)


def field(places: Floats) -> Floats:
    x, y = places.T
    return np.asarray(2.0 + np.sin(3.0 * x) * np.cos(2.0 * y))


def slope(places: Floats) -> Floats:
    x, y = places.T
    along_x, along_y = 3.0 * np.cos(3.0 * x) * np.cos(2.0 * y), -2.0 * np.sin(3.0 * x) * np.sin(2.0 * y)
    return np.stack([along_x, along_y], axis=-1)


class Case(NamedTuple):
    """A kind of patch."""

    kernel: KernelName
    is_edge: bool = False
    disorder: float = 0.0
    seed: int = 0
    at_particle: bool = False  # or between particles, for interpolation

    def patch(self, spacing: float) -> tuple[Particles, int]:
        """Return particles around PLACE and which is the middle one; an edge has none below that one."""
        reach = math.ceil(support_radius(KERNEL_CODES[self.kernel], RATIO)) + 1
        steps = np.arange(-reach, reach + 1)
        lattice = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        lattice = lattice[lattice[:, 1] >= 0] if self.is_edge else lattice
        moved = np.random.default_rng(self.seed).uniform(-self.disorder, self.disorder, lattice.shape)
        positions = PLACE + spacing * (lattice + moved)
        middle = int(np.flatnonzero((lattice == 0).all(axis=1))[0])
        return Particles(positions, 1600.0 * spacing**2, 1600.0, RATIO * spacing, self.kernel), middle


def interpolation_error(case: Case, form: InterpolationForm, spacing: float) -> float:
    """Return the error between the particles, or on the edge, half a spacing out."""
    particles, _ = case.patch(spacing)
    between = spacing * np.array([0.3, -0.5 if case.is_edge else 0.2])
    point = (PLACE if case.at_particle else PLACE + between)[None, :]
    found = interpolate(particles, field(particles.sources.positions), point, form)
    return float((found - field(point))[0])


def gradient_error(case: Case, form: GradientForm, spacing: float) -> float:
    """Return the length of the error at the middle particle."""
    particles, middle = case.patch(spacing)
    places = particles.sources.positions
    return float(np.linalg.norm(gradient(particles, field(places), form)[middle] - slope(places[middle])))


def order(error: Callable[[Case, float], float], case: Case) -> float:
    """Return the order between the two spacings at a fixed h/dx; for disorder, of the RMS over four patches."""
    cases = [case._replace(seed=seed) for seed in range(4 if case.disorder else 1)]
    coarse, fine = (math.sqrt(sum(error(one, spacing) ** 2 for one in cases)) for spacing in SPACINGS)
    return math.log(coarse / fine) / math.log(SPACINGS[0] / SPACINGS[1])


ORDERS: dict[str, tuple[float | None, float, float]] = {  # inside, disordered, at an edge
    "plain": (None, 0, 0),  # a part of the integral is missing
    "shepard": (2, 1, 1),  # the mean of r_b - r is of order h; zero by symmetry at the particles of a lattice
    "linear": (2, 2, 2),
    "plain gradient": (None, -1, -1),  # A sum V grad W, and that sum is 1/h times a number
    "symmetric gradient": (None, -1, -1),
    "difference gradient": (None, 0, 0),
    "corrected gradient": (2, 1, 1),  # second derivatives times third moments, which vanish on a lattice
}


@pytest.mark.parametrize("kernel", get_args(KernelName))
@pytest.mark.parametrize("name", ORDERS)
def test_errors_fall_with_the_order_of_their_form(kernel: KernelName, name: str) -> None:
    form: Any = name.split(maxsplit=1)[0]

    def error(case: Case, spacing: float) -> float:
        return (gradient_error if "gradient" in name else interpolation_error)(case, form, spacing)

    inside, disordered, edge = ORDERS[name]
    if inside is not None:
        assert order(error, Case(kernel, at_particle=True)) == pytest.approx(inside, abs=0.1)
    assert order(error, Case(kernel, disorder=DISORDER)) == pytest.approx(disordered, abs=0.1)
    assert order(error, Case(kernel, is_edge=True)) == pytest.approx(edge, abs=0.1)
