"""The coefficient of Coulomb friction between rest and fast slip."""

import math

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.tolerances import FULLY_KINETIC


@kernel
def friction_coefficient(static: float, kinetic: float, transition_speed: float, speed: float) -> float:
    """Return mu(v) = mu_k + (mu_s - mu_k) exp(-|v|/v_s): static at rest, kinetic when sliding fast."""
    if static == kinetic or abs(speed) > FULLY_KINETIC * transition_speed:
        return kinetic
    return kinetic + (static - kinetic) * math.exp(-abs(speed) / transition_speed)
