"""The pieces of profiles and walls, and how they join."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import PlacedSegment, Scenario, place_segments, scenario_from_mapping
from blocksim.scenario.placement import ENDLESS, surface_heights
from tests.scenario.conftest import data_of

Point = tuple[float, float]


def scenario(profile: Sequence[Point] | None = None, walls: Sequence[Mapping[str, object]] = ()) -> Scenario:
    ground = {} if profile is None else {"ground": {"profile": profile}}
    bodies = [{"block": "brick", "x": 0, "y": 500}]
    return scenario_from_mapping(data_of(bodies=bodies, walls=walls, **ground))


def ends(segment: PlacedSegment) -> tuple[Point, Point]:
    return (segment.x0, segment.y0), (segment.x1, segment.y1)


def extends(segment: PlacedSegment) -> tuple[bool, bool]:
    return segment.extends_start, segment.extends_end


def touches(segment: PlacedSegment) -> tuple[bool, bool]:
    return segment.touches_start, segment.touches_end


def test_points_within_a_straight_line_are_left_out() -> None:
    level = [(0, 0.5), (1, 0.5), (7, 0.5)]
    slope = [(0.1 * i, 0.03 * i) for i in range(8)]
    assert [ends(piece) for piece in place_segments(scenario(level))] == [((-ENDLESS, 0.5), (7 + ENDLESS, 0.5))]
    assert [ends(piece)[0] for piece in place_segments(scenario(slope))] == [(-ENDLESS, 0), slope[0], slope[-1]]


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


def wall(start: Point, end: Point, **keys: str) -> dict[str, Any]:
    return {"from": start, "to": end, **keys}


def test_a_free_wall_has_two_edges() -> None:
    (piece,) = place_segments(scenario(walls=[wall((1, 2), (3, 2), material="oak")]))
    assert ends(piece) == ((1, 2), (3, 2))
    assert (piece.material, piece.length) == ("oak", 2.0)
    assert (extends(piece), touches(piece)) == ((False, False), (True, True))


@pytest.mark.parametrize(
    ("profile", "foot"),
    [
        (None, (3, 0)),
        (None, (3, -0.5)),
        (None, (3, 0.9e-9)),
        ([(0, 0), (3, 1), (6, 0)], (3, 1)),
        ([(0, 0), (3, 0), (3, 2)], (3, 1)),
    ],
)
def test_a_wall_continues_where_the_ground_covers_its_end(profile: list[Point] | None, foot: Point) -> None:
    up = place_segments(scenario(profile, [wall(foot, (4, 5))]))[-1]
    down = place_segments(scenario(profile, [wall((4, 5), foot)]))[-1]
    assert (extends(up), touches(up)) == ((True, False), (False, True))
    assert (extends(down), touches(down)) == ((False, True), (True, False))
    (above,) = place_segments(scenario(walls=[wall((3, 1.1e-9), (3, 5))]))
    assert extends(above) == (False, False)


def test_a_wall_continues_where_it_ends_on_another() -> None:
    shelf, post = place_segments(scenario(walls=[wall((0, 2), (4, 2)), wall((3, 2), (3, 4))]))
    assert (extends(shelf), touches(shelf)) == ((False, False), (True, True))
    assert (extends(post), touches(post)) == ((True, False), (False, True))


def test_walls_that_follow_each_other_join_as_a_profile_does() -> None:
    walls = [wall((0, 2), (1, 1)), wall((1, 1), (2, 1)), wall((2, 1), (2, 0.5))]
    slope, floor, drop = place_segments(scenario(walls=walls))
    assert [extends(piece) for piece in (slope, floor, drop)] == [(False, True), (True, False), (False, False)]
    assert [touches(piece) for piece in (slope, floor, drop)] == [(True, False), (False, True), (False, True)]


def test_two_faces_of_one_sheet_have_each_edge_once() -> None:
    here, back = place_segments(scenario(walls=[wall((0, 1), (0, 2)), wall((0, 2), (0, 1))]))
    assert extends(here) == extends(back) == (False, False)
    assert touches(here) == touches(back) == (False, True)


def test_segments_of_the_profile_come_before_walls() -> None:
    made = scenario([(0, 0), (1, 1)], [wall((5, 5), (6, 6), material="oak"), wall((7, 7), (8, 8))])
    assert [piece.material for piece in place_segments(made)] == [None, None, None, "oak", None]
