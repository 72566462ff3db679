"""Fields on particles: what users call. Arrays in, arrays out; SI units.

Interpolation (Eq 1 of Huyen & Cuong 2020; Monaghan 1992, 2005; Liu & Liu 2003) and gradients (Eq 2), as the paper has
them ("plain") and in forms that keep their order where the plain ones lose it:

>>> import numpy as np
>>> from blocksim.kernels.sph.fields import Particles, gradient, interpolate
>>> lattice = np.arange(0.01, 1.0, 0.02)  # m
>>> x, y = (axis.ravel() for axis in np.meshgrid(lattice, lattice))
>>> water = Particles(np.column_stack([x, y]), mass=0.4, density=1000.0, smoothing_length=0.026)
>>> pressure = 9810.0 * (1.0 - y)  # Pa
>>> points = np.array([[0.503, 0.5], [0.503, 0.0]])  # inside, and on the bottom
>>> interpolate(water, pressure, points).round(1)
array([4877.3, 4817.4])
>>> interpolate(water, pressure, points, form="linear").round(1)
array([4905., 9810.])
>>> gradient(water, pressure, form="corrected")[:3, 1].round(1)  # of particles in the lowest row
array([-9810., -9810., -9810.])
"""

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from blocksim.kernels.common.arrays import Floats
from blocksim.kernels.sph.cells import Neighbours, find_neighbours
from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.kernels.sph.operators import (
    GRADIENT_CODES,
    INTERPOLATION_CODES,
    Sources,
    differentiate_particles,
    interpolate_points,
)

KernelName = Literal["wendland-c2", "cubic-spline", "quintic-spline"]
InterpolationForm = Literal["plain", "shepard", "linear"]
GradientForm = Literal["plain", "symmetric", "difference", "corrected"]

LARGEST = 1e30  # with numbers up to this, and down to its inverse, no product in a sum overflows or vanishes


def _numbers(numbers: ArrayLike, name: str, shape: tuple[int, ...]) -> Floats:
    """Return finite numbers as an array of that shape (-1: any length)."""
    array = np.ascontiguousarray(numbers, np.float64)
    if array.ndim != len(shape) or any(wanted not in {-1, size} for wanted, size in zip(shape, array.shape)):
        raise ValueError(f"{name}: shape {array.shape} where {shape} is needed (-1: any length)")
    if not (np.abs(array) <= LARGEST).all():
        raise ValueError(f"{name}: every number must be finite, at most {LARGEST:g} in magnitude")
    return array


def _row(numbers: ArrayLike, name: str, count: int) -> Floats:
    """Return one finite number a particle; a single number is repeated."""
    single = np.ndim(numbers) == 0
    return _numbers(np.full(count, numbers) if single else numbers, name, (count,))


def _positive(numbers: ArrayLike, name: str, count: int) -> Floats:
    array = _row(numbers, name, count)
    if not (array >= 1.0 / LARGEST).all():
        raise ValueError(f"{name}: every number must be above zero, at least {1.0 / LARGEST:g}")
    return array


def _code(name: str, codes: dict[str, int]) -> int:
    if name not in codes:
        raise ValueError(f"{name!r} is unknown; use {', '.join(codes)}")
    return codes[name]


class Particles:
    """Particles in the plane that carry mass; fields on them are arrays beside them.

    All share one smoothing length. The arrays are copied: particles that have moved are new `Particles`.
    """

    def __init__(
        self,
        positions: ArrayLike,
        mass: ArrayLike,
        density: ArrayLike,
        smoothing_length: float,
        kernel: KernelName = "wendland-c2",
    ) -> None:
        """Check and copy.

        positions: (n, 2), m. mass: (n,) or one number, kg per metre of thickness. density: (n,) or one number,
        kg/m^3. smoothing_length: h, m; the support of the smoothing function is 2 h, of the quintic spline 3 h, and
        1.2 to 2 particle spacings are usual. Raises ValueError for a wrong shape, no particles, nan or infinite
        numbers, a mass, density or smoothing length that is not positive, and for an unknown kernel.
        """
        places = _numbers(positions, "positions", (-1, 2)).copy()
        count = places.shape[0]
        if count == 0:
            raise ValueError("positions: at least one particle is needed")
        self.sources = Sources(
            positions=places,
            mass=_positive(mass, "mass", count).copy(),
            density=_positive(density, "density", count).copy(),
            function=_code(kernel, KERNEL_CODES),
            smoothing_length=float(_positive(smoothing_length, "smoothing_length", 1)[0]),
        )

    @property
    def support_radius(self) -> float:
        """Distance (m) from which on a particle has no influence."""
        return support_radius(self.sources.function, self.sources.smoothing_length)

    @cached_property
    def neighbours(self) -> Neighbours:
        """Neighbours of every particle within its support, itself among them."""
        return self.neighbours_of(self.sources.positions)

    def neighbours_of(self, points: Floats) -> Neighbours:
        """Return the particles within the support of each of the points (m, 2)."""
        return find_neighbours(self.sources.positions, points, self.support_radius)


def interpolate(
    particles: Particles, values: ArrayLike, points: ArrayLike, form: InterpolationForm = "plain"
) -> Floats:
    """Return a field at points (m, 2), in metres, as an array (m,), from its values at the particles (n,).

    "plain" is Eq 1, A(r) = sum_b m_b A_b/rho_b W(|r - r_b|, h). "shepard" divides it by the same sum for A = 1 and so
    reproduces constants (Shepard 1968). "linear" (moving least squares of first order; Liu & Liu 2003) reproduces
    linear fields too, at edges and among disordered particles; where the neighbours lie on a line it knows the slope
    along the line only. Outside the support of all particles the plain form is zero and the others are nan.

    With the densities as values the plain form is the summation density. A vector field is two calls. Raises
    ValueError for a wrong shape, nan or infinite numbers and an unknown form.
    """
    code = _code(form, INTERPOLATION_CODES)
    carried = _row(values, "values", particles.sources.positions.shape[0])
    places = _numbers(points, "points", (-1, 2))
    near = particles.neighbours_of(places)
    out = np.empty(places.shape[0])
    interpolate_points(code, particles.sources, carried, places, near.offsets, near.indices, out)
    return out


def gradient(particles: Particles, values: ArrayLike, form: GradientForm = "plain") -> Floats:
    """Return the gradient (per metre) of a field at the particles, (n, 2), from its values there (n,).

    "plain" is Eq 2, grad A = sum_b m_b A_b/rho_b grad_a W_ab: right for a full, even neighbourhood only. "symmetric"
    is rho_a sum_b m_b (A_a/rho_a^2 + A_b/rho_b^2) grad_a W_ab (Monaghan 1992): the forces -m_a/rho_a grad A then add up
    to zero, and their moments too. "difference" is sum_b m_b/rho_b (A_b - A_a) grad_a W_ab, zero for constants.
    "corrected" is the latter with the kernel-gradient correction (Randles & Libersky 1996; Bonet & Lok 1999), exact
    for linear fields with any neighbours that do not lie on a line; where they do, the gradient across it is zero, and
    for a particle alone all of it.

    Raises ValueError for a wrong shape, nan or infinite numbers and an unknown form.
    """
    code = _code(form, GRADIENT_CODES)
    count = particles.sources.positions.shape[0]
    near = particles.neighbours
    out = np.empty((count, 2))
    differentiate_particles(code, particles.sources, _row(values, "values", count), near.offsets, near.indices, out)
    return out
