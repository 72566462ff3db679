"""What may stand where at the start: bodies may touch the ground, walls and each other, no more."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import scenario_from_mapping
from tests.scenario.conftest import BRICK, data_of

SLOPE = math.atan(0.5)


def scenario_data(bodies: Sequence[Mapping[str, object]], **tables: object) -> dict[str, Any]:
    return data_of(bodies=[{"block": "brick", **body} for body in bodies], **tables)


def mistakes(data: dict[str, Any]) -> list[str]:
    try:
        scenario_from_mapping(data)
    except ScenarioError as error:
        return [problem.message for problem in error.problems]
    return []


def on_slope(gap: float, **keys: object) -> dict[str, Any]:
    """Place a brick on the slope y = x/2, its face `gap` m above it."""
    height = 0.05 + gap
    x, y = -height * math.sin(SLOPE), height * math.cos(SLOPE)
    return {"x": 1 + x, "y": 0.5 + y, "angle": f"{SLOPE!r} rad", **keys}


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize(
    ("body", "tables"),
    [
        ({"x": 0, "y": 0.05}, {}),
        ({"x": -0.1, "y": 0.05}, {"ground": {"profile": [[0, 0], [0, 1]]}}),  # beside a riser
        ({"x": 0.1, "y": 1.05}, {"ground": {"profile": [[0, 0], [0, 1]]}}),  # on its upper level
        ({"x": 0, "y": 1.05}, {"ground": {"profile": [[-1, 0], [0, 1], [1, 0]]}}),  # on a tip
        (on_slope(0.0), {"ground": {"profile": [[0, 0], [2, 1]]}}),
        ({"x": 0.1, "y": 0.05}, {"walls": [{"from": [0, 0], "to": [0, 1]}]}),
        ({"x": 0, "y": 1.05}, {"walls": [{"from": [-1, 1], "to": [1, 1]}]}),  # on a shelf
        ({"x": 0, "y": 1.05}, {"walls": [{"from": [0, 0], "to": [0, 1]}]}),  # on the tip of a wall
        ({"x": 0, "y": 0.95}, {"walls": [{"from": [-1, 1], "to": [1, 1]}]}),  # below a shelf
        ({"x": 0, "y": 0.05}, {"beside": [{"x": 0.2, "y": 0.05, "fixed": True}]}),
    ],
)
def test_a_body_may_touch(body: dict[str, Any], tables: dict[str, Any], fixed: bool) -> None:
    others = {key: table for key, table in tables.items() if key != "beside"}
    assert mistakes(scenario_data([{**body, "fixed": fixed}, *tables.get("beside", [])], **others)) == []


@pytest.mark.parametrize(("gap", "message"), [(-0.9e-9, []), (-1e-6, ["body 1 reaches 0.001 mm into"])])
def test_a_nanometre_on_a_slope_is_forgiven(gap: float, message: list[str]) -> None:
    data = scenario_data([on_slope(gap)], ground={"profile": [[0, 0], [2, 1]]})
    assert [found[: len("body 1 reaches 0.001 mm into")] for found in mistakes(data)] == message


def test_the_level_ground_beyond_the_ends_of_a_profile_counts() -> None:
    profile = {"profile": [[0, 1], [1, 2]]}
    assert mistakes(scenario_data([{"x": -5, "y": 1.05}, {"x": 50, "y": 2.05}], ground=profile)) == []


def test_spacings_and_skins_count_for_the_blocks_in_use_and_the_models_that_use_them() -> None:
    tiny = {"width": 0.01, "height": 0.001, "length": 0.01, "material": "oak"}
    blocks = {"brick": BRICK, "tiny": tiny}
    coarse = {"particle_spacing": 0.03, "smoothing_length": 0.049, "model": "kernel"}
    wide = {"skin": 0.0011, "model": "particles", "particle_spacing": 5e-4}
    for contact in (coarse, wide):
        assert mistakes(scenario_data([{"x": 0, "y": 1}], blocks=blocks, contact=contact)) == []
    used: list[dict[str, object]] = [{"x": 0, "y": 1}, {"x": 1, "y": 1, "block": "tiny"}]
    assert mistakes(scenario_data(used, blocks=blocks, contact={**coarse, "model": "surface"})) == []


@pytest.mark.parametrize("share", [1e-4, 1.0])
def test_a_skin_may_be_as_small_and_as_large_as_its_limits(share: float) -> None:
    assert mistakes(scenario_data([{"x": 0, "y": 1}], contact={"skin": share * BRICK["height"]})) == []


def test_round_off_of_places_far_away_refuses_no_scenario_that_names_no_skin() -> None:
    assert mistakes(scenario_data([{"x": 0, "y": 1e13}])) == []


def test_too_many_pieces_of_boundary() -> None:
    points = [[float(i), 0.0] for i in range(1001)]
    walls = [{"from": [x, 9], "to": [x + 0.5, 9]} for x, _ in points]
    pieces: dict[str, dict[str, Any]] = {"points": {"ground": {"profile": points}}, "walls": {"walls": walls}}
    for name, tables in pieces.items():
        told = f"1001 {name} are too many; at most 1000 are allowed"
        assert mistakes(scenario_data([{"x": 0, "y": 1}], **tables)) == [told]
