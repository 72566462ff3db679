"""Contact laws: the normal spring and Coulomb friction with a static and a kinetic coefficient.

Laws go by the exponent n of the overlap d in the normal force K d^n (N); see blocksim/scenario/laws.py.

`draw_spring` clips the shear spring of a contact, `clip_to_cone` spring and dashpot together, for contacts of bodies
(forces.py) and of particles of soil (soil/contact.py).
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.mechanics import friction_coefficient

LINEAR, HERTZ_MINDLIN = 1.0, 1.5


@kernel
def growth(exponent: float, depth: float) -> float:
    """Return d^(n-1) (m^(n-1)), which takes no power for two of the exponents."""
    if exponent == LINEAR:
        return 1.0
    return math.sqrt(depth) if exponent == HERTZ_MINDLIN else depth ** (exponent - 1.0)


class Spring(NamedTuple):
    """The normal spring of a contact at some overlap."""

    force: float  # N
    slope: float  # N/m, of the force
    growth: float  # m^(n-1), d^(n-1)


@kernel
def spring_at(exponent: float, stiffness: float, depth: float) -> Spring:
    """Return the normal spring at an overlap (m), with one power for all that follows from it."""
    grown = growth(exponent, depth)
    return Spring(stiffness * depth * grown, exponent * stiffness * grown, grown)


@kernel
def elastic_force(exponent: float, stiffness: float, depth: float) -> float:
    """Return the normal spring force (N) at an overlap (m): K d^n."""
    return spring_at(exponent, stiffness, depth).force


@kernel
def tangent_stiffness(exponent: float, stiffness: float, depth: float) -> float:
    """Return the slope of the normal spring force (N/m) at an overlap (m): n K d^(n-1)."""
    return spring_at(exponent, stiffness, depth).slope


@kernel
def stored_energy(exponent: float, stiffness: float, depth: float) -> float:
    """Return the energy (J) stored in the normal spring at an overlap (m): K d^(n+1)/(n+1)."""
    return energy_of(exponent, stiffness, depth, growth(exponent, depth))


@kernel
def energy_of(exponent: float, stiffness: float, depth: float, grown: float) -> float:
    """As stored_energy, given d^(n-1) (m^(n-1)) as well."""
    return stiffness * depth * depth * (grown / (exponent + 1.0))


@kernel
def dashpot_weight(exponent: float, begin: float, end: float, at: float) -> float:
    """Return the mean of the dashpot coefficient over [begin, end] over its value `at` a moment, times the length.

    Times in steps since the contact began. The coefficient goes with the root of the slope of the force, d^((n-1)/2),
    and while a contact closes d grows in proportion to time, so that its integral is t^((n+1)/2)/((n+1)/2).
    """
    first = begin * math.sqrt(growth(exponent, begin))
    last = end * math.sqrt(growth(exponent, end))
    return (last - first) / (0.5 * (exponent + 1.0) * math.sqrt(growth(exponent, at)))


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
