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

Sums over neighbouring particles: interpolation (Eq 1) and gradients (Eq 2), plain, symmetric and corrected.

V_b = m_b/rho_b is the area of particle b, W_ab = W(|r_a - r_b|, h), and grad_a W_ab = W' (r_a - r_b)/|r_a - r_b|.
Neighbours are those of `find_neighbours` with the support radius; the particle itself may be among them. A pair counts
if dx^2 + dy^2 < radius^2 as computed; then |x_b - x| < radius, also exactly.

Order of the error of a smooth field in h at a fixed h/dx, as tests/kernels/sph/test_convergence.py measures it:

                                lattice, inside   disordered, inside   edges
    interpolation  plain        2, then stalls     0                    0
                   shepard      2 (at particles)   1                    1
                   linear       2                  2                    2
    gradient       plain        2, then stalls    -1                   -1
                   symmetric    2, then stalls    -1                   -1
                   difference   2, then stalls     0                    0
                   corrected    2                  1                    1

Inside, the error of order two is (h^2/4) M Laplacian A, M the integral of W q^2 (5/9 for Wendland C2), and the gradient
of that. It stalls at a share of the field (of its slope) that depends on h/dx only: for Wendland C2 1 % (2.6 %) at
h/dx = 1.3, and falling about as (h/dx)^-5 (-4).
"""

import math
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from blocksim.kernels.common import neighbours
from blocksim.kernels.common.arrays import Floats, Integers, Records, record_type
from blocksim.kernels.common.jit import entry_kernel, kernel, rare_kernel
from blocksim.kernels.common.tolerances import GRADIENT_RANK, LARGEST
from blocksim.kernels.sph import functions

PLAIN = 0
SHEPARD, LINEAR = 1, 2
SYMMETRIC, DIFFERENCE, CORRECTED = 1, 2, 3
INTERPOLATION_CODES = {"plain": PLAIN, "shepard": SHEPARD, "linear": LINEAR}
GRADIENT_CODES = {"plain": PLAIN, "symmetric": SYMMETRIC, "difference": DIFFERENCE, "corrected": CORRECTED}
PLACE = record_type("x y")  # m


class Neighbours(NamedTuple):
    """Neighbours by point: those of point i are indices[offsets[i]:offsets[i + 1]], cell by cell."""

    offsets: Integers  # (m + 1,)
    indices: Integers  # (offsets[m],)


@entry_kernel
def list_neighbours(
    places: Records,
    points: Floats,
    radius: float,
    starts: Integers,
    order: Integers,
    offsets: Integers,
    indices: Integers,
) -> None:
    """Write the neighbours of all points, as far as there is room, and the offsets that they need."""
    grid = neighbours.lay_cells(places, radius, places.size, False)
    neighbours.sort_into_cells(places, grid, starts, order)
    count = 0
    for i in range(points.shape[0]):
        offsets[i] = count
        x, y = points[i, 0], points[i, 1]
        first, last = neighbours.column_of(grid, x - radius), neighbours.column_of(grid, x + radius)
        for row in range(neighbours.row_of(grid, y - radius), neighbours.row_of(grid, y + radius) + 1):
            for k in range(starts[row * grid.columns + first], starts[row * grid.columns + last + 1]):
                dx = places[order[k]].x - x
                dy = places[order[k]].y - y
                if dx * dx + dy * dy < radius * radius:
                    if count < indices.size:
                        indices[count] = order[k]
                    count += 1
    offsets[points.shape[0]] = count


def find_neighbours(positions: Floats, points: Floats, radius: float) -> Neighbours:
    """Return, for each of the points (m, 2), the particles (n, 2) nearer than `radius`; all in metres and finite.

    A particle that is a point itself is listed as its own neighbour. Raises ValueError for a coordinate that is not
    finite, for no particles and for a radius that is not positive.
    """
    if not (np.isfinite(positions).all() and np.isfinite(points).all()):
        raise ValueError("positions and points must be finite")
    if positions.shape[0] == 0 or not 0.0 < radius < math.inf:
        raise ValueError("a neighbour search needs at least one particle and a radius above zero")
    n = positions.shape[0]
    places = np.ascontiguousarray(positions, np.float64).view(PLACE)[:, 0].view(np.recarray)
    starts, order, offsets = (np.empty(size, np.int64) for size in (3 * n + 3, n, points.shape[0] + 1))
    found = Neighbours(offsets, np.empty(0, np.int64))
    list_neighbours(places, points, radius, starts, order, *found)
    found = Neighbours(offsets, np.empty(offsets[-1], np.int64))
    list_neighbours(places, points, radius, starts, order, *found)
    return found


class Sources(NamedTuple):
    """The particles that a sum runs over."""

    positions: Floats  # m, (n, 2)
    mass: Floats  # kg per metre of thickness, (n,)
    density: Floats  # kg/m^3, (n,)
    function: int  # code of the smoothing function
    smoothing_length: float  # m


@kernel
def pseudo_inverse(a: float, b: float, d: float, least: float) -> tuple[float, float, float]:
    """Invert the positive semidefinite matrix [[a, b], [b, d]] over its eigenvalues above `least`; zero elsewhere."""
    middle = 0.5 * (a + d)
    half = 0.5 * (a - d)
    radius = math.sqrt(half * half + b * b)
    if middle + radius <= least:
        return 0.0, 0.0, 0.0
    if middle - radius > least:
        determinant = a * d - b * b
        return d / determinant, -b / determinant, a / determinant
    # one eigenvalue, middle + radius, is left; its projector is (I + (M - middle I)/radius)/2
    scale = 0.5 / (middle + radius)
    return scale * (1.0 + half / radius), scale * b / radius, scale * (1.0 - half / radius)


@kernel
def weight(sources: Sources, b: int, dx: float, dy: float) -> float:
    """Return V_b W for a point that particle b is (dx, dy) (m) away from."""
    r = math.sqrt(dx * dx + dy * dy)
    return sources.mass[b] / sources.density[b] * functions.kernel_value(sources.function, r, sources.smoothing_length)


@kernel
def radial_factor(sources: Sources, dx: float, dy: float) -> float:
    """Return W'/r (1/m^4), so that grad_a W_ab = W'/r (r_a - r_b); zero where particles coincide."""
    r = math.sqrt(dx * dx + dy * dy)
    return functions.kernel_slope(sources.function, r, sources.smoothing_length) / r if r > 0.0 else 0.0


@rare_kernel
def sum_at(sources: Sources, values: Floats, x: float, y: float, near: Integers) -> tuple[float, float, float, float]:
    """Return sum V W, sum V W A (Eq 1) and sum V W (r_b - r)."""
    weights, total, sum_x, sum_y = 0.0, 0.0, 0.0, 0.0
    for b in near:
        dx = sources.positions[b, 0] - x
        dy = sources.positions[b, 1] - y
        w = weight(sources, b, dx, dy)
        weights += w
        total += w * values[b]
        sum_x += w * dx
        sum_y += w * dy
    return weights, total, sum_x, sum_y


@rare_kernel
def fit_line(
    sources: Sources, values: Floats, x: float, y: float, near: Integers, mean_x: float, mean_y: float, mean: float
) -> tuple[float, float]:
    """Return the slopes (1/m) of the plane through the mean that fits the values best, with the weights V W.

    A direction in which the neighbours do not spread has no slope.
    """
    weights, xx, xy, yy, x_a, y_a = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for b in near:
        dx = sources.positions[b, 0] - x
        dy = sources.positions[b, 1] - y
        w = weight(sources, b, dx, dy)
        weights += w
        xx += w * (dx - mean_x) * (dx - mean_x)
        xy += w * (dx - mean_x) * (dy - mean_y)
        yy += w * (dy - mean_y) * (dy - mean_y)
        x_a += w * (dx - mean_x) * (values[b] - mean)
        y_a += w * (dy - mean_y) * (values[b] - mean)
    least = GRADIENT_RANK * weights * sources.smoothing_length * sources.smoothing_length
    inverse_xx, inverse_xy, inverse_yy = pseudo_inverse(xx, xy, yy, least)
    return inverse_xx * x_a + inverse_xy * y_a, inverse_xy * x_a + inverse_yy * y_a


@rare_kernel
def interpolate_at(form: int, sources: Sources, values: Floats, x: float, y: float, near: Integers) -> float:
    """Return a field (any unit) at one point from its values at the particles nearby.

    plain: sum V_b A_b W (Eq 1). shepard: the same over sum V_b W (Shepard 1968). linear: moving least squares, the
    value here of the plane that fits the values around best with the weights V_b W. Without any particle nearby
    the plain sum is zero and the others are nan.
    """
    weights, total, sum_x, sum_y = sum_at(sources, values, x, y, near)
    if form == PLAIN:
        return total
    if weights <= 0.0:
        return math.nan
    mean = total / weights
    if form == SHEPARD:
        return mean
    mean_x = sum_x / weights
    mean_y = sum_y / weights
    slope_x, slope_y = fit_line(sources, values, x, y, near, mean_x, mean_y, mean)
    return mean - slope_x * mean_x - slope_y * mean_y


@entry_kernel
def interpolate_points(
    form: int, sources: Sources, values: Floats, points: Floats, offsets: Integers, indices: Integers, out: Floats
) -> None:
    """Write the field at all points (m, 2) into `out` (m,)."""
    for i in range(points.shape[0]):
        near = indices[offsets[i] : offsets[i + 1]]
        out[i] = interpolate_at(form, sources, values, points[i, 0], points[i, 1], near)


@kernel
def pair_factor(form: int, sources: Sources, values: Floats, a: int, b: int) -> float:
    """Return what grad_a W_ab is multiplied with: V_b A_b, V_b (A_b - A_a) or the symmetric form of them."""
    density = sources.density[b]
    if form == PLAIN:
        return sources.mass[b] / density * values[b]
    if form == SYMMETRIC:
        own = sources.density[a]
        return own * sources.mass[b] * (values[a] / (own * own) + values[b] / (density * density))
    return sources.mass[b] / density * (values[b] - values[a])


@rare_kernel
def gradient_at(form: int, sources: Sources, values: Floats, a: int, near: Integers) -> tuple[float, float]:
    """Return the gradient (1/m) at particle a.

    plain: sum V_b A_b grad W (Eq 2). symmetric: rho_a sum m_b (A_a/rho_a^2 + A_b/rho_b^2) grad W (Monaghan 1992);
    times -m_a/rho_a it is a force with opposite partners. difference: sum V_b (A_b - A_a) grad W, zero for constants.
    corrected: the latter times the inverse of B = sum V_b grad W (r_b - r_a)^T (Randles & Libersky 1996; Bonet & Lok
    1999), exact for linear fields. B is symmetric and positive semidefinite; where all neighbours lie on a line the
    gradient across it is zero, and without neighbours the whole of it.
    """
    sum_x, sum_y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for b in near:
        dx = sources.positions[b, 0] - sources.positions[a, 0]
        dy = sources.positions[b, 1] - sources.positions[a, 1]
        radial = -radial_factor(sources, dx, dy)
        factor = radial * pair_factor(form, sources, values, a, b)
        sum_x += factor * dx
        sum_y += factor * dy
        spread = radial * sources.mass[b] / sources.density[b]
        xx += spread * dx * dx
        xy += spread * dx * dy
        yy += spread * dy * dy
    if form != CORRECTED:
        return sum_x, sum_y
    inverse_xx, inverse_xy, inverse_yy = pseudo_inverse(xx, xy, yy, GRADIENT_RANK * (xx + yy))
    return inverse_xx * sum_x + inverse_xy * sum_y, inverse_xy * sum_x + inverse_yy * sum_y


@entry_kernel
def differentiate_particles(
    form: int, sources: Sources, values: Floats, offsets: Integers, indices: Integers, out: Floats
) -> None:
    """Write the gradient at all particles into `out` (n, 2)."""
    for a in range(sources.positions.shape[0]):
        out[a, 0], out[a, 1] = gradient_at(form, sources, values, a, indices[offsets[a] : offsets[a + 1]])


KernelName = Literal["wendland-c2", "cubic-spline", "quintic-spline"]
InterpolationForm = Literal["plain", "shepard", "linear"]
GradientForm = Literal["plain", "symmetric", "difference", "corrected"]


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
            function=_code(kernel, functions.KERNEL_CODES),
            smoothing_length=float(_positive(smoothing_length, "smoothing_length", 1)[0]),
        )

    @property
    def support_radius(self) -> float:
        """Distance (m) from which on a particle has no influence."""
        return functions.support_radius(self.sources.function, self.sources.smoothing_length)

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
