"""Joints, thrust and sag at rest choose the step of rigid contacts; what check says of it is what blocks do."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Model, Scenario, load_scenario, place_segments, scenario_from_mapping
from blocksim.simulation.rest_state import SettleError, settle
from blocksim.simulation.run import simulate
from blocksim.simulation.schemes import ALONE, build, measure_row
from blocksim.verification.scene import HEIGHT, CaseScene, SteppedScene, scenario_of
from blocksim.world.bodies import layout_of
from blocksim.world.describe import describe
from blocksim.world.joints import ContactJoint, joints_of
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.rigid_step import USUAL_STEP, thrust_shift
from blocksim.world.sag import loads_at_rest
from tests.golden import Golden

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
    return load_scenario(SCENARIOS / "tilting_arch.toml", overrides)


def drawn_ring() -> list[dict[str, Any]]:
    """Return the cells of the same ring, block by block."""
    placed = Model(ring_of(RING)).bodies
    return [{"outline": [[one.x + x, one.y + y] for x, y in one.corners], "fixed": one.fixed} for one in placed]


def as_cells(*more: Mapping[str, object]) -> Scenario:
    """Return the same ring drawn block by block, and more beside it."""
    return ring_of({"kind": "polygons", "block": "voussoir", "cells": [*drawn_ring(), *more], "in_place": bool(more)})


def test_one_ring_takes_one_step_however_it_is_declared() -> None:
    assert own_step(as_cells()) == pytest.approx(own_step(ring_of(RING)))
    assert own_step(as_cells()) < 0.1 * USUAL_STEP


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
    assert thrust_shift(layout_of(Model(column(16)))) == 0.0
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
    stone = {"outline": [[0.0, 0.2], [0.02, 0.2], [0.0, 0.22]]}
    assert thrust_shift(layout_of(Model(as_cells(stone)))) == pytest.approx(thrust_shift(layout_of(Model(as_cells()))))
    on_its_corner = [[0.0, 0.0], [0.1, 0.15], [0.0, 0.3], [-0.1, 0.15]]
    alone = {"kind": "polygons", "block": "voussoir", "cells": [{"outline": on_its_corner}]}
    assert thrust_shift(layout_of(Model(ring_of(alone)))) == 0.0


def own_step(scenario: Scenario) -> float:
    return float(build_nonsmooth(Model(scenario)).world.controls[0].step)


def is_settled(scenario: Scenario) -> bool:
    model = Model(scenario)
    try:
        settle(build(model), model, ALONE)
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
    placed = Model(scenario).bodies
    free = {i for i, body in enumerate(placed) if not body.fixed}
    level = scenario.ground.profile is None
    return joints_of(placed, place_segments(scenario), free, NEAR, level=level)


FIXED = {"x": 0.1, "y": 0.05, "fixed": True}
TIP = {**TRIANGLE, "angle": math.pi, "x": 0.1, "y": 0.2}
STEP = {"profile": [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [2.0, 0.0]]}
WALLS = [{"from": [0.3, 1.0], "to": [0.3, 2.0], "material": "aluminium"}]
ARRANGEMENTS = {
    "two below, one across, one at a corner": joints(
        *({"x": x, "y": y} for x, y in ((0.1, 0.05), (0.3, 0.05), (0.25, 0.15), (0.05, 0.15)))
    ),
    "a corner on a face": joints(FIXED, TIP),
    "on two fixed ones": joints(FIXED, {**FIXED, "y": 0.15}, {"x": 0.1, "y": 0.25}),
    "on a step of ground, at a wall": joints({"x": 0.2, "y": 1.05}, {"x": 1.0, "y": 1.15}, ground=STEP, walls=WALLS),
}


def test_joints_are_those_that_were_read(golden: Golden) -> None:
    """Ends are corners of either block; a corner alone is none; the ground comes last, normals lead to the second."""
    texts = []
    for name, found in ARRANGEMENTS.items():
        for joint in found:
            numbers = [[round(value, 9) + 0.0 for value in place] for place in (joint.normal, *sorted(joint.points))]
            texts.append(f"{name}: {joint.one} - {joint.other}, normal {numbers[0]}, from {numbers[1:]}")
    golden("\n".join(texts))


def heavy_on_light(ratio: float, *, x: float = 0.0, gap: float = 0.0, **time: Any) -> Scenario:
    """Return a block on another that has a share of its mass, beside its middle by x (m) and above it by a gap (m)."""
    materials = {
        name: {"density": density, "young_modulus": 1e9, "poisson_ratio": 0.25}
        for name, density in (("light", 2000.0), ("heavy", 2000.0 * ratio))
    }
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "unlike",
            "materials": materials,
            "blocks": {name: {"width": 0.04, "height": 0.025, "length": 0.05, "material": name} for name in materials},
            "bodies": [{"block": "light", "x": 0.0, "y": 0.0125}, {"block": "heavy", "x": x, "y": 0.0375 + gap}],
            "contact": {"restitution": 0.0},
            "time": {"scheme": "nonsmooth", "step": 1e-3, "end": 2.0, **time},
        }
    )


def cube_on_two() -> Scenario:
    small = {"y": 0.025, "width": 0.05, "height": 0.05}
    cube = {"y": 0.55, "width": 1.0, "height": 1.0, "length": 1.0}
    time = {"scheme": "nonsmooth", "step": 1e-3, "end": 10.0}
    return CaseScene([{**small, "x": -0.4}, {**small, "x": 0.4}, cube], restitution=0.0, time=time).scenario()


@pytest.mark.parametrize(
    ("scenario", "is_warned"),
    [
        (heavy_on_light(5.0), False),
        (heavy_on_light(1000.0), True),
        (cube_on_two(), True),
    ],
)
def test_heavy_blocks_sink_into_light_ones_by_what_is_reported(scenario: Scenario, is_warned: bool) -> None:
    told = describe(Model(scenario)).rigid
    run = SteppedScene(build(Model(scenario)))
    heavy = len(run.bodies) - 1
    before = float(run.bodies.y[heavy])
    sunk = before - float(run.to_time(2.0).bodies.y[heavy])
    assert told is not None
    assert sunk == pytest.approx(told.sag, rel=0.05)
    assert measure_row(run.scene)[-1] == pytest.approx(told.overlap, rel=0.1)
    assert bool(told.warning) is is_warned


@pytest.mark.parametrize("ratio", [30.0, 1e4])
def test_automatic_step_holds_a_heavy_block_beside_the_middle_of_a_light_one_to_a_thousandth_of_it(
    ratio: float,
) -> None:
    scenario = heavy_on_light(ratio, x=0.008, step="auto")
    told, result = describe(Model(scenario)).rigid, simulate(scenario)
    assert told is not None
    assert (told.warning, "light blocks carry heavy ones" in told.why) == ("", ratio > 100.0)
    frames = result.held
    assert frames is not None
    assert 0.0375 - frames.y[-1, 1] < 1e-3 * 0.025
    assert abs(frames.rotation[-1]).max() < 1e-3  # rad
    assert not any("heavy one" in text for text in result.summary.warnings)


@pytest.mark.parametrize(("ratio", "is_warned"), [(5.0, False), (1e3, True)])
def test_a_run_warns_of_a_heavy_block_that_has_come_to_lie_on_a_light_one(ratio: float, is_warned: bool) -> None:
    """Before the run nothing lies on anything, so that the step is the usual one of two blocks."""
    scenario = heavy_on_light(ratio, x=0.008, gap=1e-4, step="auto")
    result = simulate(scenario)
    assert result.status == "finished"
    assert any("a light block carries a heavy one" in text for text in result.summary.warnings) is is_warned


def test_a_block_so_far_away_that_its_corners_are_one_place_halves_its_load() -> None:
    placed = Model(CaseScene([{"x": 1e16, "y": 0.5 * HEIGHT}]).scenario()).bodies
    assert [load.force for load in loads_at_rest(placed, 2.0 / placed[0].mass)] == pytest.approx([1.0, 1.0])
