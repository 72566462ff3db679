"""The pieces of profiles and walls, how they join, and joints between bodies as they are placed."""

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Model, PlacedBody, PlacedSegment, Scenario, place_segments, scenario_from_mapping
from blocksim.scenario.events import Joint, joint_between
from blocksim.scenario.placement import surface_heights
from tests.golden import Golden
from tests.scenario.conftest import data_of

Point = tuple[float, float]


def scenario(profile: Sequence[Point] | None = None, walls: Sequence[Mapping[str, object]] = ()) -> Scenario:
    ground = {} if profile is None else {"ground": {"profile": profile}}
    bodies = [{"block": "brick", "x": 0, "y": 500}]
    return scenario_from_mapping(data_of(bodies=bodies, walls=walls, **ground))


def test_the_height_of_the_surface_is_zero_on_flat_ground_which_is_no_segment() -> None:
    made = scenario([(0, 1), (2, 2), (2, 3), (2, 4), (3, 2)])
    places = np.array([-9.0, 0.0, 1.0, 2.0, 2.5, 3.0, 99.0])
    assert surface_heights(made, places).tolist() == [1.0, 1.0, 1.5, 4.0, 3.0, 2.0, 2.0]
    assert place_segments(scenario()) == ()
    assert surface_heights(scenario(), np.array([3.0]))[0] == 0.0


SCENES: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("segments.toml").read_text())


def told(piece: PlacedSegment) -> str:
    """Return where a piece begins and ends, and at which ends it extends or is touched."""
    flags = [name for name in ("extends_start", "extends_end", "touches_start", "touches_end") if getattr(piece, name)]
    material = f" of {piece.material}" if piece.material else ""
    return f"({piece.x0:.4g}, {piece.y0:.4g}) to ({piece.x1:.4g}, {piece.y1:.4g}){material}: {', '.join(flags)}"


def test_pieces_join_where_they_meet(golden: Golden) -> None:
    """Points within a straight line are left out; a wall continues where ground or another wall covers its end."""
    pieces = {name: place_segments(scenario(**tables)) for name, tables in SCENES.items()}
    golden("\n".join("\n  ".join([name, *map(told, found)]) for name, found in pieces.items()))


def bodies(*places: tuple[float, float, float]) -> list[PlacedBody]:
    """Return bricks of 0.2 x 0.1 m at (x, y, angle in degrees)."""
    placed = [{"block": "brick", "x": x, "y": y, "angle": f"{angle} deg"} for x, y, angle in places]
    return [*Model(scenario_from_mapping(data_of(structures=(), bodies=tuple(placed)))).bodies]


def described(joint: Joint | None) -> str:
    """Return what a joint is: its directions and its ends, in the frames of either body (mm)."""
    if joint is None:
        return "no joint"

    def rounded(vector: Sequence[float], unit: float = 1.0) -> str:
        return ", ".join(f"{round(unit * x, 6) + 0.0:g}" for x in vector)

    first, second = (" to ".join(rounded(end, 1e3) for end in ends) for ends in (joint.ends_of_a, joint.ends_of_b))
    directions = f"normal {rounded(joint.normal)}, tangent {rounded(joint.tangent)}"
    return f"{directions}; of the first {first}; of the second {second}"


def test_joints_span_what_faces_share(golden: Golden) -> None:
    """Of shifted stacks that are turned, across a gap and a quarter turn, and of bodies that face no other."""
    pairs = []
    for turn in (0.0, 30.0, 137.0):
        cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        above = (1.0 + 0.05 * cosine - 0.1 * sine, 1.0 + 0.05 * sine + 0.1 * cosine, turn)
        pairs.append(((1.0, 1.0, turn), above))
    pairs += [((0.0, 1.0, 0.0), other) for other in ((0.17, 1.02, 90.0), (0.3, 1.2, 0.0), (0.0, 1.11, 1.5))]
    golden("\n".join(described(joint_between(*bodies(*pair))) for pair in pairs))


@pytest.mark.parametrize("corner", [0.1, 0.1007, 0.1017])
def test_a_joint_of_a_drawing_may_have_the_rounding_of_its_corners(corner: float) -> None:
    """The lower face of the upper block rises by 0, 0.4 and 1.0 degrees along 0.1 m."""
    blocks = {"brick": {"depth": 0.1, "material": "oak"}}
    cells = [
        {"outline": [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]]},
        {"outline": [[0.0, 0.1], [0.1, corner], [0.1, 0.2], [0.0, 0.2]]},
    ]
    structure = {"kind": "polygons", "block": "brick", "in_place": True, "cells": cells}
    drawn = data_of(blocks=blocks, structures=(structure,), bodies=())
    lower, upper = Model(scenario_from_mapping(drawn)).bodies
    joint = joint_between(lower, upper)
    assert joint is not None
    assert joint.normal == pytest.approx((0.0, 1.0))
    gaps = [upper.y + of_b[1] - lower.y - of_a[1] for of_a, of_b in zip(joint.ends_of_a, joint.ends_of_b, strict=True)]
    assert gaps == pytest.approx([0.0, corner - 0.1], abs=1e-12)
