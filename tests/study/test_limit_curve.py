"""Limits over another key: closed forms, resuming, what is refused, and the picture."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.study.limit import limit_curve
from blocksim.study.limit_answer import CurveAnswer
from blocksim.study.pictures import plot
from blocksim.study.report import report
from blocksim.view.studies import LimitCurve, LimitRange, OtherLimits, join_brackets
from tests.study.test_limit import TILT, block_on_a_slope

SIZE = (0.05, 0.1)  # m: topples at atan 0.5
OVER: dict[str, Any] = {"friction.block_ground": [0.7, 0.3]}


def curve(out: Path, **wanted: Any) -> CurveAnswer:
    return limit_curve(block_on_a_slope(SIZE), TILT, OVER, out=out, tolerance=0.02, **wanted)


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


def test_the_same_call_runs_nothing_and_another_one_is_refused(found: CurveAnswer) -> None:
    again = curve(found.folder)
    assert [search.run for search in again.searches.values()] == [0, 0]
    with pytest.raises(OutputExistsError, match="contains another curve of limits"):
        curve(found.folder, stands="moved < 1 mm")


def test_the_folder_holds_table_and_answer_and_is_drawn(found: CurveAnswer, tmp_path: Path) -> None:
    head, first, second = (found.folder / "limits.csv").read_text().splitlines()
    assert head == "over,low [deg],high [deg],below,above"
    assert first.startswith("0.3,")
    assert second.endswith(",stands,falls")
    data = json.loads((found.folder / "limits.json").read_text())
    assert [point["over"] for point in data["points"]] == [0.3, 0.7]
    assert plot(found, out=tmp_path / "limits.png").stat().st_size > 0
    assert "friction.block_ground" in report(found, out=tmp_path / "limits.html").read_text()


def test_a_table_of_others_is_drawn_beside_it(
    found: CurveAnswer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[LimitCurve] = []
    monkeypatch.setattr("blocksim.view.studies.draw_limit_curve", lambda curve, *_: drawn.append(curve))
    table = tmp_path / "published.csv"
    table.write_text('# from a book\nover,limit [deg],series\n0.3,16.7,"a, b"\n0.5,26.6,c\n0.4,21.8,"a, b"\n')
    plot(found, experiment=table)
    assert drawn[0].beside == (OtherLimits("a, b", ((0.3, 16.7), (0.4, 21.8))), OtherLimits("c", ((0.5, 26.6),)))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("over,limit,series\n", r"bad\.csv:1: .*'limit \[deg\]'"),
        ("over,limit [deg],series\n1,2,a\n1,x,a\n", r"bad\.csv:3: .*'x' is not a number"),
        ("over,limit [deg],series\n1,2\n", r"bad\.csv:2: "),
        ("over,limit [deg],series\n", r"bad\.csv: .*no rows"),
    ],
)
def test_a_bad_table_beside_a_curve_is_refused_with_its_line(
    found: CurveAnswer, tmp_path: Path, text: str, why: str
) -> None:
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InvalidInputError, match=why):
        plot(found, out=tmp_path / "limits.png", experiment=tmp_path / "bad.csv")
    assert not (tmp_path / "limits.png").exists()


def test_a_table_beside_a_single_limit_is_refused(found: CurveAnswer, tmp_path: Path) -> None:
    single = next(iter(found.searches.values())).folder
    with pytest.raises(InvalidInputError, match=r"a table is drawn beside a curve of limits only, and .* is a limit"):
        plot(single, out=tmp_path / "limit.png", experiment=tmp_path / "any.csv")


def test_only_neighbours_with_the_same_changes_are_joined() -> None:
    one, two = LimitRange(1.0, 3.0, "stands", "falls"), LimitRange(4.0, 6.0, "falls", "stands")
    points = [(0.0, [one]), (1.0, [one]), (2.0, [one, two]), (3.0, []), (4.0, [two])]
    assert join_brackets(LimitCurve("", "", points)) == [((0.0, 2.0), (1.0, 2.0))]
