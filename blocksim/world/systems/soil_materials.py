"""What soils are as numbers: elasticity, yield surface, and how their particles touch bodies.

Stresses of soils at time zero.

Active thrust of soil on blocks that yield, and where it is known to be too small.

On a rough base the lowest rows of particles do not press: the thrust is that of a lower pile, the less the more rows
there are, and less with raw gradients than with corrected ones. On a smooth base neither lacks anything from 8 rows on.
Soil at rest presses as it should.
"""

import math
from collections.abc import Iterator

import numpy as np

from blocksim.scenario import GROUND, Material, PlacedBody, Scenario, geometry, overrides, place_bodies, resolve_pair
from blocksim.scenario.models.contact import PairFriction
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.start import soil_tables
from blocksim.world.systems.blocks import placed_points
from blocksim.world.systems.system import Floats

SHEAR_RATIO = 0.8  # shear over normal stiffness of a contact
# The most that leaves a particle between two bodies, with twice the stiffness and dashpot, no more than critical. What
# strikes a body leaves with exp(-pi/2) = 0.21 of its speed: soil is no ball.
DAMPING_RATIO = math.sqrt(0.5)
RAMP = 0.1  # s, in which gravity grows
SETTLING = 5e-3  # damping meanwhile, in (E / (rho h^2))^(1/2)
# Stresses of a geostatic start are not quite in equilibrium: in corners between faces, along inclined ones
# (kernels/soil/stress.py), and below slopes. For the time that a wave takes for that many smoothing lengths that shock
# is damped, in wave speeds over smoothing length; later it would have made the soil flow.
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


def damping_at_start(scenario: Scenario, table: SoilTable) -> tuple[float, float]:
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


def geostatic_stress(scenario: Scenario, table: SoilTable, places: Floats) -> Floats:
    """Return xx, yy, zz and xy (Pa, tension positive, (4, n)) at places (m, (n, 2)) of a soil; zero with a ramp.

    The vertical stress is the weight of all soil straight above, the horizontal ones K0 times that.
    """
    stress = np.zeros((4, len(places)))
    if table.start == "ramp":
        return stress
    weight = np.zeros(len(places))
    gravity = scenario.gravity * math.cos(scenario.ground.tilt)
    for other in soil_tables(scenario):
        density = scenario.materials[other.material].density
        weight += density * gravity * geometry.height_above(other.corners, places)
    at_rest = earth_pressure_at_rest(scenario.materials[table.material])
    stress[0] = stress[2] = -at_rest * weight
    stress[1] = -weight
    return stress


TOLERATED = 0.03  # of the thrust
LACK = {
    "raw": (2.2, 0.0),
    "corrected": (1.0, 0.035),
}  # calibrated with a smooth wall drawn back from 8 to 40 rows: a, b of the share a/rows - b


def weak_thrusts(scenario: Scenario) -> Iterator[str]:
    """Yield a warning for each soil beside blocks that may yield, whose thrust on them is known to be too small."""
    for soil in soil_tables(scenario):
        rows = geometry.count_across(soil.corners, soil.spacing)[1]
        share = thrust_deficit(soil.gradient, rows)
        if share > TOLERATED and is_base_rough(scenario, soil) and is_beside_a_block(scenario, soil):
            key = overrides.format_key(("soils", soil.name, "spacing" if soil.gradient == "corrected" else "gradient"))
            cure = f"{fewest_rows()} rows" if soil.gradient == "corrected" else '"corrected"'
            yield (
                f"{key}: with {soil.gradient} gradients and {rows} rows of particles on a rough base the active thrust "
                f"on blocks is some {share:.0%} too small; {cure} would do"
            )


def thrust_deficit(gradient: str, rows: int) -> float:
    """Return which share of the active thrust soil on a rough base lacks with so many rows of particles."""
    per_row, less = LACK[gradient]
    return per_row / rows - less


def fewest_rows() -> int:
    """Return with how many rows of particles corrected gradients lack no more than is tolerated."""
    per_row, less = LACK["corrected"]
    return math.ceil(per_row / (less + TOLERATED))


def is_base_rough(scenario: Scenario, soil: SoilTable) -> bool:
    """Return True if the ground resists soil that slides on it."""
    return friction_with(scenario, soil.material, GROUND, ground=True).static > 0.0


def is_beside_a_block(scenario: Scenario, soil: SoilTable) -> bool:
    """Return True if a block that may move is less than a spacing to the left or right of a soil."""
    moved = [soil.corners + np.array([way, 0.0]) for way in (-soil.spacing, soil.spacing)]
    return any(
        geometry.overlap(corners, placed_corners(body))
        for body in place_bodies(scenario)
        if body.driven or not body.fixed
        for corners in moved
    )


def placed_corners(body: PlacedBody) -> Floats:
    """Return the corners (m, (k, 2)) of a block where it is placed."""
    place = (np.array([value]) for value in (body.x, body.y, body.angle))
    return np.asarray(placed_points(np.array([body.corners]), *place)[0])
