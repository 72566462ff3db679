"""The coefficient of Coulomb friction between rest and fast slip."""

import math

from blocksim.kernels.common.jit import kernel

# beyond this multiple of the transition speed the static share is below double precision
FULLY_KINETIC = 40.0


@kernel
def friction_coefficient(static: float, kinetic: float, transition_speed: float, speed: float) -> float:
    """Return mu(v) = mu_k + (mu_s - mu_k) exp(-|v|/v_s): static at rest, kinetic when sliding fast."""
    if static == kinetic or abs(speed) > FULLY_KINETIC * transition_speed:
        return kinetic
    return kinetic + (static - kinetic) * math.exp(-abs(speed) / transition_speed)
