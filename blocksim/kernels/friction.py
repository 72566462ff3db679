"""Coulomb friction with a static and a kinetic coefficient."""

import math

from blocksim.kernels.arrays import Record
from blocksim.kernels.jit import kernel

# beyond this multiple of the transition speed the static share is below double precision
FULLY_KINETIC = 40.0


@kernel
def friction_coefficient(static: float, kinetic: float, transition_speed: float, speed: float) -> float:
    """Return mu(v) = mu_k + (mu_s - mu_k) exp(-|v|/v_s): static at rest, kinetic when sliding fast."""
    if static == kinetic or abs(speed) > FULLY_KINETIC * transition_speed:
        return kinetic
    return kinetic + (static - kinetic) * math.exp(-abs(speed) / transition_speed)


@kernel
def coulomb_limit(values: Record, normal_force: float, speed: float, needed: float) -> float:
    """Return the largest shear force (N) at a slip speed (m/s), or any bound above `needed` (N) that is below it.

    Kinetic friction is the least there is; where it holds, the exponential need not be computed.
    """
    kinetic = values.kinetic_friction * normal_force
    if needed <= kinetic:
        return kinetic
    static = values.static_friction
    return normal_force * friction_coefficient(static, values.kinetic_friction, values.transition_speed, speed)
