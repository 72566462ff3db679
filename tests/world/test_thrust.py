"""Joints of blocks as placed; their thrust at rest chooses the step of rigid contacts, however blocks were declared."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.scenario import PlacedBody, Scenario, load_scenario, place_bodies, place_segments
from blocksim.simulation.rest_state import SettleError, settle
from blocksim.simulation.schemes import ALONE, build
from blocksim.verification.scene import scenario_of
from blocksim.world.bodies import layout_of
from blocksim.world.joints import ContactJoint, joints_of
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.rigid_step import USUAL_STEP, thrust_shift
from tests.verification.test_arches import RADIUS, limit_analysis

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RING = {
    "kind": "arch",
    "block": "voussoir",
    "radius": "0.05 m",
    "thickness": "7.5 mm",
    "embrace": "162 deg",
    "count": 16,
}


def ring_of(*structures: Mapping[str, object], **values: object) -> Scenario:
    """Return a ring of 16 voussoirs on fixed abutments, at the step that it takes by itself."""
    time = {"time.step": "auto", "time.end": 1.0, "friction": {"block_block": 1.0, "block_ground": 1.0}}
    overrides = {**time, "structures": list(structures), **values}
    return load_scenario(SCENARIOS / "tilting_arch.toml", overrides, allow_outside=True)


def as_cells(**values: object) -> Scenario:
    """Return the same ring drawn block by block."""
    return ring_of({"kind": "polygons", "block": "voussoir", "cells": drawn_ring()}, **values)


def drawn_ring() -> list[dict[str, Any]]:
    return [{"outline": corners_of(body), "fixed": body.fixed} for body in place_bodies(ring_of(RING))]


def corners_of(body: PlacedBody) -> list[list[float]]:
    """Return the corners (m) of a block that is not turned."""
    assert body.angle == 0.0
    return [[body.x + x, body.y + y] for x, y in body.corners]


def as_outlines() -> Scenario:
    """Return the same ring as bodies, each of its own block."""
    placed = place_bodies(ring_of(RING))
    blocks = {
        f"b{number}": {"outline": [list(corner) for corner in body.corners], "depth": 1.0, "material": "stone"}
        for number, body in enumerate(placed)
    }
    bodies: Any = [
        {"block": f"b{number}", "x": body.x, "y": body.y, "fixed": body.fixed} for number, body in enumerate(placed)
    ]
    return ring_of(blocks=blocks, bodies=bodies)


def drawing_of(cells: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return GeoJSON."""
    features = [
        {
            "type": "Feature",
            "properties": {"fixed": cell["fixed"]},
            "geometry": {"type": "Polygon", "coordinates": [[*cell["outline"], cell["outline"][0]]]},
        }
        for cell in cells
    ]
    return {"type": "FeatureCollection", "features": features}


def test_one_ring_takes_one_step_however_it_is_declared(tmp_path: Path) -> None:
    drawing = tmp_path / "ring.geojson"
    drawing.write_text(json.dumps(drawing_of(drawn_ring())))
    drawn = ring_of({"kind": "polygons", "block": "voussoir", "table": str(drawing)})
    steps = [own_step(one) for one in (ring_of(RING), as_cells(), as_outlines(), drawn)]
    assert steps == pytest.approx([steps[0]] * 4)
    assert steps[0] < 0.1 * USUAL_STEP


def test_ring_of_outlines_falls_at_the_tilt_of_limit_analysis() -> None:
    pull, _ = limit_analysis(16, 0.15 * RADIUS, math.radians(162.0), 1.0, pulls=True)

    def comes_to_rest(share: float) -> bool:
        return is_settled(as_cells(**{"ground.tilt": f"{math.atan(share * pull)} rad", "start.settle": True}))

    assert comes_to_rest(0.998)
    assert not comes_to_rest(1.002)


def column(count: int, **values: object) -> Scenario:
    """Return a column of blocks of 32 x 25 mm."""
    return load_scenario(
        SCENARIOS / "tower.toml",
        {
            "time": {"scheme": "nonsmooth", "end": 3.0},
            "structures.0.count": count,
            "friction": {"block_block": 0.5, "block_ground": 0.5},
            "contact.restitution": 0.0,
            **values,
        },
    )


def test_tilted_column_stands_until_its_weight_leaves_the_base() -> None:
    """At the step of the upright one it would fall at 14 % less."""
    tilt = math.atan(0.998 * 32.0 / (16.0 * 25.0))
    assert is_settled(column(16, **{"ground.tilt": f"{tilt} rad", "start.settle": True}))


def test_columns_and_walls_that_stand_upright_keep_their_step() -> None:
    assert thrust_shift(layout_of(column(16))) == 0.0
    assert own_step(load_scenario(SCENARIOS / "tilting_wall.toml")) == USUAL_STEP
    leaning = {"ground.tilt": "3 deg"}
    assert own_step(column(16, **leaning)) < 0.2 * own_step(column(16))
    few = {"structures.0.offset": "3.5 mm"}
    assert own_step(column(3, **few, **leaning)) == own_step(column(3, **few)) == 0.25 * USUAL_STEP


def test_constant_loads_lean_a_column_as_a_tilt_does() -> None:
    push = {"kind": "horizontal", "magnitude": math.tan(math.radians(3.0))}
    tilted, pushed = (own_step(column(16, **value)) for value in ({"ground.tilt": "3 deg"}, {"loads": [push]}))
    assert pushed == pytest.approx(tilted, rel=0.1)
    assert pushed < 0.2 * own_step(column(16))


def test_what_nothing_carries_is_left_out_of_the_thrust_and_what_turns_freely_is_no_structure() -> None:
    stone = {"block": "voussoir", "outline": [[0.0, 0.2], [0.02, 0.2], [0.0, 0.22]]}
    cells = {"kind": "polygons", "block": "voussoir", "cells": [*drawn_ring(), stone], "in_place": True}
    with_stone = thrust_shift(layout_of(ring_of(cells)))
    assert with_stone == pytest.approx(thrust_shift(layout_of(as_cells())))
    on_its_corner = [[0.0, 0.0], [0.1, 0.15], [0.0, 0.3], [-0.1, 0.15]]
    alone = {"kind": "polygons", "block": "voussoir", "cells": [{"outline": on_its_corner}]}
    assert thrust_shift(layout_of(ring_of(alone))) == 0.0


def own_step(scenario: Scenario) -> float:
    return float(build_nonsmooth(scenario).world.controls[0].step)


def is_settled(scenario: Scenario) -> bool:
    """Return whether a scene comes to rest before time zero."""
    built = build(scenario)
    try:
        settle(built.scene, scenario, built.placed, ALONE)
    except SettleError:
        return False
    return True


NEAR = 1e-5  # m


BRICK = {"width": 0.2, "height": 0.1, "length": 1.0}
TRIANGLE = {"outline": [[-0.1, -0.05], [0.1, -0.05], [0.0, 0.1]], "length": 1.0}


def joints(*bodies: Mapping[str, Any], **tables: Any) -> list[ContactJoint]:
    """Return the joints of bricks, or of other bodies, the fixed ones supports."""
    rigid = {"time": {"scheme": "nonsmooth", "end": 1.0}, "friction": {"block_block": 0.6, "block_ground": 0.6}}
    scenario = scenario_of([BRICK | {**body} for body in bodies], **rigid, **tables)
    placed = place_bodies(scenario)
    free = {i for i, body in enumerate(placed) if not body.fixed}
    level = scenario.ground.profile is None
    return joints_of(placed, place_segments(scenario), free, NEAR, level=level)


def ends(joint: ContactJoint) -> list[tuple[float, float]]:
    return sorted((round(x, 9), round(y, 9)) for x, y in joint.points)


def test_ends_of_a_joint_are_corners_of_either_block_and_corners_alone_are_no_joint() -> None:
    """Two bricks below, one across both, and one whose corner only meets that of another."""
    found = joints({"x": 0.1, "y": 0.05}, {"x": 0.3, "y": 0.05}, {"x": 0.25, "y": 0.15}, {"x": 0.05, "y": 0.15})
    by_pair = {(joint.one, joint.other): joint for joint in found}
    assert set(by_pair) == {(0, 1), (0, 2), (1, 2), (0, 3), (2, 3), (0, 4), (1, 4)}
    assert ends(by_pair[0, 2]) == [(0.15, 0.1), (0.2, 0.1)]
    assert by_pair[0, 2].normal == pytest.approx((0.0, 1.0))
    assert by_pair[0, 4].normal == pytest.approx((0.0, -1.0))  # towards the ground, which comes last
    assert by_pair[0, 1].normal == pytest.approx((1.0, 0.0))
    assert math.dist(*by_pair[1, 2].points) == pytest.approx(0.15)


def test_a_corner_on_a_face_is_a_joint_of_one_point_and_fixed_blocks_have_none_among_themselves() -> None:
    tip = {**TRIANGLE, "angle": math.pi, "x": 0.1, "y": 0.2}
    (joint,) = [one for one in joints({"x": 0.1, "y": 0.05, "fixed": True}, tip) if len(one.points) == 1]
    assert (joint.one, joint.other) == (0, 1)
    assert joint.normal == pytest.approx((0.0, 1.0))
    (point,) = joint.points
    assert point == pytest.approx((0.1, 0.1))
    both = ({"x": 0.1, "y": 0.05, "fixed": True}, {"x": 0.1, "y": 0.15, "fixed": True})
    assert len(joints(*both, {"x": 0.1, "y": 0.25})) == 1


def test_blocks_stand_on_pieces_of_ground_and_lean_on_walls() -> None:
    ground = {"profile": [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [2.0, 0.0]]}
    walls = [{"from": [0.3, 1.0], "to": [0.3, 2.0], "material": "aluminium"}]
    found = joints({"x": 0.2, "y": 1.05}, {"x": 1.0, "y": 1.15}, ground=ground, walls=walls)
    normals = sorted((round(one.normal[0], 9), round(one.normal[1], 9)) for one in found)
    assert normals == [(0.0, -1.0), (1.0, 0.0)]
