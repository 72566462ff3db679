"""Stresses of soils at time zero."""

import math

import numpy as np

from blocksim.scenario import Scenario, polygons
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.soil_places import soil_tables
from blocksim.world.systems.soil_kinds import earth_pressure_at_rest
from blocksim.world.systems.system import Floats


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
        weight += density * gravity * polygons.height_above(other.corners, places)
    at_rest = earth_pressure_at_rest(scenario.materials[table.material])
    stress[0] = stress[2] = -at_rest * weight
    stress[1] = -weight
    return stress
