"""Impulses of two contact points, exactly."""

from blocksim.kernels.jit import kernel


@kernel
def solve_two(k_one: float, k_mixed: float, k_two: float, q_one: float, q_two: float) -> tuple[float, float]:
    """Return x >= 0 with K x + q >= 0 and x (K x + q) = 0, K symmetric and positive definite.

    Of the four cases (both positive, one of them, none) exactly one holds for such a K (K. G. Murty, Linear Algebra
    Appl. 5 (1972) 65-108), so the first that holds is the answer. All are computed and one is chosen: which one, no
    processor can guess, and a wrong guess costs more. A very large q leaves a point out.
    """
    both = 1.0 / (k_one * k_two - k_mixed * k_mixed)  # division is slow; so it does not wait for velocities
    one = (k_mixed * q_two - k_two * q_one) * both
    two = (k_mixed * q_one - k_one * q_two) * both
    one_alone = max(-q_one * (1.0 / k_one), 0.0)
    two_alone = max(-q_two * (1.0 / k_two), 0.0)
    are_both = (one >= 0.0) & (two >= 0.0)
    is_one = k_mixed * one_alone + q_two >= 0.0
    rest_one = one_alone if is_one else 0.0
    rest_two = 0.0 if is_one else two_alone
    return (one if are_both else rest_one), (two if are_both else rest_two)
