"""Hertz's normal force between spheres, force proportional to the overlap to the power 3/2.

K = 4/3 E* sqrt(R*), in N/m^1.5. H. Hertz, J. reine angew. Math. 92 (1881) 156-171; K. L. Johnson, Contact Mechanics
(1985), ch. 4. A corner of a block has no radius of its own, so R* is an input (`contact_radius`). The shear stiffness
8 G* sqrt(R* d) of R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268, is the slope of the normal force, 2 E* sqrt(R* d),
times 4 G*/E*: the same ratio as for the linear law. What happens to the shear spring while the overlap changes is
written in kernels/explicit/contact.py.
"""

import math

from blocksim.kernels.common.jit import kernel


@kernel
def elastic_force(stiffness: float, depth: float) -> float:
    """Return K d^(3/2), in N for K in N/m^1.5 and the overlap d in m."""
    return stiffness * depth * math.sqrt(depth)


@kernel
def tangent_stiffness(stiffness: float, depth: float) -> float:
    """Return the slope 3/2 K d^(1/2) (N/m)."""
    return 1.5 * stiffness * math.sqrt(depth)


@kernel
def dashpot_weight(begin: float, end: float, at: float) -> float:
    """Return the mean of the dashpot coefficient over [begin, end] over its value `at` a moment, times the length.

    Times in steps since the contact began. The coefficient goes with the root of the slope of the force, d^(1/4), and
    while a contact closes d grows in proportion to time: (end^(5/4) - begin^(5/4))/(5/4 at^(1/4)).
    """
    return 0.8 * (fourth_root(end) * end - fourth_root(begin) * begin) / fourth_root(at)


@kernel
def fourth_root(x: float) -> float:
    """Return x^(1/4) for x >= 0."""
    return math.sqrt(math.sqrt(x))


@kernel
def stored_energy(stiffness: float, depth: float) -> float:
    """Return 2/5 K d^(5/2) (J)."""
    return 0.4 * stiffness * depth * depth * math.sqrt(depth)
