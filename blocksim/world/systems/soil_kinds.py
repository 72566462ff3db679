"""What soils are as numbers: elasticity, yield surface, and how their particles touch bodies."""

import math

from blocksim.scenario import Material, Scenario, place_bodies, resolve_pair
from blocksim.scenario.models.contact import PairFriction
from blocksim.scenario.models.soil import SoilTable

SHEAR_RATIO = 0.8  # shear over normal stiffness of a contact
# The most that leaves a particle between two bodies, with twice the stiffness and dashpot, no more than critical. What
# strikes a body leaves with exp(-pi/2) = 0.21 of its speed: soil is no ball.
DAMPING_RATIO = math.sqrt(0.5)
RAMP = 0.1  # s, in which gravity grows
SETTLING = 5e-3  # damping meanwhile, in (E / (rho h^2))^(1/2)
# Stresses of a geostatic start are not quite in equilibrium: in corners between faces, along inclined ones
# (kernels/soil/rows.py), and below slopes. For the time that a wave takes for that many smoothing lengths that shock is
# damped, in wave speeds over smoothing length; later it would have made the soil flow.
SHOCK_TIME, SHOCK_DAMPING = 60.0, 0.1
SMOOTHING = 1.5  # smoothing length in spacings
USUAL_DEPTH = 1.0  # m, out of the plane, where there are no blocks


def lame_constants(material: Material) -> tuple[float, float]:
    """Return Lame's first parameter and the shear modulus (Pa)."""
    young, poisson = material.young_modulus, material.poisson_ratio
    return young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))


def wave_speed(material: Material) -> float:
    """Return the speed (m/s) of pressure waves."""
    lame, shear = lame_constants(material)
    return math.sqrt((lame + 2.0 * shear) / material.density)


def yield_surface(material: Material) -> tuple[float, float]:
    """Return a (-) and k (Pa) of the surface (J2)^(1/2) + a I1 = k.

    mohr-coulomb: a = sin(phi)/3 and k = c cos(phi), which fails as Mohr and Coulomb say where the flow has no dilation
    (kernels/soil/stress.py). plane-strain-associated: tan(phi)/(9 + 12 tan(phi)^2)^(1/2) and 3 c over the same root,
    which does so for an associated flow, and is weaker without dilation: sin(phi) becomes 3 a.
    """
    angle, cohesion = material.friction_angle or 0.0, material.cohesion or 0.0
    if material.yield_surface == "plane-strain-associated":
        root = math.sqrt(9.0 + 12.0 * math.tan(angle) ** 2)
        return math.tan(angle) / root, 3.0 * cohesion / root
    return math.sin(angle) / 3.0, cohesion * math.cos(angle)


def earth_pressure_at_rest(material: Material) -> float:
    """Return horizontal over vertical stress: of elasticity, or the least one within the yield surface."""
    poisson = material.poisson_ratio
    slope = math.sqrt(3.0) * yield_surface(material)[0]
    return max(poisson / (1.0 - poisson), (1.0 - slope) / (1.0 + 2.0 * slope))


def depth_of_scene(scenario: Scenario) -> float:
    """Return the extent (m) of all soil out of the plane: that of the deepest block."""
    return max((body.depth for body in place_bodies(scenario)), default=USUAL_DEPTH)


def settling_of(scenario: Scenario, table: SoilTable) -> tuple[float, float]:
    """Return the rate (1/s) of damping at the start, and the time (s) when it ends; none where nothing has weight."""
    if scenario.gravity == 0.0:
        return 0.0, 0.0
    material = scenario.materials[table.material]
    smoothing, speed = SMOOTHING * table.spacing, wave_speed(material)
    if table.start == "ramp":
        return SETTLING * math.sqrt(material.young_modulus / material.density) / smoothing, RAMP
    return SHOCK_DAMPING * speed / smoothing, SHOCK_TIME * smoothing / speed


def friction_with(scenario: Scenario, soil: str, partner: str, *, ground: bool) -> PairFriction:
    """Return the friction of a soil's material with another one; `ground` for the ground (GROUND) and walls.

    As [pairs] has it, else that of the soil itself, as on a rough face: [friction] is about blocks.
    """
    pair = resolve_pair(scenario, soil, partner, ground=ground)
    if pair.rules["friction"].startswith("pairs."):
        return pair.friction
    return PairFriction(static=math.tan(scenario.materials[soil].friction_angle or 0.0))
