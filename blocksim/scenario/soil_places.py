"""What the outlines of soils must not meet, and choices of a scenario that soil does not go with."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import polygons
from blocksim.scenario.findings import Finding
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.placement import place_bodies
from blocksim.scenario.quantities import shown
from blocksim.scenario.segments import TOLERANCE, place_segments, surface_heights

UNIT_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
MOST_MEETINGS = 20
PLACES_ON_A_WALL = 33


def soil_tables(scenario: Scenario) -> list[SoilTable]:
    """Return the soils of a scenario."""
    return [table for table in scenario.systems.get("soils", ()) if isinstance(table, SoilTable)]


def meetings(soil: SoilTable, key: str, scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yield the key of an outline and what it meets: ground, walls, blocks, soils before it."""
    found = [*_boundaries(soil, scenario), *_blocks(soil.corners, scenario)]
    for other in soil_tables(scenario):
        if other is soil:
            break
        if other.name == soil.name:
            found.append("another soil of this name")
        elif polygons.overlap(soil.corners, other.corners):
            found.append(f"soil {other.name}")
    for what in found[:MOST_MEETINGS]:
        yield key, f"soil {soil.name} meets {what}"


def _boundaries(soil: SoilTable, scenario: Scenario) -> Iterator[str]:
    corners = soil.corners
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    for x, y in np.concatenate([corners, middles]):
        if y < float(surface_heights(scenario, np.array([x]))[0]) - TOLERANCE:
            yield f"the ground at x = {x:.6g} m"
            return
    segments = place_segments(scenario)
    places = np.linspace(0.0, 1.0, PLACES_ON_A_WALL)[1:-1, None]
    for number, piece in enumerate(segments, start=1 - (len(segments) - len(scenario.walls))):
        begin, end = np.array([piece.x0, piece.y0]), np.array([piece.x1, piece.y1])
        back = np.array([piece.y1 - piece.y0, piece.x0 - piece.x1]) / piece.length
        if polygons.cuts(begin, end, corners):
            yield f"wall {number}" if number > 0 else f"the ground near x = {piece.x1:.6g} m"
        elif number > 0 and polygons.inside(begin + places * (end - begin) + 0.5 * soil.spacing * back, corners).any():
            # nothing would hold soil that lies against the back of a wall
            yield f"the solid side of wall {number}, right of the way from its `from` to its `to`: exchange the two"


def _blocks(corners: NDArray[np.float64], scenario: Scenario) -> Iterator[str]:
    low, high = corners.min(axis=0), corners.max(axis=0)
    for body in place_bodies(scenario):
        reach = 0.5 * float(np.hypot(body.size_x, body.size_y))
        if low[0] - reach < body.x < high[0] + reach and low[1] - reach < body.y < high[1] + reach:
            u, v = (UNIT_CORNERS * (body.size_x, body.size_y)).T
            cosine, sine = np.cos(body.angle), np.sin(body.angle)
            rectangle = np.stack([body.x + cosine * u - sine * v, body.y + sine * u + cosine * v], axis=1)
            if polygons.overlap(corners, rectangle):
                yield f"block {body.name}"


def unfit_soils(scenario: Scenario) -> Iterator[Finding]:
    """Find blocks of soil, and a contact model that soil does not go with."""
    for name, block in scenario.blocks.items():
        material = scenario.materials.get(block.material)
        if material is not None and material.is_soil:
            message = f"{shown(block.material)} is soil, as it has a friction_angle; blocks are of other materials"
            yield Finding(("blocks", name, "material"), message, relation=True)
    if scenario.systems.get("soils") and scenario.contact.model != "surface":
        message = f'{shown(scenario.contact.model)} does not go with soil; use model = "surface"'
        yield Finding(("contact", "model"), message, relation=True)
