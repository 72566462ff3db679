"""Impulses of two contact points, exactly."""

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import Lane, Lanes, greater, select


@kernel
def solve_two(
    lane: Lane, k_one: Lanes, k_mixed: Lanes, k_two: Lanes, q_one: Lanes, q_two: Lanes
) -> tuple[Lanes, Lanes]:
    """Return x >= 0 with K x + q >= 0 and x (K x + q) = 0, K symmetric, positive definite: of one or four constraints.

    Of the four cases (both positive, one of them, none) exactly one holds for such a K (K. G. Murty, Linear Algebra
    Appl. 5 (1972) 65-108), so the first that holds is the answer. A very large q leaves a point out.
    """
    if lane is None:
        return solve_four(k_one, k_mixed, k_two, q_one, q_two)
    return solve_single(k_one, k_mixed, k_two, q_one, q_two)


@kernel
def solve_single(k_one: float, k_mixed: float, k_two: float, q_one: float, q_two: float) -> tuple[float, float]:
    """Return the same for a single constraint, bit by bit.

    Few blocks have single constraints, which are in the same case for many substeps: the processor predicts it, and
    what follows does not wait.
    """
    both = 1.0 / (k_one * k_two - k_mixed * k_mixed)
    one = (k_mixed * q_two - k_two * q_one) * both
    two = (k_mixed * q_one - k_one * q_two) * both
    if one >= 0.0 and two >= 0.0:
        return one, two
    one_alone = max(-q_one * (1.0 / k_one), 0.0)
    if k_mixed * one_alone + q_two >= 0.0:
        return one_alone, 0.0
    return 0.0, max(-q_two * (1.0 / k_two), 0.0)


@kernel
def solve_four(k_one: Lanes, k_mixed: Lanes, k_two: Lanes, q_one: Lanes, q_two: Lanes) -> tuple[Lanes, Lanes]:
    """Return the same for four constraints; numbers will do for lanes.

    All cases are computed and one is chosen: a branch would be unpredictable, and a wrong prediction costs more.
    """
    both = 1.0 / (k_one * k_two - k_mixed * k_mixed)  # division is slow; so it does not wait for velocities
    one = (k_mixed * q_two - k_two * q_one) * both
    two = (k_mixed * q_one - k_one * q_two) * both
    one_alone = greater(-q_one * (1.0 / k_one), 0.0)
    two_alone = greater(-q_two * (1.0 / k_two), 0.0)
    are_both = (one >= 0.0) & (two >= 0.0)
    is_one = k_mixed * one_alone + q_two >= 0.0
    rest_one = select(is_one, one_alone, 0.0)
    rest_two = select(is_one, 0.0, two_alone)
    return select(are_both, one, rest_one), select(are_both, two, rest_two)
