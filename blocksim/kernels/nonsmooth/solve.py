"""Impulses of two contact points, exactly."""

from blocksim.kernels.jit import kernel
from blocksim.kernels.lanes import Lanes, greater, select


@kernel
def solve_two(k_one: Lanes, k_mixed: Lanes, k_two: Lanes, q_one: Lanes, q_two: Lanes) -> tuple[Lanes, Lanes]:
    """Return x >= 0 with K x + q >= 0 and x (K x + q) = 0, K symmetric and positive definite.

    Of the four cases (both positive, one of them, none) exactly one holds for such a K (K. G. Murty, Linear Algebra
    Appl. 5 (1972) 65-108), so the first that holds is the answer. All are computed and one is chosen: which one, no
    processor can guess, and a wrong guess costs more. A very large q leaves a point out. Numbers will do for lanes.
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
