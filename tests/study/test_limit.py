"""The search for a limit by real runs, alone and over another key: closed forms, resuming, and the folder."""

import json
import math
import shutil
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.scenario import Document, replace_values
from blocksim.study.criterion import Stability
from blocksim.study.executors.processes import pool_of
from blocksim.study.limit import limit as searched, limit_curve
from blocksim.study.limit_answer import CurveAnswer, LimitAnswer
from blocksim.study.limit_plan import is_sustained, read_limit
from blocksim.study.pictures import plot
from blocksim.study.report import report
from blocksim.study.run_folder import read_run
from blocksim.view.studies import LimitCurve, LimitRange, OtherLimits, join_brackets
from tests.golden import Golden
from tests.study.plans import FRICTION, MU, SLENDER, SQUAT, TILT, TILTED, block_on_a_slope

limit = partial(searched, keep_runs=False)


def test_a_squat_block_slides_at_its_friction_angle_and_a_slender_one_topples_about_its_edge(
    slid: LimitAnswer, tmp_path: Path
) -> None:
    toppled = searched(block_on_a_slope(SLENDER), TILTED, tolerance=0.02, out=tmp_path / "limit")
    for found, tangent, tolerance, outcome in (
        (slid, FRICTION, 0.02, "slid"),
        (toppled, SLENDER[0] / SLENDER[1], 0.02, "fell"),
    ):
        (change,) = found.limits
        degrees = math.degrees(math.atan(tangent))
        assert change.low * (1.0 - tolerance) < degrees < change.high * (1.0 + tolerance)
        assert change.high - change.low <= tolerance * change.high
        assert (change.below, change.above) == (Stability.STANDS, Stability.FALLS)
        assert found.brackets[0].above.outcome == outcome
        assert len(found.rows) <= 25


def test_a_range_that_descends_is_searched_as_one_that_ascends(slid: LimitAnswer, tmp_path: Path) -> None:
    descending = {TILT: {"from": "40 deg", "to": "5 deg"}}
    folder = shutil.copytree(slid.folder, tmp_path / "study")
    down = searched(block_on_a_slope(SQUAT), descending, tolerance=0.02, out=folder)
    assert (down.changes, down.case_folders, down.run) == (slid.changes, slid.case_folders, 0)


def test_processes_are_started_once_and_not_for_every_round(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[int] = []

    def counted(workers: int) -> AbstractContextManager[ProcessPoolExecutor]:
        started.append(workers)
        return pool_of(workers)

    monkeypatch.setattr("blocksim.study.executors.processes.pool_of", counted)
    scene = block_on_a_slope(SQUAT)
    found = limit(scene, TILTED, tolerance=0.1, out=tmp_path / "pool", executor="processes", jobs=1)
    assert found.rows == limit(scene, TILTED, tolerance=0.1, out=tmp_path / "here").rows
    assert started == [1]
    assert not active_children()


def test_a_limit_is_drawn_as_its_mechanism_beside_the_last_that_stands(
    slid: LimitAnswer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (change,) = slid.limits
    assert slid.plan is not None
    assert set(slid.case_folders) == {change.low, change.high}
    for value, name in slid.case_folders.items():
        run = read_run(slid.folder / "cases" / name)
        release = "always" if value == change.high else "at rest"  # it falls before time zero
        kept = {"output.contacts": True, "start.release": release, "time.stop_at_rest": value != change.high}
        assert run.model.scenario == replace_values(slid.plan.model_at(value).scenario, kept)
        if value == change.low:
            assert float(run.frames.time[-1]) == pytest.approx(slid.rows[value]["seconds"])
    assert plot(slid) == Path("slope_mechanism.png")
    text = report(slid, out="limit.html").read_text()
    assert "Both sides of every bracket" in text
    assert 'src="data:image/png;base64,' in text


def test_a_limit_without_a_change_has_nothing_to_draw_and_a_report(tmp_path: Path) -> None:
    still = {TILT: {"from": "1 deg", "to": "2 deg", "count": 2}}
    found = searched(block_on_a_slope(SQUAT), still, out=tmp_path / "found")
    with pytest.raises(InvalidInputError, match="nothing changes within its range; nothing to draw"):
        plot(found, out=tmp_path / "picture.png")
    assert "nothing changes within the range" in report(found, out=tmp_path / "limit.html").read_text()
    assert not (tmp_path / "found" / "cases").exists()


def test_whole_numbers_of_blocks_are_searched_as_such(tmp_path: Path) -> None:
    stairs = {"kind": "staircase", "block": "b", "count": 2, "overlap": "81 mm"}
    leaning = block_on_a_slope(SQUAT) | {"bodies": [], "structures": [stairs]}
    found = searched(leaning, {"structures.0.count": {"from": 4, "to": 7}}, out=tmp_path, tolerance=1e-3)
    # shifted by 19 mm each, the blocks above the lowest have their centre at n 19 mm/2: beyond its edge for n = 6
    (change,) = found.limits
    assert (change.low, change.high) == (5.0, 6.0)
    assert found.brackets[0].above.outcome == "fell"


def unsettled(scene: dict[str, Any]) -> dict[str, Any]:
    return scene | {"start": {"settle": False}}


def test_sustained_loads_come_at_rest_unless_told_not_to_and_others_as_they_are() -> None:
    slope = block_on_a_slope(SQUAT)
    push = {"kind": "force", "body": "1", "magnitude": "1 N"}
    above = {"block": "b", "x": 0, "y": 0.2}
    for settles, scene in (
        (True, slope),
        (True, slope | {"loads": [push]}),
        (False, unsettled(slope)),
        (False, slope | {"loads": [push | {"history": {"kind": "ramp", "end": 1.0}}]}),
        (False, slope | {"bodies": [*slope["bodies"], above]}),  # to drop
        (False, slope | {"bodies": [{"block": "b", "x": 0, "y": 0.025, "velocity": [0.1, 0]}]}),
        (False, slope | {"motion": {"kind": "pulse", "shape": "sine", "amplitude": 1.0, "duration": 0.1}}),
        (False, slope | {"events": [{"at": 0.1, "remove": ["1"]}]}),
    ):
        plan = read_limit(Document.from_mapping(scene), TILTED, stands="outcome != fell")
        assert bool(plan.model_at(10.0).scenario.start.settle) is settles
        assert is_sustained(plan.model_at(10.0)) is (settles or scene == unsettled(slope))


def test_limits_of_rigid_contacts_that_go_with_the_step_hold_those_of_half_of_it(tmp_path: Path) -> None:
    arch = {"kind": "arch", "block": "v", "radius": 0.2, "thickness": 0.03, "embrace": "162 deg", "count": 16}
    ring = block_on_a_slope(SQUAT, end=0.5, step=1e-3) | {
        "blocks": {"v": {"depth": 0.1, "material": "stone"}},
        "bodies": [],
        "structures": [arch],
        "friction": {"block_block": 1.0, "block_ground": 1.0},
    }
    near = {TILT: {"from": "16.4 deg", "to": "19 deg", "count": 4}}
    found = limit(ring, near, out=tmp_path / "long", tolerance=1e-2)
    (bracket,), (answer,) = found.brackets, found.limits
    given, half = bracket.given, bracket.half_step
    assert half is not None
    assert half.low > given.high
    assert (answer.low, answer.high) == pytest.approx((given.low, half.high + half.low - given.high))
    assert answer.low < half.low < half.high < answer.high


def test_an_acceleration_that_passes_for_rest_is_in_the_bracket(tmp_path: Path) -> None:
    degrees = math.degrees(math.atan(FRICTION))
    scene = unsettled(block_on_a_slope(SQUAT, rest_hold=0.05, rest_speed=1e-4))
    near = {"from": f"{degrees - 0.1} deg", "to": f"{degrees + 0.1} deg", "count": 3}
    found = limit(scene, {TILT: near}, out=tmp_path, tolerance=1e-5)
    (bracket,), (answer,) = found.brackets, found.limits
    given, margin = bracket.given, bracket.undecided
    assert margin is not None
    assert given.low > degrees + 1e-3  # 2e-3 m/s2 for 50 ms is no motion
    assert answer.low < degrees < answer.high
    assert margin.rest == pytest.approx(1e-4 / 0.05 / 9.81 / math.radians(degrees), rel=0.01)
    data = json.loads((tmp_path / "limit.json").read_text())
    assert data["changes"][0]["undecided"] == {"rest": margin.rest, "springs": 0.0}
    assert data["changes"][0]["below"]["value"] == given.low


def curve(out: Path, **wanted: Any) -> CurveAnswer:
    """Search the limits of a block that topples at atan 0.5."""
    scene, over = block_on_a_slope((0.05, 0.1)), {MU: [0.7, 0.3]}
    return limit_curve(scene, TILTED, over, out=out, tolerance=0.02, **wanted)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> CurveAnswer:
    """Give a curve; not to be changed."""
    return curve(tmp_path_factory.mktemp("curve") / "found")


def test_a_block_slides_at_its_friction_angle_until_it_topples_before(found: CurveAnswer) -> None:
    assert list(found.searches) == [0.3, 0.7]
    for search, tangent in zip(found.searches.values(), (0.3, 0.5), strict=True):
        (change,) = search.limits
        assert change.low <= math.degrees(math.atan(tangent)) * 1.001
        assert change.high >= math.degrees(math.atan(tangent)) * 0.999
        assert change.high - change.low <= 0.02 * change.high
    again = curve(found.folder)
    assert [search.run for search in again.searches.values()] == [0, 0]
    with pytest.raises(OutputExistsError, match="contains another curve of limits"):
        curve(found.folder, stands="moved < 1 mm")


def test_the_folder_of_a_curve_holds_table_and_answer_and_is_drawn(found: CurveAnswer, tmp_path: Path) -> None:
    head, first, second = (found.folder / "limits.csv").read_text().splitlines()
    assert head == "over,low [deg],high [deg],below,above"
    assert first.startswith("0.3,")
    assert second.endswith(",stands,falls")
    data = json.loads((found.folder / "limits.json").read_text())
    assert [point["over"] for point in data["points"]] == [0.3, 0.7]
    assert plot(found, out=tmp_path / "limits.png").stat().st_size > 0
    assert MU in report(found, out=tmp_path / "limits.html").read_text()


def test_a_table_of_others_is_drawn_beside_a_curve(
    found: CurveAnswer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    drawn: list[LimitCurve] = []
    monkeypatch.setattr("blocksim.view.studies.draw_limit_curve", lambda curve, *_: drawn.append(curve))
    table, single = tmp_path / "table.csv", next(iter(found.searches.values())).folder
    table.write_text('# from a book\nover,limit [deg],series\n0.3,16.7,"a, b"\n0.5,26.6,c\n0.4,21.8,"a, b"\n')
    plot(found, experiment=table)
    assert drawn[0].beside == (OtherLimits("a, b", ((0.3, 16.7), (0.4, 21.8))), OtherLimits("c", ((0.5, 26.6),)))
    told = []
    for place, head, rows in (
        (found.folder, "over,limit,series", ""),
        (found.folder, "over,limit [deg],series", "1,2,a\n1,x,a\n"),
        (found.folder, "over,limit [deg],series", "1,2\n"),
        (found.folder, "over,limit [deg],series", ""),
        (single, "over,limit [deg],series", "1,2,a\n"),
    ):
        table.write_text(f"{head}\n{rows}")
        with pytest.raises(InvalidInputError) as caught:
            plot(place, out=tmp_path / "refused.png", experiment=table)
        told.append(f"{table.read_text()}{caught.value}\n".replace(str(place.parent), "PLACE"))
    golden("\n".join(told))
    assert not (tmp_path / "refused.png").exists()


def test_only_neighbours_with_the_same_changes_are_joined() -> None:
    one, two = LimitRange(1.0, 3.0, "stands", "falls"), LimitRange(4.0, 6.0, "falls", "stands")
    points = [(0.0, [one]), (1.0, [one]), (2.0, [one, two]), (3.0, []), (4.0, [two])]
    assert join_brackets(LimitCurve("", "", points)) == [((0.0, 2.0), (1.0, 2.0))]
