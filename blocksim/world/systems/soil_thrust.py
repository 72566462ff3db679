"""Active thrust of soil on blocks that yield, and where it is known to be too small.

On a rough base the lowest rows of particles do not press: the thrust is that of a lower pile, the less the more rows
there are, and less with raw gradients than with corrected ones. On a smooth base neither lacks anything from 8 rows on.
Soil at rest presses as it should.
"""

import math
from collections.abc import Iterator

import numpy as np

from blocksim.scenario import GROUND, PlacedBody, Scenario, keys, place_bodies, polygons
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.soil_places import soil_tables
from blocksim.world.systems.blocks import placed_points
from blocksim.world.systems.soil_kinds import friction_with
from blocksim.world.systems.system import Floats

TOLERATED = 0.03  # of the thrust
LACK = {
    "raw": (2.2, 0.0),
    "corrected": (1.0, 0.035),
}  # calibrated with a smooth wall drawn back from 8 to 40 rows: a, b of the share a/rows - b


def weak_thrusts(scenario: Scenario) -> Iterator[str]:
    """Yield a warning for each soil beside blocks that may yield, whose thrust on them is known to be too small."""
    for soil in soil_tables(scenario):
        rows = polygons.count_across(soil.corners, soil.spacing)[1]
        share = lacking(soil.gradient, rows)
        if share > TOLERATED and is_base_rough(scenario, soil) and is_beside_a_block(scenario, soil):
            key = keys.format_key(("soils", soil.name, "spacing" if soil.gradient == "corrected" else "gradient"))
            cure = f"{fewest_rows()} rows" if soil.gradient == "corrected" else '"corrected"'
            yield (
                f"{key}: with {soil.gradient} gradients and {rows} rows of particles on a rough base the active thrust "
                f"on blocks is some {share:.0%} too small; {cure} would do"
            )


def lacking(gradient: str, rows: int) -> float:
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
        polygons.overlap(corners, placed_corners(body))
        for body in place_bodies(scenario)
        if body.driven or not body.fixed
        for corners in moved
    )


def placed_corners(body: PlacedBody) -> Floats:
    """Return the corners (m, (k, 2)) of a block where it is placed."""
    place = (np.array([value]) for value in (body.x, body.y, body.angle))
    return np.asarray(placed_points(np.array([body.corners]), *place)[0])
