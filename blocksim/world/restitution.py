"""Damping ratio for a coefficient of restitution when contacts cannot pull.

Linear spring and dashpot whose force is clipped at zero: the contact ends when the force, not the overlap, returns
to zero. Closed form of T. Schwager and T. Poeschel, "Coefficient of restitution and linear-dashpot model
revisited", Granular Matter 9 (2007) 465-469. The textbook formula without clipping gives 0.40 where 0.30 is wanted.

Hertz's law with a dashpot 2 z sqrt(m k_t), k_t = 3/2 K x^(1/2) its slope, follows from the linear case exactly. With
m = K = 1 and p = dx/dt, p dp/dx = -x^(3/2) - 2 z (3/2)^(1/2) x^(1/4) p. With w = x^(5/4), dw = 5/4 x^(1/4) dx, this is
p dp/dw = -4/5 w - 2 z' (4/5)^(1/2) p, z' = z (6/5)^(1/2): the phase plane of a linear oscillator of damping ratio z'.
The force is zero where w = -2 z (3/2)^(1/2) p in both. So e(z) of Hertz is the linear e(z'), at any speed. (The map is
that of D. Antypov and J. A. Elliott, "On an analytical solution for the damped Hertzian spring", EPL 94 (2011) 50004,
for contacts that end at zero overlap.)
"""

import functools
import math

# e = 0 would need infinite damping; this rebound counts as none (the promise is at most 1 % of the impact speed)
SMALLEST_RESTITUTION = 0.009
HERTZ_SHARE = math.sqrt(5.0 / 6.0)  # damping ratio of Hertz over that of the linear law, for the same restitution
BISECTIONS = 200  # at most; neighbouring numbers are reached after some sixty
MOST_KNOWN = 10_000  # ratios that are kept: a sweep may have a restitution of its own in every case
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


@functools.lru_cache(MOST_KNOWN)
def damping_ratio(restitution: float, law: str = "linear") -> float:
    """Return the damping ratio (-) for a coefficient of restitution in [0, 1]; the inverse of `restitution_of`.

    For Hertz-Mindlin it refers to the slope of the force at each overlap. Raises ValueError outside [0, 1].
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
        if not low < middle < high:
            break
        low, high = (middle, high) if restitution_of(middle) > target else (low, middle)
    return 0.5 * (low + high) * (HERTZ_SHARE if law == "hertz-mindlin" else 1.0)
