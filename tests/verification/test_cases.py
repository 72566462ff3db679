"""Every case, with springs, rigid contacts and soil; what the README says is still so; what cases compare with."""

import math
from dataclasses import replace
from math import cos, isnan, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, placement
from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Case, CaseOutcome, Row, Setting, at_least, run_case
from blocksim.verification.cases import CASES, SettingError, choose_cases, exclusions
from blocksim.verification.soil import SOIL_CASES
from blocksim.verification.toppling import DominoModel, limit
from tests.verification.reference import (
    BEGIN,
    END,
    RIGID,
    SETTINGS,
    SOIL,
    STORE,
    cases_of,
    read_store,
    rows_of,
    table,
    with_table,
)

ROOT = Path(__file__).parents[2]
STORED = read_store(ROOT / STORE)
LONG = pytest.mark.long
SHARE = 0.2  # of its tolerance by which a measured number may differ from the kept one
ORDER_SHARE = 0.1  # of its bound, for a number with a lower bound only
HERTZ = "Hertz–Mindlin"  # its law is tested in tests/kernels, its cases are for make test-long
SLOW = {  # seconds; V4 and tests/symmetries show what V3 and V19 do; V9 and V11 are there always
    "linear": {"V3", "V10", "V12", "V13", "V15", "V17", "V18", "V19", "V23"},
    HERTZ: {case.id for case in CASES} - {"V25"},
    RIGID: {"V18", "V23", "V26"},
}
COLUMNS = [
    pytest.param(case, head, id=f"{case.id}-{head}", marks=LONG if case.id in slow else ())
    for head, slow in SLOW.items()
    for case in cases_of(head)
]


def missed(outcome: CaseOutcome) -> list[str]:
    return [row.quantity for row in outcome.rows if not row.is_inside]


def allowed(row: Row) -> float:
    """Return by how much the kept number may differ from the one measured now."""
    if row.at_least:
        return ORDER_SHARE * row.expected
    return SHARE * row.tolerance * (abs(row.expected) if row.relative else 1.0)


@pytest.mark.parametrize(("case", "head"), COLUMNS)
def test_case_is_inside_its_tolerances_and_what_the_readme_says(case: Case, head: str) -> None:
    """The quick size may leave rows out; numbers are compared where the sizes are the same."""
    found = run_case(case, replace(SETTINGS[head], quick=True))
    assert found.rows
    assert missed(found) == []
    kept = {row.quantity: row for row in rows_of(STORED, head, case)}
    is_full = not case.quick or head == RIGID
    assert not is_full or list(kept) == [row.quantity for row in found.rows], "run: make verify-table"
    for row in found.rows:
        old = kept[row.quantity]
        assert (old.unit, old.relative, old.at_least) == (row.unit, row.relative, row.at_least)
        assert [old.expected, old.tolerance] == pytest.approx([row.expected, row.tolerance], rel=1e-6)
        assert not is_full or old.measured == pytest.approx(row.measured, rel=1e-9, abs=allowed(row))


@LONG
@pytest.mark.parametrize("head", ["linear", HERTZ])
@pytest.mark.parametrize("case", [case for case in CASES if case.quick], ids=lambda case: case.id)
def test_case_in_full_is_inside_its_tolerances(case: Case, head: str) -> None:
    assert missed(run_case(case, SETTINGS[head])) == []


# what is outside; tests/simulation has more
QUICK_SOIL = {"S2": ["corrected: K, 5 mm"], "S4": [], "S8": [], "S12": ["batter 10°: K, 5 mm"]}


@pytest.mark.parametrize("name", ["S8", *(pytest.param(name, marks=LONG) for name in QUICK_SOIL if name != "S8")])
def test_quick_case_of_soil_is_inside_its_tolerances(name: str) -> None:
    (case,) = choose_cases([name], Setting(), soil=True)
    assert missed(run_case(case, Setting(quick=True))) == QUICK_SOIL[name]


@LONG
@pytest.mark.parametrize("case", SOIL_CASES, ids=lambda case: case.id)
def test_case_of_soil_is_as_the_table_has_it(case: Case) -> None:
    kept = rows_of(STORED, SOIL, case)
    assert missed(run_case(case, Setting())) == [row.quantity for row in kept if not row.is_inside]


RIGID_LONG = {"V3", "V4", "V9", "V10", "V13", "V15", "V17", "V18", "V23", "V26"}
RECTANGLES = [
    *((case, SETTINGS[RIGID], case.id in RIGID_LONG) for case in cases_of(RIGID)),
    *((case, Setting(quick=True), case.id == "V3") for case in choose_cases(["V3", "V5", "V6", "V7", "V8"], Setting())),
    *((case, Setting(quick=True), case.id != "S7") for case in SOIL_CASES if case.id in {"S5", "S6", "S7", "S11"}),
]


@pytest.mark.parametrize(
    ("case", "setting"),
    [
        pytest.param(case, setting, id=f"{case.id}-{setting.scheme}", marks=LONG if is_long else ())
        for case, setting, is_long in RECTANGLES
    ],
)
def test_rectangles_given_as_outlines_have_the_same_answers(
    case: Case, setting: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = placement.place

    def as_outlines(scenario: Scenario) -> placement.Placement:
        placed = place(scenario)
        return placed._replace(bodies=tuple(body._replace(outline=body.corners) for body in placed.bodies))

    plain = run_case(case, setting)
    assert missed(plain) == []
    monkeypatch.setattr(placement, "place", as_outlines)
    near = 1e-9 if setting.has_springs else 0.0  # a domino of V18 jams, and a last bit grows to 2.5e-3
    if case.id == "S6":
        near = 1e-5  # mm/s, of blocks that hold soil, long after they came to rest
    for rectangle, outline in zip(plain.rows, run_case(case, setting).rows, strict=True):
        same = outline.measured == pytest.approx(rectangle.measured, rel=near, abs=near)
        assert same or (isnan(rectangle.measured) and isnan(outline.measured)), rectangle.quantity


def test_table_of_the_readme_is_that_of_the_kept_results_of_all_cases() -> None:
    readme = (ROOT / "blocksim/verification/README.md").read_text(encoding="utf-8")
    assert BEGIN in readme
    assert END in readme
    assert with_table(readme, STORED) == readme, "run: make verify-table"
    assert list(STORED) == list(SETTINGS), "run: make verify-table"
    for head, column in STORED.items():
        assert list(column) == [case.id for case in cases_of(head)]
        assert all(column.values())


def test_table_shows_a_miss() -> None:
    row = {**STORED["linear"]["V2"][0], "measured": None}
    changed = {**STORED, "linear": {**STORED["linear"], "V2": [row]}}
    assert "– ✗" in next(line for line in table(changed).splitlines() if line.startswith("| V2 "))


@pytest.mark.parametrize(
    ("row", "inside"),
    [
        (Row("number", "m", 1.0, 1.02, 0.01), False),
        (Row("number", "m", 1.0, 0.991, 0.01), True),
        (Row("share", "m", 100.0, 98.0, 0.01, relative=True), False),
        (Row("share", "m", -100.0, -100.9, 0.01, relative=True), True),
        (Row("not a number", "m", 1.0, float("nan"), 10.0), False),
        (at_least("order", "", 1.8, 1.79), False),
        (at_least("order", "", 1.8, 2.5), True),
    ],
)
def test_a_number_is_inside_up_to_its_tolerance(row: Row, inside: bool) -> None:
    assert row.is_inside == inside


def test_cases_that_are_not_there_are_told_and_those_about_springs_say_why() -> None:
    with pytest.raises(InvalidInputError, match="S13: no such case of soil; choose S1, S2"):
        choose_cases(["S13"], Setting(), soil=True)
    assert [case.id for case in CASES if case not in cases_of(RIGID)] == ["V2", "V20", "V25"]
    assert all(len(reason) > 20 for reason in exclusions(RIGID))
    assert exclusions("explicit") == ()
    with pytest.raises(SettingError, match=r"V20 \(.*springs"):
        choose_cases(["V1", "v20"], SETTINGS[RIGID])


ROW = DominoModel(thickness=7.5 / 48.0, gap=0.3)
UNIT = sqrt(9.81 * 0.048)  # m/s


def test_limit_is_found_to_half_of_the_last_interval_where_the_outcome_changes() -> None:
    assert limit(lambda value: value > 0.3, 0.0, 1.0, 10) == pytest.approx(0.3, abs=2.0**-11)
    assert math.isnan(limit(lambda value: value > -1.0, 0.0, 1.0, 10))
    assert math.isnan(limit(lambda value: value > 2.0, 0.0, 1.0, 10))


@pytest.mark.parametrize(("width", "height", "slope"), [(0.025, 0.032, radians(60)), (0.032, 0.025, radians(55))])
def test_friction_needed_to_topple_is_that_of_newton_and_euler(width: float, height: float, slope: float) -> None:
    # unknowns: acceleration along (down the slope) and away from it, spin rate, friction (up the slope), normal force;
    # the lower edge lies at (width/2, -height/2) from the centre and does not move
    x, y, inertia = width / 2, -height / 2, (width**2 + height**2) / 12
    rows = [[1, 0, 0, 1, 0], [0, 1, 0, 0, -1], [0, 0, inertia, -y, -x], [1, 0, -y, 0, 0], [0, 1, x, 0, 0]]
    weight = np.array([9.81 * sin(slope), -9.81 * cos(slope), 0.0, 0.0, 0.0])
    *_, friction, normal = np.linalg.solve(np.array(rows), weight)
    assert forms.rolling_friction_limit(width, height, slope) == pytest.approx(friction / normal)
    assert width / height < friction / normal < np.tan(slope)
    limit = forms.toppling_slope(width, height)
    assert forms.rolling_friction_limit(width, height, limit) == pytest.approx(np.tan(limit))


@pytest.mark.parametrize(("gap", "speed"), [(0.2, 1.35), (0.7, 1.09)])
def test_stationary_speeds_of_the_verification_table_whatever_the_push(gap: float, speed: float) -> None:
    slow, fast = (DominoModel(7.5 / 48.0, gap).wave_speed(32, 36, push) for push in (1.0, 5.0))
    assert slow * UNIT == pytest.approx(speed, rel=5e-3)
    assert slow == pytest.approx(fast, rel=2e-3)


def test_a_row_that_is_pushed_too_gently_does_not_fall() -> None:
    with pytest.raises(ValueError, match="domino 1"):
        ROW.collision_times(1, 0.01)
