"""Coulomb's cone in a sweep: which shear impulses it allows, and how those that slide are approached.

A sweep finds the normal impulse for the shear impulse that there is, and then the shear impulse for that. Where bodies
stick that is Gauss and Seidel's method, which always ends. Where they slide, shear is -f times the normal impulse, and
the next normal impulse changes by the coupling f A_nt/A_nn of it: up and down, slowly to an end where that is a little
less than one, and without one beyond, as with a tall block on its corner and friction of 1.4 and more. A share of
1/(1 + coupling) of the way to the next shear impulse is exactly that to where both stay. Constraints that couple so go
that way in passes that have not ended after LATE sweeps. Not before: with as much friction there may be several
solutions, and sweeps that go all the way find that in which bodies stick, if there is one.

Impulses of two contact points, exactly.
"""

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.friction import friction_coefficient
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.simd import Lane, Lanes, branch, four, greater, load, select, split
from blocksim.kernels.common.tolerances import STRONG
from blocksim.kernels.nonsmooth.arrays import Contacts
from blocksim.kernels.nonsmooth.packs import Link, material_of, normal_masses


@kernel
def shear_limit(material: Record, normal: float, needed: float, mass: float) -> float:
    """Return the largest shear impulse (N s), given the one that stops all slip and A (1/kg) along the tangent.

    Static friction holds what it can stop within the substep; else kinetic friction at the slip that it leaves.
    """
    static = material.static_friction
    kinetic = material.kinetic_friction
    if static == kinetic:
        return kinetic * normal
    if needed <= static * normal:
        return static * normal
    slip = (needed - kinetic * normal) * mass
    return normal * friction_coefficient(static, kinetic, material.transition_speed, slip)


@kernel
def shear_limits(contacts: Contacts, pack: Record, lane: Lane, normal: Lanes, needed: Lanes, mass: Lanes) -> Lanes:
    """Return the largest shear impulses (N s) of constraints; see shear_limit."""
    if pack.are_simple:
        return load(lane, pack.friction) * normal
    n_0, n_1, n_2, n_3 = split(normal)
    s_0, s_1, s_2, s_3 = split(needed)
    m_0, m_1, m_2, m_3 = split(mass)
    return four(
        lane,
        shear_limit(material_of(contacts, pack, 0), n_0, s_0, m_0),
        shear_limit(material_of(contacts, pack, 1), n_1, s_1, m_1),
        shear_limit(material_of(contacts, pack, 2), n_2, s_2, m_2),
        shear_limit(material_of(contacts, pack, 3), n_3, s_3, m_3),
    )


@kernel
def within(needed: Lanes, limit: Lanes) -> Lanes:
    """Return the shear impulses (N s) nearest to those needed that the limits allow."""
    shear = branch(needed > -limit, needed, -limit)
    return branch(shear < limit, shear, limit)


@kernel
def coupling(pack: Record, lane: Lane, link: Link) -> Lanes:
    """Return the change of a normal impulse over that which it brings by sliding friction, of the worse point (-)."""
    its, a, b = link
    coupled_a = a.inverse_inertia * its.shear_arm_a
    coupled_b = b.inverse_inertia * its.shear_arm_b
    by_one = coupled_a * its.arm_a + coupled_b * its.arm_b
    by_two = by_one - (coupled_a + coupled_b) * its.width
    one, _, two = normal_masses(link)
    return load(lane, pack.friction) * greater(abs(by_one) / one, abs(by_two) / two)


@rare_kernel
def approached(pack: Record, lane: Lane, link: Link, old: Lanes, needed: Lanes, limit: Lanes) -> Lanes:
    """Return shear impulses (N s) as `within` does, of bodies that slide a share of the way there from the old ones."""
    shear = within(needed, limit)
    factor = coupling(pack, lane, link)
    return select((factor > STRONG) & (abs(needed) > limit), old + (shear - old) / (1.0 + factor), shear)


@kernel
def solve_two(
    lane: Lane, k_one: Lanes, k_mixed: Lanes, k_two: Lanes, q_one: Lanes, q_two: Lanes
) -> tuple[Lanes, Lanes]:
    """Return x >= 0 with K x + q >= 0 and x (K x + q) = 0, K symmetric, positive definite: of one or four constraints.

    Of the four cases (both positive, one of them, none) exactly one holds for such a K (K. G. Murty, Linear Algebra
    Appl. 5 (1972) 65-108), so the first that holds is the answer. A very large q leaves a point out.

    Few blocks have single constraints, which are in the same case for many substeps: the processor predicts it, and
    what follows does not wait. Of four all cases are computed and one is chosen, with the same bits: a branch would be
    unpredictable, and a wrong prediction costs more.
    """
    both = 1.0 / (k_one * k_two - k_mixed * k_mixed)  # division is slow; so it does not wait for velocities
    one = (k_mixed * q_two - k_two * q_one) * both
    two = (k_mixed * q_one - k_one * q_two) * both
    if lane is not None:
        if one >= 0.0 and two >= 0.0:
            return one, two
        one_alone = max(-q_one * (1.0 / k_one), 0.0)
        if k_mixed * one_alone + q_two >= 0.0:
            return one_alone, 0.0
        return 0.0, max(-q_two * (1.0 / k_two), 0.0)
    one_alone = greater(-q_one * (1.0 / k_one), 0.0)
    two_alone = greater(-q_two * (1.0 / k_two), 0.0)
    are_both = (one >= 0.0) & (two >= 0.0)
    is_one = k_mixed * one_alone + q_two >= 0.0
    rest_one = select(is_one, one_alone, 0.0)
    rest_two = select(is_one, 0.0, two_alone)
    return select(are_both, one, rest_one), select(are_both, two, rest_two)
