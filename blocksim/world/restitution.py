"""Damping ratio that gives an asked coefficient of restitution when contacts cannot pull.

Linear spring and dashpot whose force is clipped at zero: the contact ends when the force, not the overlap, returns
to zero. Closed form of T. Schwager and T. Poeschel, "Coefficient of restitution and linear-dashpot model
revisited", Granular Matter 9 (2007) 465-469. The textbook formula without clipping gives 0.40 where 0.30 is asked.
"""

import functools
import math

# e = 0 would need infinite damping; this rebound counts as none (the promise is at most 1 % of the impact speed)
SMALLEST_RESTITUTION = 0.009
BISECTIONS = 200
NEARLY_CRITICAL = 1e-9


def restitution_of(damping_ratio: float) -> float:
    """Return the coefficient of restitution (-) of a clipped linear spring-dashpot contact, `damping_ratio` >= 0."""
    zeta = damping_ratio
    if abs(zeta - 1.0) < NEARLY_CRITICAL:
        return math.exp(-2.0)  # common limit of both branches
    root = math.sqrt(abs(1.0 - zeta * zeta))
    if zeta < 1.0:
        return math.exp(-zeta / root * (math.pi - math.atan2(2.0 * zeta * root, 1.0 - 2.0 * zeta * zeta)))
    return math.exp(-zeta / root * math.log((zeta + root) / (zeta - root)))


@functools.cache
def damping_ratio(restitution: float) -> float:
    """Return the damping ratio (-) for a coefficient of restitution in [0, 1]; the inverse of `restitution_of`.

    Raises ValueError outside [0, 1].
    """
    if not 0.0 <= restitution <= 1.0:
        message = f"a coefficient of restitution lies between 0 and 1, not {restitution}"
        raise ValueError(message)
    if restitution == 1.0:
        return 0.0
    target = max(restitution, SMALLEST_RESTITUTION)
    low, high = 0.0, 100.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if restitution_of(middle) > target else (low, middle)
    return 0.5 * (low + high)
