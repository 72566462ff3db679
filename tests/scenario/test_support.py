"""Blocks that nothing supports at the start: which they are, and how far they are from what could."""

import math
from typing import Any

import pytest

from blocksim.scenario import Model, scenario_from_mapping
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.overlap import support_warning, unsupported

GAP = 0.010


def scene(*bodies: dict[str, Any], **tables: Any) -> Scenario:
    """Bodies of 200 x 100 mm, placed by their lower left corner in units of their sizes."""
    placed = []
    for number, body in enumerate(bodies):
        x, y = body.pop("x") + 0.5, body.pop("y") + 0.5
        placed.append({"block": "brick", "x": 0.2 * x, "y": 0.1 * y, "name": body.pop("name", f"b{number}"), **body})
    data: dict[str, Any] = {
        "schema": 1,
        "name": "gaps",
        "materials": {"stone": {"density": 2000.0, "young_modulus": 1e9, "poisson_ratio": 0.2}},
        "blocks": {"brick": {"width": 0.2, "height": 0.1, "length": 0.1, "material": "stone"}},
        "bodies": placed,
    }
    return scenario_from_mapping(data | tables)


def at(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"x": x, "y": y, **more}


UP = GAP / 0.1
SCENES = {
    "joint drawn open": (scene(at(0, 0), at(0, 1 + UP)), [1], GAP),
    "joint closed": (scene(at(0, 0), at(0, 1)), [], 0.0),
    "joint closed but for rounding": (scene(at(0, 0), at(0, 1 + 0.5e-3)), [], 0.0),
    "course that touches itself": (scene(at(0, 0), at(0, 1 + UP), at(1, 1 + UP)), [1, 2], GAP),
    "courses in any order": (scene(at(0, 2 + 2 * UP), at(0, 0), at(0, 1 + UP)), [0, 2], GAP),
    "stack upon a stack in the air": (scene(at(0, 2), at(0, 3), at(0, 4)), [0, 1, 2], 0.2),
    "corner before corner": (scene(at(0, 0), at(1 + 0.003 / 0.2, 1 + 0.004 / 0.1)), [1], 0.005),
    "beside what is fixed": (scene(at(0, 5, fixed=True), at(1, 5), at(3, 5)), [2], 0.2),
    "high above all": (scene(at(0, 1e3)), [0], 100.0),
    "on a wall": (scene(at(0, 5), walls=[{"from": [-1.0, 0.5], "to": [1.0, 0.5]}]), [], 0.0),
    "above a wall": (scene(at(0, 5), walls=[{"from": [-1.0, 0.45], "to": [1.0, 0.45]}]), [0], 0.05),
    "on a step of the ground": (
        scene(at(0, 5), at(-2, 0), at(-2, 5), ground={"profile": [[0.0, 0.0], [0.0, 0.5], [9.0, 0.5]]}), [2], 0.2
    ),
    "thrown": (scene(at(0, 5, velocity=[1.0, 0.0])), [], 0.0),
}  # fmt: skip


@pytest.mark.parametrize(("scenario", "loose", "gap"), SCENES.values(), ids=SCENES)
def test_blocks_without_a_chain_of_contacts_to_the_ground_are_found(
    scenario: Scenario, loose: list[int], gap: float
) -> None:
    found, nearest = unsupported(scenario, Model(scenario).bodies, 1e-4)
    assert found == loose
    assert nearest == pytest.approx(gap, rel=1e-6)
    assert bool(support_warning(scenario, Model(scenario).bodies)) == bool(loose)


@pytest.mark.parametrize("edge", range(5))
@pytest.mark.parametrize("angle", [0.0, 0.3, 2.5])
def test_gap_of_turned_polygons_is_their_distance(angle: float, edge: int) -> None:
    pentagon = [[0.1 * math.cos(0.4 * math.pi * k), 0.1 * math.sin(0.4 * math.pi * k)] for k in range(5)]
    blocks = {"cell": {"outline": pentagon, "depth": 0.1, "material": "stone"}}
    facing = angle + 0.4 * math.pi * (edge + 0.5)  # a face of the first, a corner of the second one
    way = 0.1 * math.cos(0.2 * math.pi) + 0.1 + GAP
    bodies = [
        {"block": "cell", "angle": f"{angle} rad", "x": x, "y": 9.0 + y, "fixed": fixed}
        for x, y, fixed in ((0.0, 0.0, True), (way * math.cos(facing), way * math.sin(facing), False))
    ]
    bodies[1]["angle"] = f"{facing + math.pi} rad"
    for both in (bodies, bodies[::-1]):
        scenario = scene(blocks=blocks, bodies=both)
        found, gap = unsupported(scenario, Model(scenario).bodies, 1e-4)
        assert found == [both.index(bodies[1])]
        assert gap == pytest.approx(GAP, rel=1e-9)


def test_the_warning_names_the_first_blocks_and_counts_the_others() -> None:
    (warning,) = Model(scene(at(0, 0), *(at(0, 1 + UP + k) for k in range(7)))).implausible_values
    assert warning == (
        "nothing supports 7 of 8 free blocks: b1, b2, b3, b4, b5 and 2 more; nearest gap 10 mm, "
        "through which they fall at the start"
    )
    assert Model(scene(at(0, 9), gravity=0.0)).implausible_values == []
