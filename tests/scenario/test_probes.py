"""Joints between bodies as they are placed."""

import math
from collections.abc import Sequence

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import PlacedBody, place_bodies, scenario_from_mapping
from blocksim.scenario.events import Joint, joint_between
from tests.golden import Golden
from tests.scenario.conftest import data_of


def bodies(*places: tuple[float, float, float]) -> list[PlacedBody]:
    """Return bricks of 0.2 x 0.1 m at (x, y, angle in degrees)."""
    placed = [{"block": "brick", "x": x, "y": y, "angle": f"{angle} deg"} for x, y, angle in places]
    return [*place_bodies(scenario_from_mapping(data_of(structures=(), bodies=tuple(placed))))]


def told(joint: Joint | None) -> str:
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
    golden("\n".join(told(joint_between(*bodies(*pair))) for pair in pairs))


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
    lower, upper = place_bodies(scenario_from_mapping(drawn))
    joint = joint_between(lower, upper)
    assert joint is not None
    assert joint.normal == pytest.approx((0.0, 1.0))
    gaps = [upper.y + of_b[1] - lower.y - of_a[1] for of_a, of_b in zip(joint.ends_of_a, joint.ends_of_b, strict=True)]
    assert gaps == pytest.approx([0.0, corner - 0.1], abs=1e-12)


def test_more_probes_than_a_run_can_write_at_its_end_are_refused() -> None:
    probes = [{"kind": "energy", "name": f"e{number}"} for number in range(201)]
    assert len(scenario_from_mapping(data_of(probes=probes[:200])).probes) == 200
    with pytest.raises(ScenarioError, match="201 probes are too many; at most 200 are allowed"):
        scenario_from_mapping(data_of(probes=probes))
