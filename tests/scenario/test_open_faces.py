"""What a pressure on a side of a structure acts on: forces of water against closed forms, and what it passes over."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.simulation import simulate
from blocksim.world.excitation import load_arrays

GAMMA = 9810.0  # N/m3
WIDTH, HEIGHT, LEVEL = 0.4, 0.2, 2.0  # m
STONE = {"density": 2000, "young_modulus": 5e9, "poisson_ratio": 0.2}
WALL = {"kind": "wall", "block": "brick", "columns": 4, "rows": 10, "ends": "flush"}
WINDOW = {"left": 0.8, "bottom": 0.4, "width": 0.4, "height": 0.6, "lintel": 0.8}
UNIFORM = {"kind": "pressure", "structure": 1, "face": "left", "magnitude": 1e4}
STEPS = {"kind": "staircase", "block": "brick", "count": 5, "overlap": 0.3}


def pressed(structure: Mapping[str, Any], face: str, **tables: Any) -> Scenario:
    """Return a structure of bricks, a metre deep, with water of 2 m on a side."""
    data = {
        "schema": 1,
        "name": "pressed",
        "materials": {"stone": STONE},
        "blocks": {"brick": {"width": WIDTH, "height": HEIGHT, "length": 1.0, "material": "stone"}},
        "structures": [structure],
        "loads": [{"kind": "pressure", "name": "water", "structure": 1, "face": face, "water_level": LEVEL}],
        "friction": {"block_block": 0.7, "block_ground": 0.7},
        "contact": {"restitution": 0},
        "time": {"end": 0.1, "scheme": "nonsmooth"},
    }
    return scenario_from_mapping({**data, **tables})


def force_of(scenario: Scenario) -> np.ndarray:
    """Return the force (N) of the water, from the depth at the middle of each face."""
    placed, total = Model(scenario).bodies, np.zeros(2)
    for _, body, (begin, end, (nx, ny)) in Model(scenario).acting_loads:
        one, other = (np.array(placed[body].ground_point(*place)) for place in (begin, end))
        cosine, sine = np.cos(placed[body].angle), np.sin(placed[body].angle)
        depth = LEVEL - 0.5 * (one + other)[1]
        total -= GAMMA * depth * np.hypot(*(other - one)) * np.array([cosine * nx - sine * ny, sine * nx + cosine * ny])
    return total


@pytest.mark.parametrize(
    ("structure", "face", "count", "across", "down"),
    [
        (WALL, "left", 10, 0.5 * LEVEL**2, 0.0),
        (WALL, "right", 10, -0.5 * LEVEL**2, 0.0),
        ({**WALL, "openings": [WINDOW]}, "left", 10, 0.5 * LEVEL**2, 0.0),  # not on its jambs
        (
            {**WALL, "ends": "toothed"},
            "left",
            19,
            0.5 * LEVEL**2,
            0.2 * (1.8 - 1.6 + 1.4 - 1.2 + 1.0 - 0.8 + 0.6 - 0.4 + 0.2),
        ),  # of five teeth, one by one
        (STEPS, "left", 9, 1.5, 0.1 * (1.8 + 1.6 + 1.4 + 1.2)),  # on treads
        (STEPS, "right", 9, -1.5, -0.1 * (1.8 + 1.6 + 1.4 + 1.2)),  # below what overhangs
        ({"kind": "pyramid", "block": "brick", "rows": 5}, "left", 9, 1.5, 0.2 * (1.8 + 1.6 + 1.4 + 1.2)),
    ],
)
def test_water_presses_on_all_that_is_open_on_a_side(
    structure: Mapping[str, Any], face: str, count: int, across: float, down: float
) -> None:
    scenario = pressed(structure, face)
    assert len(Model(scenario).acting_loads) == count
    assert force_of(scenario) == pytest.approx([GAMMA * across, -GAMMA * down], rel=1e-9, abs=1e-6)


@pytest.mark.parametrize(("left", "back"), [(None, 1.0), (-1.0, 1.0), (1.7, -1.0)])
def test_the_back_is_where_soil_is_and_left_without_it(left: float | None, back: float) -> None:
    tables: dict[str, Any] = {}
    if left is not None:
        soil = {"name": "fill", "material": "sand", "kind": "rectangle", "x": [left, left + 0.5], "y": [0.0, 0.4]}
        tables["soils"] = [{**soil, "spacing": 0.02}]
        tables["materials"] = {"stone": STONE, "sand": {**STONE, "friction_angle": "30 deg"}}
        tables["time"] = {"end": 0.1}
    for face, side in (("back", back), ("front", -back)):
        assert np.sign(force_of(pressed(WALL, face, **tables))[0]) == side


def test_a_wall_under_water_does_what_pressures_on_each_of_its_blocks_do() -> None:
    """Drained in the middle of the run, by the name that all faces of the structure share."""
    stack = {"kind": "stack", "block": "brick", "count": 4}
    ends: list[dict[str, Any]] = [{"at": 0.05, "unload": ["water"]}]
    level = {"water_level": 0.8, "kind": "pressure", "face": "left"}
    slippery = {"block_block": 0.3, "block_ground": 0.3}
    water = [{**level, "structure": 1, "name": "water"}]
    whole = simulate(pressed(stack, "left", loads=water, events=ends, friction=slippery))
    single = [{**level, "body": str(number), "name": f"water{number}"} for number in range(1, 5)]
    ends = [{"at": 0.05, "unload": [one["name"]]} for one in single]
    one_by_one = simulate(pressed(stack, "left", loads=single, events=ends, friction=slippery))
    assert whole.final.equals(one_by_one.final)
    assert whole.final["x_mm"].iloc[0] > 201.0


def test_the_bound_of_a_push_is_that_of_one_block_not_the_sum_over_all() -> None:
    few, many = (pressed({**WALL, "rows": rows}, "left", loads=[UNIFORM]) for rows in (2, 10))
    pushes = [load_arrays(Model(one)).push for one in (few, many)]
    assert pushes[0] == pytest.approx(pushes[1])
