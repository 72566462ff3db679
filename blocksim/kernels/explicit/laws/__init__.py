"""Contact laws and their dispatch.

A law is one file with `elastic_force(stiffness, depth)`, `tangent_stiffness(stiffness, depth)`,
`stored_energy(stiffness, depth)` and `dashpot_weight(begin, end, at)`, one code here and one branch in each dispatcher
below. Dispatch on an integer code keeps numba's disk cache valid, which jitted functions passed as arguments do not.
"""

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.explicit.laws import hertz_mindlin, linear

LINEAR, HERTZ_MINDLIN = range(2)
LAW_CODES = {"linear": LINEAR, "hertz-mindlin": HERTZ_MINDLIN}


@kernel
def elastic_force(law: int, stiffness: float, depth: float) -> float:
    """Return the normal spring force (N) at an overlap (m)."""
    if law == HERTZ_MINDLIN:
        return hertz_mindlin.elastic_force(stiffness, depth)
    return linear.elastic_force(stiffness, depth)


@kernel
def tangent_stiffness(law: int, stiffness: float, depth: float) -> float:
    """Return the slope of the normal spring force (N/m) at an overlap (m)."""
    if law == HERTZ_MINDLIN:
        return hertz_mindlin.tangent_stiffness(stiffness, depth)
    return linear.tangent_stiffness(stiffness, depth)


@kernel
def stored_energy(law: int, stiffness: float, depth: float) -> float:
    """Return the energy (J) stored in the normal spring at an overlap (m)."""
    if law == HERTZ_MINDLIN:
        return hertz_mindlin.stored_energy(stiffness, depth)
    return linear.stored_energy(stiffness, depth)


@kernel
def dashpot_weight(law: int, begin: float, end: float, at: float) -> float:
    """Return the integral of a dashpot's coefficient from `begin` to `end` over its value `at` (all in steps)."""
    if law == HERTZ_MINDLIN:
        return hertz_mindlin.dashpot_weight(begin, end, at)
    return linear.dashpot_weight(begin, end, at)


@kernel
def has_constant_stiffness(law: int) -> bool:
    """Return True if the slope of the normal force is the same at every overlap."""
    return law == LINEAR
