"""How fast the blocks of a scene may become: bounds that steps are chosen by, known before anything moves."""

import itertools
import math

import numpy as np

from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_pieces
from blocksim.world.bounds import Bounds
from blocksim.world.interactions import Interactions


def fastest_fall(scenario: Scenario, bounds: Bounds) -> float:
    """Return the speed (m/s) at which the highest corner would reach the lowest ground, from rest."""
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, bounds.top - lowest)
    return math.sqrt(2.0 * scenario.gravity * math.cos(scenario.ground.tilt) * height)


def impact_speed(scenario: Scenario, bounds: Bounds) -> float:
    """Return the bound (m/s) of the speed of any point of a block that does not slide downhill."""
    return math.hypot(bounds.speed, fastest_fall(scenario, bounds))


def greatest_speed(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the bound (m/s) of the speed of any point of a block."""
    tilt = abs(scenario.ground.tilt)
    pull = scenario.gravity * max(0.0, math.sin(tilt) - least_support_friction(bounds, table) * math.cos(tilt))
    return impact_speed(scenario, bounds) + pull * scenario.time.end


def least_support_friction(bounds: Bounds, table: Interactions) -> float:
    """Return the least kinetic friction of free blocks with the ground, its pieces and fixed blocks.

    On one another blocks do not slide farther than they are long.
    """
    free = {kind.contact_class for kind in bounds.kinds if kind.inverse_mass > 0.0}
    fixed = {kind.contact_class for kind in bounds.kinds if not kind.inverse_mass > 0.0}
    pairs = itertools.product({*fixed, *bounds.grounds}, free)
    return min((table[i][j].kinetic_friction for i, j in pairs), default=math.inf)


def support_speed(scenario: Scenario) -> float:
    """Return the greatest speed (m/s) of the support, zero where it does not move."""
    if scenario.motion is None:
        return 0.0
    pieces = motion_pieces(scenario)
    _, c1, c2, c3 = pieces.coefficients.T
    length = np.diff(pieces.times)
    with np.errstate(divide="ignore", invalid="ignore"):  # straight and parabolic pieces are fastest at an end
        middle = np.nan_to_num(-c2 / (3.0 * c3), posinf=0.0, neginf=0.0)
    rates = [np.abs(c1 + s * (2.0 * c2 + 3.0 * s * c3)) for s in (0.0 * length, np.clip(middle, 0.0, length), length)]
    return float(max(np.max(rate, initial=0.0) for rate in rates))
