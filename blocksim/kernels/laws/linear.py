"""Linear spring: force proportional to the overlap (Eqs 8 and 9 of Huyen & Cuong 2020)."""

from blocksim.kernels.jit import kernel


@kernel
def elastic_force(stiffness: float, depth: float) -> float:
    """Return K d, in N for K in N/m and the overlap d in m."""
    return stiffness * depth


@kernel
def tangent_stiffness(stiffness: float, depth: float) -> float:
    """Return the slope K (N/m), the same at every overlap."""
    return stiffness


@kernel
def stored_energy(stiffness: float, depth: float) -> float:
    """Return K d^2 / 2 (J)."""
    return 0.5 * stiffness * depth * depth
