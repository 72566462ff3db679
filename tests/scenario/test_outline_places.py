"""Where blocks with an outline may be at the start, and where loads and joints find their faces."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.models.loads import Face
from blocksim.scenario.overrides import freeze
from blocksim.scenario.start import face_of, impossible_starts, strip_before
from tests.scenario.conftest import data_of

OAK = {"depth": 0.1, "material": "oak"}
BLOCKS = {
    "wedge": {"outline": [[0, 0], [0.3, 0], [0, 0.3]], **OAK},
    "hexagon": {"sides": 6, "radius": 0.1, **OAK},
    "keystone": {"outline": [[-0.1, 0], [0.1, 0], [0.2, 0.2], [-0.2, 0.2]], **OAK},
}
HIGH = 0.1 * math.sqrt(3.0) / 2.0


def scenario(bodies: list[dict[str, Any]], **tables: object) -> Scenario:
    return Scenario.model_validate(freeze(data_of(blocks=BLOCKS, bodies=bodies, **tables)))


def told(bodies: list[dict[str, Any]], **tables: object) -> list[tuple[object, str]]:
    return [(finding.path, finding.message) for finding in impossible_starts(scenario(bodies, **tables))]


def placed(block: str, x: float, y: float, angle: float = 0.0) -> PlacedBody:
    degrees = f"{math.degrees(angle)!r} deg" if angle else 0
    return place_bodies(scenario([{"block": block, "x": x, "y": y, "angle": degrees}]))[0]


def test_a_hexagon_stands_on_its_lowest_side_and_not_deeper() -> None:
    assert told([{"block": "hexagon", "x": 0, "y": HIGH}]) == []
    ((path, message),) = told([{"block": "hexagon", "x": 0, "y": HIGH - 0.002}])
    assert (path, message) == (("bodies", 0), "body 1 reaches 2 mm below the ground (y = 0); raise it")


def test_wedges_may_fill_the_box_of_one_another_but_not_overlap() -> None:
    first = {"block": "wedge", "x": 0.1, "y": 0.1}
    assert told([first, {"block": "wedge", "x": 0.2, "y": 0.2, "angle": "180 deg"}]) == []
    ((path, message),) = told([first, {"block": "wedge", "x": 0.18, "y": 0.2, "angle": "180 deg"}])
    assert path == ("bodies", 1)
    assert message == f"bodies 1 and 2 overlap by {20 / math.sqrt(2.0):.6g} mm; they may only touch"


def test_a_wedge_lies_on_a_slope_of_its_own_angle() -> None:
    slope = {"profile": [[0, 0.3], [0.3, 0]]}
    body = {"block": "wedge", "x": 0.2, "y": 0.2, "angle": "180 deg"}
    assert told([body], ground=slope) == []
    ((_, message),) = told([{**body, "y": 0.19}], ground=slope)
    assert message == f"body 1 reaches {10 / math.sqrt(2.0):.6g} mm into the ground's profile"
    ((_, message),) = told([{**body, "y": -0.2}], ground=slope)
    assert "lies below the ground's profile" in message


def test_a_wall_may_pass_by_the_slanted_side() -> None:
    body = {"block": "wedge", "x": 0.1, "y": 0.1}
    assert told([body], walls=[{"from": [0.31, 0], "to": [0, 0.31]}]) == []
    ((_, message),) = told([body], walls=[{"from": [0.29, 0], "to": [0, 0.29]}])
    assert "body 1 and walls.0 overlap" in message


def test_loads_on_an_outline_are_accepted() -> None:
    body = {"block": "wedge", "x": 0.1, "y": 0.1}
    force = {"kind": "force", "body": "1", "magnitude": 1, "point": [0.05, 0.05]}
    assert told([body], loads=[force, {"kind": "pressure", "body": "1", "magnitude": 1, "face": "left"}]) == []


@pytest.mark.parametrize(
    ("face", "ends"),
    [
        ("bottom", ((-0.1, -0.1), (0.2, -0.1))),
        (1, ((-0.1, -0.1), (0.2, -0.1))),
        ("left", ((-0.1, -0.1), (-0.1, 0.2))),
        ("top", ((-0.1, 0.2), (0.2, -0.1))),
        ("30 deg", ((-0.1, 0.2), (0.2, -0.1))),
    ],
)
def test_the_face_of_an_outline_is_the_nearest_that_way_or_that_of_its_number(
    face: Face, ends: tuple[tuple[float, float], ...]
) -> None:
    body = placed("wedge", 0.1, 0.1, math.radians(30))
    found = face_of(body.corners, face)
    assert found is not None
    assert np.array(found[:2]) == pytest.approx(np.array(ends), abs=1e-15)
    strip = strip_before(body, face)
    assert strip.size_y == pytest.approx(1e-3 * 0.3 / math.sqrt(2.0))
    assert strip.size_x == pytest.approx(math.dist(*ends) - 2.0 * strip.size_y)
    normal = np.array([-math.sin(strip.angle), math.cos(strip.angle)])
    out = np.array(body.own_point(strip.x, strip.y)) - np.mean(ends, axis=0)
    assert np.abs(np.hypot(*out)) == pytest.approx(0.5 * strip.size_y)
    turned = np.array(body.ground_point(*out)) - (body.x, body.y)
    assert abs(turned @ normal) == pytest.approx(0.5 * strip.size_y)
