"""What `check` says of rigid contacts is what blocks do."""

from __future__ import annotations

from typing import Any

import pytest

from blocksim.scenario import Scenario, place_bodies, scenario_from_mapping
from blocksim.simulation.run import simulate
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, Simulation
from blocksim.world.describe import describe
from blocksim.world.sag import loads_at_rest


def stack(count: int, **time: Any) -> CaseScene:
    bodies = [{"y": (i + 0.5) * HEIGHT} for i in range(count)]
    rigid = {"scheme": "nonsmooth", "step": 1e-3, "velocity_tolerance": 1e-6, "end": 10.0, **time}
    return CaseScene(bodies, restitution=0.0, time=rigid)


@pytest.mark.parametrize(("count", "substeps"), [(1, 4), (5, 1), (5, 4)])
def test_column_sinks_by_what_is_reported(count: int, substeps: int) -> None:
    scene = stack(count, substeps=substeps)
    told = describe(scene.scenario()).rigid
    run = scene.start().to_time(2.0)
    assert told is not None
    assert (told.block, told.warning) == (str(count), "")
    assert (count - 0.5) * HEIGHT - run.bodies.y[-1] == pytest.approx(told.sag, rel=1e-3)


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
    """Return a cube of 1 m on two of 50 mm."""
    small = {"y": 0.025, "width": 0.05, "height": 0.05}
    cube = {"y": 0.55, "width": 1.0, "height": 1.0, "length": 1.0}
    time = {"scheme": "nonsmooth", "step": 1e-3, "end": 10.0}
    return CaseScene([{**small, "x": -0.4}, {**small, "x": 0.4}, cube], restitution=0.0, time=time).scenario()


@pytest.mark.parametrize(
    ("scenario", "is_warned"),
    [
        (heavy_on_light(5.0), False),
        (heavy_on_light(100.0), True),
        (heavy_on_light(1000.0), True),
        (cube_on_two(), True),
    ],
)
def test_heavy_blocks_sink_into_light_ones_by_what_is_reported(scenario: Scenario, is_warned: bool) -> None:
    told = describe(scenario).rigid
    run = Simulation(build_scene(scenario))
    heavy = len(run.bodies) - 1
    before = float(run.bodies.y[heavy])
    sunk = before - float(run.to_time(2.0).bodies.y[heavy])
    assert told is not None
    assert sunk == pytest.approx(told.sag, rel=0.05)
    assert run.ledger_row()[-1] == pytest.approx(told.overlap, rel=0.1)
    assert bool(told.warning) is is_warned


@pytest.mark.parametrize("ratio", [1e4, 1e6])
def test_automatic_step_keeps_light_blocks_from_being_crushed(ratio: float) -> None:
    unlike = heavy_on_light(ratio)
    scenario = unlike.model_copy(update={"time": unlike.time.model_copy(update={"step": "auto", "end": 0.1})})
    told = describe(scenario).rigid
    assert told is not None
    assert (told.warning, "light blocks carry heavy ones" in told.why) == ("", True)
    assert Simulation(build_scene(scenario)).to_time(0.1).ledger_row()[-1] < 0.011 * 0.025


@pytest.mark.parametrize("ratio", [30.0, 1e4])
def test_automatic_step_holds_a_heavy_block_beside_the_middle_of_a_light_one_to_a_thousandth_of_it(
    ratio: float,
) -> None:
    result = simulate(heavy_on_light(ratio, x=0.008, step="auto"))
    frames = result.held
    assert frames is not None
    assert 0.0375 - frames.y[-1, 1] < 1e-3 * 0.025
    assert abs(frames.rotation[-1]).max() < 1e-3  # rad
    assert result.summary.warnings == ()


@pytest.mark.parametrize(("ratio", "is_warned"), [(5.0, False), (1e3, True)])
def test_a_run_warns_of_a_heavy_block_that_has_come_to_lie_on_a_light_one(ratio: float, is_warned: bool) -> None:
    """Before the run nothing lies on anything, so that the step is the usual one of two blocks."""
    scenario = heavy_on_light(ratio, x=0.008, gap=1e-4, step="auto")
    told = describe(scenario).rigid
    assert told is not None
    assert told.warning == ""
    result = simulate(scenario)
    assert result.status == "finished"
    assert ["a light block carries a heavy one" in text for text in result.summary.warnings] == [True] * is_warned


def test_brick_carries_half_of_each_that_stands_on_two() -> None:
    """A course of two on one of three: the middle one below has both halves and its own weight."""
    below = [{"x": i * WIDTH, "y": HEIGHT / 2} for i in (-1, 0, 1)]
    above = [{"x": i * WIDTH, "y": 1.5 * HEIGHT} for i in (-0.5, 0.5)]
    placed = place_bodies(CaseScene([*below, *above]).scenario())
    on_ground: dict[str, float] = {}
    for load in loads_at_rest(placed, 1.0 / placed[0].mass):
        if load.lower is None:
            on_ground[placed[load.upper].name] = on_ground.get(placed[load.upper].name, 0.0) + load.force
    assert on_ground == pytest.approx({"1": 1.5, "2": 2.0, "3": 1.5})


def test_a_block_so_far_away_that_its_corners_are_one_place_halves_its_load() -> None:
    placed = place_bodies(CaseScene([{"x": 1e16, "y": 0.5 * HEIGHT}]).scenario())
    assert [load.force for load in loads_at_rest(placed, 2.0 / placed[0].mass)] == pytest.approx([1.0, 1.0])
