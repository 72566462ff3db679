"""Contact laws, by the exponent n of the overlap d in the normal force K d^n (N); see blocksim/scenario/laws.py.

What happens to the shear spring while the overlap changes is written in kernels/explicit/friction.py.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.jit import kernel

LINEAR, HERTZ_MINDLIN = 1.0, 1.5


@kernel
def growth(exponent: float, depth: float) -> float:
    """Return d^(n-1) (m^(n-1)), which takes no power for two of the exponents."""
    if exponent == LINEAR:
        return 1.0
    return math.sqrt(depth) if exponent == HERTZ_MINDLIN else depth ** (exponent - 1.0)


class Spring(NamedTuple):
    """The normal spring of a contact at some overlap."""

    force: float  # N
    slope: float  # N/m, of the force
    growth: float  # m^(n-1), d^(n-1)


@kernel
def spring_at(exponent: float, stiffness: float, depth: float) -> Spring:
    """Return the normal spring at an overlap (m), with one power for all that follows from it."""
    grown = growth(exponent, depth)
    return Spring(stiffness * depth * grown, exponent * stiffness * grown, grown)


@kernel
def elastic_force(exponent: float, stiffness: float, depth: float) -> float:
    """Return the normal spring force (N) at an overlap (m): K d^n."""
    return spring_at(exponent, stiffness, depth).force


@kernel
def tangent_stiffness(exponent: float, stiffness: float, depth: float) -> float:
    """Return the slope of the normal spring force (N/m) at an overlap (m): n K d^(n-1)."""
    return spring_at(exponent, stiffness, depth).slope


@kernel
def stored_energy(exponent: float, stiffness: float, depth: float) -> float:
    """Return the energy (J) stored in the normal spring at an overlap (m): K d^(n+1)/(n+1)."""
    return energy_of(exponent, stiffness, depth, growth(exponent, depth))


@kernel
def energy_of(exponent: float, stiffness: float, depth: float, grown: float) -> float:
    """As stored_energy, given d^(n-1) (m^(n-1)) as well."""
    return stiffness * depth * depth * (grown / (exponent + 1.0))


@kernel
def dashpot_weight(exponent: float, begin: float, end: float, at: float) -> float:
    """Return the mean of the dashpot coefficient over [begin, end] over its value `at` a moment, times the length.

    Times in steps since the contact began. The coefficient goes with the root of the slope of the force, d^((n-1)/2),
    and while a contact closes d grows in proportion to time, so that its integral is t^((n+1)/2)/((n+1)/2).
    """
    first = begin * math.sqrt(growth(exponent, begin))
    last = end * math.sqrt(growth(exponent, end))
    return (last - first) / (0.5 * (exponent + 1.0) * math.sqrt(growth(exponent, at)))
