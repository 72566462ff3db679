"""Coulomb friction with a static and a kinetic coefficient.

`draw_spring` clips the shear spring of a contact, `clip_to_cone` spring and dashpot together, for contacts of bodies
(forces.py) and of particles of soil (soil/contact.py). Where stiffness stays or contacts last others draw it, as below.
"""

import math

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.friction import friction_coefficient
from blocksim.kernels.common.jit import kernel


@kernel
def coulomb_limit(values: Record, normal_force: float, speed: float, needed: float) -> float:
    """Return the largest shear force (N) at a slip speed (m/s), or any bound above `needed` (N) that is below it.

    Kinetic friction is the least there is; where it holds, the exponential need not be computed.
    """
    kinetic = values.kinetic_friction * normal_force
    if needed <= kinetic:
        return kinetic
    return limit_between(values, normal_force, speed)


@kernel
def limit_between(values: Record, normal_force: float, speed: float) -> float:
    """Return the largest shear force (N) at a slip speed (m/s), between those of rest and of fast slip."""
    static = values.static_friction
    return normal_force * friction_coefficient(static, values.kinetic_friction, values.transition_speed, speed)


@kernel
def draw_spring(
    values: Record,
    stiffness: float,
    old_stiffness: float,
    old: float,
    slip: float,
    drawn: float,
    normal_force: float,
    rate: float,
) -> tuple[float, float, bool, float]:
    """Stretch a shear spring from `old` (m) by the last drift; it slides where it alone exceeds the Coulomb limit.

    `slip` (m) is the relative displacement of the drift, of which the share `drawn` counts, `rate` (m/s) the slip rate
    at its end. Returns the spring (m), the Coulomb limit (N), whether it slides, and the energy (J) lost to friction:
    the work over the drift less what the spring has gained, exactly.

    Where the stiffness grows with the overlap (Hertz-Mindlin) the force is kept and the spring shortened; where it
    falls the spring is kept and the force falls with it (C. Thornton, J. Appl. Mech. 64 (1997) 160-164). Both lose
    energy and neither creates any: F^2/2 (1/k0 - 1/k1) and (k0 - k1) s (s + ds)/2.
    """
    kept = old * min(old_stiffness / stiffness, 1.0)
    spring = kept + slip * drawn
    needed = stiffness * abs(spring)
    limit = coulomb_limit(values, normal_force, rate, needed)
    slides = needed > limit
    if slides:
        spring = math.copysign(limit / stiffness, spring)
    force = stiffness * spring
    old_force = old_stiffness * old
    return spring, limit, slides, 0.5 * ((old_force + force) * slip - force * spring + old_force * old)


@kernel
def draw_same_spring(
    values: Record, stiffness: float, old: float, slip: float, normal_force: float, rate: float
) -> tuple[float, float, bool, float]:
    """As draw_spring, for a stiffness that does not change: a spring that sticks then loses nothing."""
    spring = old + slip
    needed = stiffness * abs(spring)
    kinetic = values.kinetic_friction * normal_force
    if needed <= kinetic:
        return spring, kinetic, False, 0.0
    limit = limit_between(values, normal_force, rate)
    if needed <= limit:
        return spring, limit, False, 0.0
    spring = math.copysign(limit / stiffness, spring)
    return spring, limit, True, 0.5 * stiffness * ((old + spring) * slip - (spring - old) * (spring + old))


@kernel
def draw_lasting_spring(
    values: Record,
    stiffness: float,
    old_stiffness: float,
    old: float,
    slip: float,
    drawn: float,
    normal_force: float,
    rate: float,
    lasts: bool,
) -> tuple[float, float, bool, float]:
    """As draw_spring, quick where the stiffness has not changed, or cannot have, as `lasts` says."""
    if lasts or (stiffness == old_stiffness and drawn == 1.0):
        return draw_same_spring(values, stiffness, old, slip, normal_force, rate)
    return draw_spring(values, stiffness, old_stiffness, old, slip, drawn, normal_force, rate)


@kernel
def clip_to_cone(values: Record, force: float, limit: float, normal_force: float, rate: float) -> float:
    """Return spring and dashpot force (N) together, within the Coulomb cone; `limit` (N) is what the spring had."""
    if abs(force) <= limit:
        return force
    bound = coulomb_limit(values, normal_force, rate, abs(force))
    return min(max(force, -bound), bound)
