"""Active thrust of soil on blocks that yield, and where it is known to be too small.

On a rough base the lowest rows of particles do not press: the thrust is that of a lower pile. A smooth wall drawn back
from 100 mm of soil with 21.9 degrees by 2 % of its height, half way (no acceleration then), measures so much less than
Rankine's pressure on the height that is left, in %:

| rows of particles | 8 | 10 | 12 | 16 | 20 | 30 | 40 |
| --- | --- | --- | --- | --- | --- | --- | --- |
| raw gradients | 25.6 | 20.9 | 17.9 | 14.4 | 12.1 | 8.4 | 5.8 |
| corrected ones | 8.8 | 6.0 | 4.5 | 2.5 | 1.4 | 0.1 | -0.4 |

With 30 and 35 degrees it is up to half as much again with 10 rows, and as much with 20. Where the friction of the base
is 0.1 raw gradients lack 3.3 % with 20 rows; on a smooth base neither lacks anything from 8 rows on. Soil at
rest presses as it should.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedBody, Scenario, keys, place_bodies, polygons
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.soil_places import soil_tables
from blocksim.world.systems.soil_kinds import friction_with

TOLERATED = 0.03  # of the thrust
LACK = {"raw": (2.2, 0.0), "corrected": (1.0, 0.035)}  # calibrated to the table: a, b of the share a/rows - b


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
    from blocksim.world.interactions import contact_classes  # noqa: PLC0415 - as in soil_kinds.py

    ground, *_ = contact_classes(scenario, ())
    return friction_with(scenario, soil.material, ground).static > 0.0


def is_beside_a_block(scenario: Scenario, soil: SoilTable) -> bool:
    """Return True if a block that may move is less than a spacing to the left or right of a soil."""
    moved = [soil.corners + np.array([way, 0.0]) for way in (-soil.spacing, soil.spacing)]
    return any(
        polygons.overlap(corners, corners_in_place(body))
        for body in place_bodies(scenario)
        if body.driven or not body.fixed
        for corners in moved
    )


def corners_in_place(body: PlacedBody) -> NDArray[np.float64]:
    """Return the corners (m, (k, 2)) of a block where it is placed."""
    x, y = np.array(body.corners).T
    cosine, sine = math.cos(body.angle), math.sin(body.angle)
    return np.stack([body.x + cosine * x - sine * y, body.y + sine * x + cosine * y], axis=1)
