"""The search for a limit by real runs: closed forms, resuming, and what lies in the folder."""

import json
import math
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Document
from blocksim.study.criterion import Stability
from blocksim.study.executors.processes import pool_of
from blocksim.study.limit import limit as searched
from blocksim.study.limit_plan import is_sustained, read_limit, variants

limit = partial(searched, keep_runs=False)
FRICTION = 0.38
SLENDER, SQUAT = (0.02, 0.1), (0.1, 0.05)  # m
TILT = {"ground.tilt": {"from": "5 deg", "to": "40 deg"}}


def block_on_a_slope(size: tuple[float, float], **time: object) -> dict[str, Any]:
    width, height = size
    return {
        "schema": 1,
        "name": "slope",
        "materials": {"stone": {"density": 2500, "young_modulus": "30 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": width, "height": height, "length": 0.1, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0, "y": 0.5 * height}],
        "friction": {"block_ground": FRICTION},
        "contact": {"restitution": 0},
        "time": {"scheme": "nonsmooth", "end": 1.0, **time},
    }


def unsettled(scene: dict[str, Any]) -> dict[str, Any]:
    return scene | {"start": {"settle": False}}


@pytest.mark.parametrize(
    ("size", "degrees", "outcome"),
    [
        (SQUAT, math.degrees(math.atan(FRICTION)), "slid"),
        (SLENDER, math.degrees(math.atan2(*SLENDER)), "fell"),
    ],
)
def test_a_block_on_a_slope_slides_at_its_friction_angle_or_topples_about_its_edge(
    tmp_path: Path, size: tuple[float, float], degrees: float, outcome: str
) -> None:
    found = searched(block_on_a_slope(size), TILT, out=tmp_path / "limit")
    (change,) = found.limits
    assert change.low == pytest.approx(degrees, rel=2e-3)
    assert change.high == pytest.approx(degrees, rel=2e-3)
    assert change.high - change.low <= 1e-3 * change.high
    assert (change.below, change.above) == (Stability.STANDS, Stability.FALLS)
    assert found.brackets[0].above.outcome == outcome
    assert len(found.rows) <= 25


def test_a_range_that_descends_is_searched_as_one_that_ascends(tmp_path: Path) -> None:
    folder = tmp_path / "limit"
    up = limit(block_on_a_slope(SQUAT), TILT, out=folder)
    down = limit(block_on_a_slope(SQUAT), {"ground.tilt": {"from": "40 deg", "to": "5 deg"}}, out=folder)
    assert (down.changes, down.run) == (up.changes, 0)


def test_processes_are_started_once_and_not_for_every_round(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[int] = []

    def counted(workers: int) -> AbstractContextManager[ProcessPoolExecutor]:
        started.append(workers)
        return pool_of(workers)

    monkeypatch.setattr("blocksim.study.executors.processes.pool_of", counted)
    rough = partial(limit, block_on_a_slope(SQUAT), TILT, tolerance=0.02)
    found = rough(out=tmp_path / "pool", executor="processes", jobs=1)
    assert found.limits == rough(out=tmp_path / "here").limits
    assert started == [1]
    assert not active_children()


def test_the_folder_holds_the_answer_for_programs_and_the_scenario(tmp_path: Path) -> None:
    found = searched(block_on_a_slope(SQUAT), TILT, out=tmp_path, tolerance=0.1)
    data = json.loads((tmp_path / "limit.json").read_text())
    assert (data["key"], data["unit"], data["runs"]) == ("ground.tilt", "deg", len(found.rows) + 2)
    assert data["changes"][0]["above"]["outcome"] == "slid"
    assert data["environment"]["blocksim"]
    assert (tmp_path / "limit.csv").read_text().startswith("value [deg],verdict,outcome,")
    assert Document.read(tmp_path / "limit.toml").build().name == "slope"


def test_whole_numbers_of_blocks_are_searched_as_such(tmp_path: Path) -> None:
    leaning = block_on_a_slope(SQUAT) | {
        "bodies": [],
        "structures": [{"kind": "staircase", "block": "b", "count": 2, "overlap": "81 mm"}],
    }
    found = searched(leaning, {"structures.0.count": {"from": 2, "to": 9}}, out=tmp_path, tolerance=1e-3)
    # shifted by 19 mm each, the blocks above the lowest have their centre at n 19 mm/2: beyond its edge for n = 6
    (change,) = found.limits
    assert (change.low, change.high) == (5.0, 6.0)
    assert found.brackets[0].above.outcome == "fell"


def test_both_laws_are_the_same_scene_without_what_only_one_of_them_knows() -> None:
    document = Document.from_mapping(block_on_a_slope(SQUAT, substeps=2, step=1e-3))
    both = {name: one.build() for name, one in variants(document, both_laws=True).items()}
    assert list(both) == ["springs", "rigid contacts"]
    assert both["rigid contacts"] == document.build()
    assert both["springs"].time.scheme == "explicit"
    assert both["springs"].time.step == "auto"


def test_sustained_loads_come_at_rest_unless_told_not_to_and_others_as_they_are() -> None:
    slope = block_on_a_slope(SQUAT)
    push = {"kind": "force", "body": "1", "magnitude": "1 N"}
    ramp = {"kind": "ramp", "end": 1.0}
    above = {"block": "b", "x": 0, "y": 0.2}
    for settles, scene in (
        (True, slope),
        (True, slope | {"loads": [push]}),
        (False, unsettled(slope)),
        (False, slope | {"loads": [push | {"history": ramp}]}),
        (False, slope | {"bodies": [*slope["bodies"], above]}),  # to drop
        (False, slope | {"bodies": [{"block": "b", "x": 0, "y": 0.025, "velocity": [0.1, 0]}]}),
        (False, slope | {"motion": {"kind": "pulse", "shape": "sine", "amplitude": 1.0, "duration": 0.1}}),
        (False, slope | {"events": [{"at": 0.1, "remove": ["1"]}]}),
    ):
        plan = read_limit(Document.from_mapping(scene), TILT, stands="outcome != fell")
        assert plan.scenario_at(10.0).start.settle is settles
        assert is_sustained(plan.scenario_at(10.0)) is (settles or scene == unsettled(slope))


def test_limits_of_rigid_contacts_that_go_with_the_step_hold_those_of_half_of_it(tmp_path: Path) -> None:
    ring: dict[str, Any] = {
        "schema": 1,
        "name": "ring",
        "materials": {"stone": {"density": 2000, "young_modulus": "10 GPa", "poisson_ratio": 0.2}},
        "blocks": {"v": {"depth": 0.1, "material": "stone"}},
        "structures": [
            {"kind": "arch", "block": "v", "radius": 0.2, "thickness": 0.03, "embrace": "162 deg", "count": 16}
        ],
        "friction": {"block_block": 1.0, "block_ground": 1.0},
        "contact": {"restitution": 0},
        "time": {"scheme": "nonsmooth", "end": 0.5, "step": 1e-3},
    }
    near = {"ground.tilt": {"from": "16.4 deg", "to": "19 deg", "count": 4}}
    found = limit(ring, near, out=tmp_path / "long", tolerance=3e-3)
    (bracket,), (answer,) = found.brackets, found.limits
    given, half = bracket.given, bracket.half_step
    assert half is not None
    assert half.low > given.high
    assert (answer.low, answer.high) == pytest.approx((given.low, half.high + half.low - given.high))
    (short,) = limit(
        ring | {"time": {**ring["time"], "step": 1e-4}}, near, out=tmp_path / "short", tolerance=3e-3
    ).limits
    assert answer.low < short.low < short.high < answer.high
    (plain,) = limit(ring, near, out=tmp_path / "given", tolerance=3e-3, stiffer=False).limits
    assert plain == given


def test_an_acceleration_that_passes_for_rest_is_in_the_bracket(tmp_path: Path) -> None:
    degrees = math.degrees(math.atan(FRICTION))
    scene = unsettled(block_on_a_slope(SQUAT, rest_hold=0.05, rest_speed=1e-4))
    near = {"from": f"{degrees - 0.1} deg", "to": f"{degrees + 0.1} deg", "count": 3}
    found = limit(scene, {"ground.tilt": near}, out=tmp_path, tolerance=1e-5)
    (bracket,), (answer,) = found.brackets, found.limits
    given, margin = bracket.given, bracket.undecided
    assert margin is not None
    assert given.low > degrees + 1e-3  # 2e-3 m/s2 for 50 ms is no motion
    assert answer.low < degrees < answer.high
    assert margin.rest == pytest.approx(1e-4 / 0.05 / 9.81 / math.radians(degrees), rel=0.01)
    data = json.loads((tmp_path / "limit.json").read_text())
    assert data["changes"][0]["undecided"] == {"rest": margin.rest, "springs": 0.0}
    assert data["changes"][0]["below"]["value"] == given.low
