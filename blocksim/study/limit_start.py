"""Where a search begins its runs at rest although the scenario does not say so: under sustained loads.

Gravity that comes at once is an impact: contacts that slip or open under it shift limits of arches and walls by 0.2 to
4 %. What is searched along a load that is there from the beginning on is the limit of a structure that carries it, so
it comes to rest before time zero (`start.settle`), unless the scenario says whether it does.
"""

from collections.abc import Mapping

import numpy as np

from blocksim.scenario import Document, Scenario, place_bodies, place_segments
from blocksim.scenario.models.loads import Gravity
from blocksim.scenario.overlap import Outlines, penetration
from blocksim.scenario.placement import smallest_width

NEAR = 0.01  # of the smallest side of a block: what is farther from all others is to drop
SETTLE = "start.settle"


def at_rest(document: Document, *scenarios: Scenario) -> Document:
    """Return a document whose runs begin at rest, if all these scenarios of it bear sustained loads."""
    if says_whether_it_settles(document) or not all(map(is_sustained, scenarios)):
        return document
    return document.with_values({SETTLE: True})


def says_whether_it_settles(document: Document) -> bool:
    """Return True for a document that has `start.settle`."""
    start = document.data.get("start")
    return isinstance(start, Mapping) and "settle" in start


def comes_at_once(scenario: Scenario) -> bool:
    """Return True for a scenario with sustained loads that does not begin at rest."""
    return not scenario.start.settle and is_sustained(scenario)


def is_sustained(scenario: Scenario) -> bool:
    """Return True where loads are the same from time zero on, nothing moves then, and no block is to drop."""
    if scenario.motion is not None or scenario.events or scenario.systems:
        return False
    placed = place_bodies(scenario)
    if any(body.driven or body.vx or body.vy or body.spin for body in placed):
        return False
    return all(_is_constant(scenario, load) for load in scenario.loads) and not _drops(scenario)


def _is_constant(scenario: Scenario, load: object) -> bool:
    stretches = (
        load.stretches_from(scenario.ground.tilt) if isinstance(load, Gravity) else load.stretches()  # type: ignore[attr-defined]
    )
    return all(stretch.rate == 0.0 and stretch.value == stretches[0].value for stretch in stretches)


def _drops(scenario: Scenario) -> bool:
    """Return True where some free block has no other, no wall and not the ground near it."""
    placed, segments = place_bodies(scenario), place_segments(scenario)
    outlines = Outlines.of(placed)
    if segments:
        outlines = outlines.and_pieces(Outlines.along(segments))
    near = NEAR * smallest_width(placed)
    free = [number for number, body in enumerate(placed) if not body.fixed]
    for number in free:
        others = np.delete(np.arange(outlines.kinds.size), number)
        depth = penetration(outlines.some(np.full(others.size, number)), outlines.some(others))
        if not (depth > -near).any() and outlines.bottom[number] > near:
            return True
    return False
