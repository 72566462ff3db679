"""Linear spring: force proportional to the overlap (Eqs 8 and 9 of Huyen & Cuong 2020)."""

from blocksim.kernels.common.jit import kernel


@kernel
def elastic_force(stiffness: float, depth: float) -> float:
    """Return K d, in N for K in N/m and the overlap d in m."""
    return stiffness * depth


@kernel
def tangent_stiffness(stiffness: float, depth: float) -> float:
    """Return the slope K (N/m), the same at every overlap."""
    return stiffness


@kernel
def dashpot_weight(begin: float, end: float, at: float) -> float:
    """Return the mean of the dashpot coefficient over [begin, end] over its value `at` a moment, times the length.

    Times in steps since the contact began. The coefficient is constant.
    """
    return end - begin


@kernel
def stored_energy(stiffness: float, depth: float) -> float:
    """Return K d^2 / 2 (J)."""
    return 0.5 * stiffness * depth * depth
