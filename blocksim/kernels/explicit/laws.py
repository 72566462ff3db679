"""Contact laws, by an integer code: force, its slope, stored energy and weight of the dashpot at an overlap d.

A code keeps numba's disk cache valid, which jitted functions passed as arguments do not.

LINEAR: a force proportional to the overlap (Eqs 8 and 9 of Huyen & Cuong 2020), stiffness K in N/m.

HERTZ_MINDLIN: Hertz's normal force between spheres, proportional to the overlap to the power 3/2, K = 4/3 E* sqrt(R*)
in N/m^1.5. H. Hertz, J. reine angew. Math. 92 (1881) 156-171; K. L. Johnson, Contact Mechanics (1985), ch. 4. A corner
of a block has no radius of its own, so R* is an input (`contact_radius`). The shear stiffness 8 G* sqrt(R* d) of R. D.
Mindlin, J. Appl. Mech. 16 (1949) 259-268, is the slope of the normal force, 2 E* sqrt(R* d), times 4 G*/E*: the same
ratio as for the linear law. What happens to the shear spring while the overlap changes is written in
kernels/explicit/contact.py.
"""

import math

from blocksim.kernels.common.jit import kernel

LINEAR, HERTZ_MINDLIN = range(2)
LAW_CODES = {"linear": LINEAR, "hertz-mindlin": HERTZ_MINDLIN}


@kernel
def elastic_force(law: int, stiffness: float, depth: float) -> float:
    """Return the normal spring force (N) at an overlap (m): K d, or K d^(3/2)."""
    if law == HERTZ_MINDLIN:
        return stiffness * depth * math.sqrt(depth)
    return stiffness * depth


@kernel
def tangent_stiffness(law: int, stiffness: float, depth: float) -> float:
    """Return the slope of the normal spring force (N/m) at an overlap (m): K, or 3/2 K d^(1/2)."""
    if law == HERTZ_MINDLIN:
        return 1.5 * stiffness * math.sqrt(depth)
    return stiffness


@kernel
def stored_energy(law: int, stiffness: float, depth: float) -> float:
    """Return the energy (J) stored in the normal spring at an overlap (m): K d^2 / 2, or 2/5 K d^(5/2)."""
    if law == HERTZ_MINDLIN:
        return 0.4 * stiffness * depth * depth * math.sqrt(depth)
    return 0.5 * stiffness * depth * depth


@kernel
def dashpot_weight(law: int, begin: float, end: float, at: float) -> float:
    """Return the mean of the dashpot coefficient over [begin, end] over its value `at` a moment, times the length.

    Times in steps since the contact began. The coefficient is constant, or goes with the root of the slope of the
    force, d^(1/4), and while a contact closes d grows in proportion to time: (end^(5/4) - begin^(5/4))/(5/4 at^(1/4)).
    """
    if law == HERTZ_MINDLIN:
        return 0.8 * (fourth_root(end) * end - fourth_root(begin) * begin) / fourth_root(at)
    return end - begin


@kernel
def fourth_root(x: float) -> float:
    """Return x^(1/4) for x >= 0."""
    return math.sqrt(math.sqrt(x))


@kernel
def has_constant_stiffness(law: int) -> bool:
    """Return True if the slope of the normal force is the same at every overlap."""
    return law == LINEAR
