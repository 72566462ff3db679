"""Which blocks nothing carries at the start, and how far they are from what could."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, overlap, placement
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.placement import PlacedBody

TOUCHING = 1e-3
"""Of the least width of all blocks: a wider gap is no joint; a block that falls through it lands at some cm/s."""
CARRIED = -1
WIDER = 4.0  # times the reach, from one search for the nearest neighbour to the next
MOST_NAMED = 5

Labels = NDArray[np.int64]


def unsupported(scenario: Scenario, placed: Sequence[PlacedBody], near: float) -> tuple[list[int], float]:
    """Return the numbers of free blocks that rest on nothing, directly or over others, and the least gap (m) below it.

    Blocks touch within a distance `near` (m). Those that move at the start are thrown, and need no support; what soil
    surrounds has it.
    """
    segments = placement.place_segments(scenario)
    pieces = [overlap.Outlines.along(segments)] if segments else []
    for soil in placement.soil_tables(scenario):
        low, high = np.array(geometry.box_of(soil.corners.tolist()))
        middle, half = 0.5 * (low + high)[:, None], 0.5 * (high - low)[:, None]
        pieces.append(overlap.Outlines.rectangles(*middle, *half, np.ones(1), np.zeros(1)))
    outlines = overlap.Outlines.of(placed)
    for piece in pieces:
        outlines = outlines.and_pieces(piece)
    labels = np.arange(outlines.x.size)
    labels[len(placed) :] = CARRIED
    labels[: len(placed)][[body.fixed or bool(body.vx or body.vy or body.spin) for body in placed]] = CARRIED
    is_level = scenario.ground.profile is None
    heights = outlines.bottom if is_level else np.full(labels.size, np.inf)
    labels[heights <= near] = CARRIED
    one, other, _ = overlap.pairs_within(outlines, near)
    labels = _spread(labels, one, other)
    loose = np.flatnonzero(labels != CARRIED)
    if not loose.size:
        return [], 0.0
    least, reach = float(heights[loose].min()), placement.smallest_width(placed)
    extent = float(max(np.ptp(outlines.x), np.ptp(outlines.y))) + float(outlines.half_extent(1.0, 1.0).max())
    while True:
        one, other, gaps = overlap.pairs_within(outlines, reach)
        least = min(least, float(gaps[labels[one] != labels[other]].min(initial=np.inf)))
        if least <= reach or reach > extent:
            return loose.tolist(), least
        reach *= WIDER


def _spread(labels: Labels, one: Labels, other: Labels) -> Labels:
    """Return one label for all that touch, directly or over others: the least number among them, or CARRIED."""
    roots = np.append(0, labels - CARRIED)  # the first is what carries
    while True:
        ends = roots[one + 1], roots[other + 1]
        low, high = np.minimum(*ends), np.maximum(*ends)
        if (low == high).all():
            return roots[1:] + CARRIED
        np.minimum.at(roots, high, low)
        while (roots[roots] != roots).any():
            roots = roots[roots]


def support_warning(scenario: Scenario, placed: Sequence[PlacedBody]) -> str:
    """Return a warning of blocks that fall at the start as they touch nothing below them; empty if there are none."""
    if not scenario.gravity or not placed:
        return ""
    loose, gap = unsupported(scenario, placed, TOUCHING * placement.smallest_width(placed))
    if not loose:
        return ""
    free, names = sum(not body.fixed for body in placed), [placed[number].name for number in loose[:MOST_NAMED]]
    more = f" and {len(loose) - MOST_NAMED} more" if len(loose) > MOST_NAMED else ""
    which = f"{len(loose)} of {free} free blocks: {', '.join(names)}{more}"
    size = f"{gap:.4g} m" if gap >= 1.0 else f"{1e3 * gap:.4g} mm"
    return f"nothing supports {which}; nearest gap {size}, through which they fall at the start"
