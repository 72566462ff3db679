"""The pieces of profiles and walls, and how they join."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from hypothesis import given, strategies as st

from blocksim.scenario import PlacedSegment, Scenario, place_segments, scenario_from_mapping
from blocksim.scenario.placement import surface_heights
from tests.golden import Golden
from tests.scenario.conftest import data_of

Point = tuple[float, float]


def scenario(profile: Sequence[Point] | None = None, walls: Sequence[Mapping[str, object]] = ()) -> Scenario:
    ground = {} if profile is None else {"ground": {"profile": profile}}
    bodies = [{"block": "brick", "x": 0, "y": 500}]
    return scenario_from_mapping(data_of(bodies=bodies, walls=walls, **ground))


def ends(segment: PlacedSegment) -> tuple[Point, Point]:
    return (segment.x0, segment.y0), (segment.x1, segment.y1)


PROFILES = st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.5]), st.floats(-5, 5)), min_size=2, max_size=8)


@given(PROFILES)
def test_every_joint_is_a_valley_of_both_pieces_or_an_edge_of_one(steps: list[tuple[float, float]]) -> None:
    points: list[Point] = []
    x = 0.0
    for step, y in steps:
        x += step or (0.5 if len(points) > 1 and points[-2][0] == x else 0.0)  # one vertical piece at a time
        if not points or math.dist(points[-1], (x, y)) > 0.01:
            points.append((x, y))
    if len(points) < 2:
        return
    pieces = place_segments(scenario(points))
    for one, other in pairwise(pieces):
        assert ends(one)[1] == ends(other)[0]
        turn = math.remainder(
            math.atan2(other.y1 - other.y0, other.x1 - other.x0) - math.atan2(one.y1 - one.y0, one.x1 - one.x0),
            math.tau,
        )
        is_valley = turn > 0
        assert (one.extends_end, other.extends_start) == (is_valley, is_valley)
        assert (one.touches_end, other.touches_start) == (not is_valley, False)


def test_the_height_of_the_surface_is_zero_on_flat_ground_which_is_no_segment() -> None:
    made = scenario([(0, 1), (2, 2), (2, 3), (2, 4), (3, 2)])
    places = np.array([-9.0, 0.0, 1.0, 2.0, 2.5, 3.0, 99.0])
    assert surface_heights(made, places).tolist() == [1.0, 1.0, 1.5, 4.0, 3.0, 2.0, 2.0]
    assert place_segments(scenario()) == ()
    assert surface_heights(scenario(), np.array([3.0]))[0] == 0.0


Scene = tuple[list[Point] | None, list[Mapping[str, object]]]


def wall(*points: Point, **keys: str) -> list[Mapping[str, object]]:
    """Return walls from point to point."""
    return [{"from": start, "to": end, **keys} for start, end in pairwise(points)]


TENT: list[Point] = [(0, 0), (3, 1), (6, 0)]
RISER: list[Point] = [(0, 0), (3, 0), (3, 2)]
SCENES: dict[str, Scene] = {
    "a level profile": ([(0, 0.5), (1, 0.5), (7, 0.5)], []),
    "a slope of many points": ([(0.1 * i, 0.03 * i) for i in range(8)], []),
    "a free wall has two edges": (None, wall((1, 2), (3, 2), material="oak")),
    "a wall up from the ground": (None, wall((3, 0), (4, 5))),
    "a wall down to the ground": (None, wall((4, 5), (3, 0))),
    "a wall from below the ground": (None, wall((3, -0.5), (4, 5))),
    "a wall from less than a nanometre above the ground": (None, wall((3, 0.9e-9), (4, 5))),
    "a wall from more than a nanometre above the ground": (None, wall((3, 1.1e-9), (3, 5))),
    "a wall up from the tip of a profile": (TENT, wall((3, 1), (4, 5))),
    "a wall down to the tip of a profile": (TENT, wall((4, 5), (3, 1))),
    "a wall up from a riser": (RISER, wall((3, 1), (4, 5))),
    "a wall down to a riser": (RISER, wall((4, 5), (3, 1))),
    "a post on a shelf": (None, wall((0, 2), (4, 2)) + wall((3, 2), (3, 4))),
    "walls that follow each other join as a profile does": (None, wall((0, 2), (1, 1), (2, 1), (2, 0.5))),
    "two faces of one sheet have each edge once": (None, wall((0, 1), (0, 2), (0, 1))),
    "segments of the profile come before walls": (
        [(0, 0), (1, 1)],
        wall((5, 5), (6, 6), material="oak") + wall((7, 7), (8, 8)),
    ),
}


def told(piece: PlacedSegment) -> str:
    """Return where a piece begins and ends, and at which ends it extends or is touched."""
    flags = [name for name in ("extends_start", "extends_end", "touches_start", "touches_end") if getattr(piece, name)]
    material = f" of {piece.material}" if piece.material else ""
    return f"({piece.x0:.4g}, {piece.y0:.4g}) to ({piece.x1:.4g}, {piece.y1:.4g}){material}: {', '.join(flags)}"


def test_pieces_join_where_they_meet(golden: Golden) -> None:
    """Points within a straight line are left out; a wall continues where ground or another wall covers its end."""
    pieces = {name: place_segments(scenario(profile, walls)) for name, (profile, walls) in SCENES.items()}
    golden("\n".join("\n  ".join([name, *map(told, found)]) for name, found in pieces.items()))
