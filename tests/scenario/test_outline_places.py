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


WEDGE = {"block": "wedge", "x": 0.1, "y": 0.1}
TURNED = {"block": "wedge", "x": 0.2, "y": 0.2, "angle": "180 deg"}
ALLOWED: dict[str, tuple[list[dict[str, Any]], dict[str, Any]]] = {
    "a hexagon on its lowest side": ([{"block": "hexagon", "x": 0, "y": HIGH}], {}),
    "wedges in the box of one another": ([WEDGE, TURNED], {}),
    "a wedge on a slope of its own angle": ([TURNED], {"ground": {"profile": [[0, 0.3], [0.3, 0]]}}),
    "a wall past the slanted side": ([WEDGE], {"walls": [{"from": [0.31, 0], "to": [0, 0.31]}]}),
}


@pytest.mark.parametrize(("bodies", "tables"), ALLOWED.values(), ids=ALLOWED)
def test_outlines_may_touch(bodies: list[dict[str, Any]], tables: dict[str, Any]) -> None:
    assert told(bodies, **tables) == []


def test_loads_on_an_outline_are_accepted() -> None:
    force = {"kind": "force", "body": "1", "magnitude": 1, "point": [0.05, 0.05]}
    assert told([WEDGE], loads=[force, {"kind": "pressure", "body": "1", "magnitude": 1, "face": "left"}]) == []


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
