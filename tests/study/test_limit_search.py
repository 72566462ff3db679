"""Which values a search tries, what counts as standing, and limits of springs: from answers alone, without a run."""

import json
import math
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from blocksim.errors import StoppedEarlyError
from blocksim.scenario import Model, Scenario, document_of, scenario_from_mapping
from blocksim.scenario.models.gravity import GravityField
from blocksim.study.criterion import DEFAULT, read_criterion
from blocksim.study.executors import Batch, Execution, Rounds, RunSetting, Task
from blocksim.study.limit import find_limit, rest_acceleration
from blocksim.study.limit_answer import LimitAnswer
from blocksim.study.limit_plan import Change, LimitOptions, SearchRange, changes_in, next_near, next_values, read_limit
from blocksim.study.manifest import MANIFEST
from tests.golden import Golden
from tests.study.plans import block_on_a_slope


def searched(span: SearchRange, answer: Callable[[float], str], tolerance: float) -> dict[float, str]:
    known: dict[float, str] = {}
    while values := next_values(span, known, tolerance):
        assert not set(values) & known.keys(), "no value is tried twice"
        known |= {value: answer(value) for value in values}
    return known


@given(st.floats(20.01, 39.99), st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_one_change_is_bracketed_as_narrowly_as_wanted(limit: float, tolerance: float) -> None:
    known = searched(SearchRange(20.0, 40.0, 9), lambda value: "stands" if value < limit else "falls", tolerance)
    (change,) = changes_in(known)
    assert change.low < limit <= change.high
    assert change.high - change.low <= tolerance * change.high
    assert (change.below, change.above) == ("stands", "falls")


@pytest.mark.parametrize("is_log", [False, True])
def test_an_island_between_two_values_of_the_scan_is_found_where_rotations_peak_beside_it(is_log: bool) -> None:
    span = SearchRange(0.264, 0.748, 9, is_log)
    known: dict[int | float, str] = {}
    while values := next_values(span, known, 1e-3, {value: 1.0 / (0.01 + abs(value - 0.47)) for value in known}):
        known |= {value: "falls" if 0.4613 < value < 0.4815 else "stands" for value in values}
    assert [round(one.low, 3) for one in changes_in(known)] == pytest.approx([0.461, 0.481], abs=1e-3)
    assert len(known) < 45
    alone = searched(span, lambda value: "falls" if 0.4613 < value < 0.4815 else "stands", 1e-3)
    assert len(changes_in(alone)) == 0


def test_whole_numbers_and_ratios_are_tried_where_they_are_asked_for() -> None:
    known = searched(SearchRange(1.0, 12.0, 4, is_whole=True), lambda value: str(value > 4), 1e-3)
    assert changes_in(known) == [Change(4.0, 5.0, "False", "True")]
    assert all(value.is_integer() for value in known)
    assert SearchRange(1e-3, 1e3, 7, is_log=True).grid() == [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3]


def test_a_change_at_zero_and_none_at_all_end_and_an_undecided_range_has_a_bracket_at_either_side() -> None:
    assert len(searched(SearchRange(-10.0, 10.0, 9), lambda value: str(value > 0.0), 1e-3)) < 60
    assert len(searched(SearchRange(0.0, 1.0, 9), lambda _: "falls", 1e-3)) == 9

    def undecided(value: float) -> str:
        return "stands" if value < 2.0 else "undecided" if value < 3.0 else "falls"

    changes = changes_in(searched(SearchRange(0.0, 10.0, 11), undecided, 1e-2))
    assert [(one.below, one.above) for one in changes] == [("stands", "undecided"), ("undecided", "falls")]


@given(st.floats(20.01, 39.99), st.floats(20.0, 40.0), st.floats(0.01, 1.0))
def test_a_change_near_a_value_is_found_wherever_it_is_in_the_range(limit: float, about: float, width: float) -> None:
    span, near = SearchRange(20.0, 40.0, 9), Change(about - width, about + width, "stands", "falls")
    known: dict[float, str] = {}
    while values := next_near(span, known, near, 1e-3):
        assert not set(values) & known.keys(), "no value is tried twice"
        known |= {value: "stands" if value < limit else "falls" for value in values}
    (change,) = changes_in(known)
    assert change.low < limit <= change.high
    assert change.high - change.low <= 1e-3 * change.high
    assert len(known) < 30


def test_a_change_that_is_not_in_the_range_is_not_looked_for_without_end() -> None:
    span, near = SearchRange(20.0, 40.0, 9), Change(30.0, 31.0, "stands", "falls")
    for answer in ("stands", "falls", "undecided"):
        known: dict[float, str] = {}
        while values := next_near(span, known, near, 1e-3):
            known |= dict.fromkeys(values, answer)
        assert changes_in(known) == []
        assert len(known) < 12


ROW = {"status": "finished", "reason": "at rest", "outcome": "slid", "displacement_mm": 4.9, "turn_deg": 30.0}
CONDITIONS = f"""{DEFAULT}; outcome != fell; outcome = slid | stands; outcome == slid; moved < 5 mm; moved < 0.0049 m;
    moved <= 0.491 cm; turned < 0.5 rad; turned<31deg; moved > 4 mm; moved < 5 mm, turned < 10 deg; moved < 4 mm"""


def test_conditions_are_judged_in_the_units_that_were_typed(golden: Golden) -> None:
    """By what is at rest and what moves on at its end; a run that failed neither stands nor falls."""
    told = []
    for text in map(str.strip, CONDITIONS.split(";")):
        rows = (ROW, {**ROW, "moves_on": True}, {"status": "invalid"})
        told.append(f"{text}: {', '.join(read_criterion(text).verdict(row) for row in rows)}")
    golden("\n".join(told))


STIFF = 26.5  # deg: limit of stiff contacts
SLENDER = (0.1, 0.2)
Law = Callable[[float], float]


def linear(share: float) -> Law:
    """Return the limit over the stiffness scale of springs that take away so much at a scale of one."""
    return lambda scale: STIFF * (1.0 - share / scale)


class Formula(Execution):
    """Says at once that a block stands below the limit of its stiffness, and by how much it has turned."""

    law: Law
    is_known: bool  # the turn
    beside: dict[str, object]
    asked: list[Scenario]

    def ready(self, _: Path | None = None, /) -> tuple[Rounds, RunSetting]:
        def run(tasks: Iterator[Task], _: RunSetting) -> Generator[Batch, None, None]:
            for task in tasks:
                yield Batch((task,), (self.row(task.model.scenario),), 0.0, "")

        return lambda: nullcontext(run), RunSetting(1)

    def row(self, scenario: Scenario) -> dict[str, object]:
        self.asked.append(scenario)
        limit = self.law(scenario.contact.stiffness_scale)
        stands = math.degrees(scenario.ground.tilt) < limit
        outcome = ("stands" if self.is_known else "rocked back") if stands else "fell"
        ended = {"status": "finished", "reason": "", "seconds": 1.0, "outcome": outcome}
        return ended | {"b.rotation_deg": STIFF - limit} | self.beside


def formula(law: Law, *, is_known: bool = True, **beside: object) -> Formula:
    found = Formula()
    for name, value in (("law", law), ("is_known", is_known), ("beside", beside), ("asked", [])):
        object.__setattr__(found, name, value)
    return found


def on_springs(**tables: Any) -> dict[str, Any]:
    time = {"scheme": "explicit", "end": 1.0}
    contact = {"restitution": 0, "normal_stiffness": 1e5}
    data = block_on_a_slope(SLENDER) | {"time": time, "contact": contact, "start": {"settle": True}}
    return data | tables


def found_with(execution: Execution, out: Path, data: Mapping[str, Any] | None = None, **wanted: Any) -> LimitAnswer:
    vary = {"ground.tilt": {"from": "5 deg", "to": "40 deg"}}
    options = LimitOptions(vary, stands="outcome != fell", tolerance=1e-3, out=out, keep_runs=False, **wanted)
    return find_limit(read_limit(document_of(data or on_springs()), options), options, execution)


@pytest.mark.parametrize(("share", "scales"), [(0.06, 2), (0.006, 2), (0.2, 3)])
def test_a_limit_of_springs_becomes_that_of_stiff_contacts(tmp_path: Path, share: float, scales: int) -> None:
    found = found_with(formula(linear(share)), tmp_path)
    (answer,) = found.limits
    assert answer.low < STIFF < answer.high
    assert answer.high - answer.low < 5e-3 * STIFF
    levels = found.brackets[0].levels
    assert [one.stiffness_scale for one in levels] == [10.0**n for n in range(scales)]
    assert all(one.low < linear(share)(one.stiffness_scale) < one.high for one in levels)
    assert found.runs - len(found.rows) <= 8 * (scales - 1)
    assert found_with(formula(linear(share)), tmp_path, stiffer=False).limits == [one.given for one in found.brackets]


def test_shifts_that_nothing_foretells_and_of_what_moves_on_at_the_end_are_found_too(tmp_path: Path) -> None:
    for share in (0.03, -0.03):
        (answer,) = found_with(formula(linear(share), is_known=False), tmp_path / f"{share}").limits
        assert answer.low < STIFF < answer.high
    (answer,) = found_with(formula(linear(0.03), moves_on=True), tmp_path / "rocking").changes
    assert (answer.below, answer.above) == ("undecided", "falls")
    assert answer.low < STIFF < answer.high


def test_where_springs_do_not_shift_a_limit_two_runs_say_so_and_none_where_they_cannot(tmp_path: Path) -> None:
    found = found_with(formula(linear(1e-4), is_known=False), tmp_path / "may")
    assert found.runs == len(found.rows) + 2
    (answer,), (given,) = found.limits, [one.given for one in found.brackets]
    assert answer.low == given.low < STIFF < answer.high < given.high * (1.0 + 3e-3)  # they were looked for so far
    stiff = on_springs(contact={"restitution": 0})  # the stone's own stiffness
    assert found_with(formula(linear(1e-4), is_known=False), tmp_path / "cannot", stiff).runs == len(found.rows)


PULSE = {"kind": "pulse", "shape": "cosine", "amplitude": 1.0, "duration": 0.1}
DRIVEN = {"block": "b", "x": 9.0, "y": 0.5, "motion": {"kind": "ramp", "distance": 0.1, "duration": 0.5}}


def moving(kind: str) -> dict[str, Any]:
    """Return a block whose supports, or another body, move."""
    data = on_springs(start={"settle": False})
    return data | {"motion": PULSE} if kind == "ground" else data | {"bodies": [*data["bodies"], DRIVEN]}


@pytest.mark.parametrize("kind", ["ground", "body"])
def test_where_supports_move_stiffer_springs_are_searched_when_asked_for_alone(tmp_path: Path, kind: str) -> None:
    for stiffer, is_open in ((None, True), (True, False), (False, False)):
        found = found_with(formula(linear(0.03)), tmp_path / f"{stiffer}", moving(kind), stiffer=stiffer)
        assert (found.runs > len(found.rows)) is (stiffer is True)
        assert any("--stiffer" in text for text in found.warnings() if "moving supports" in text) is is_open


@pytest.mark.parametrize("kind", ["ground", "body"])
@pytest.mark.parametrize("stands", ["outcome != fell", DEFAULT, "turned < 10 deg"])
def test_what_rocks_on_after_a_motion_is_undecided_and_what_fell_has_fallen(kind: str, stands: str) -> None:
    options = LimitOptions({"ground.tilt": {"from": "5 deg", "to": "40 deg"}}, stands=stands)
    rocking = ROW | {"outcome": "rocking", "displacement_mm": 35.0}
    fell = ROW | {"outcome": "fell", "turn_deg": 180.0}
    shaken = read_limit(document_of(moving(kind)), options).criterion
    for moves_on in (True, False):
        assert shaken.verdict(rocking | {"moves_on": moves_on}) == "undecided"
    assert shaken.verdict(fell | {"moves_on": True}) == "falls"
    sustained = read_limit(document_of(on_springs()), options).criterion
    assert (sustained.verdict(rocking) == "falls") is (stands != "outcome != fell")


@pytest.mark.parametrize(("factors", "undecided"), [([0, 1, 1], False), ([0, 1, 0], True), ([0, -2, 1], True)])
def test_what_rocks_under_a_load_that_lasts_falls_and_is_undecided_after_a_pulse(
    factors: list[float], undecided: bool
) -> None:
    history = {"kind": "steps", "times": [0.0, 0.1, 0.2], "factors": factors}
    load = {"kind": "force", "name": "push", "body": "1", "magnitude": "1 N", "history": history}
    options = LimitOptions({"loads.push.magnitude": {"from": "1 N", "to": "2 N"}})
    judged = read_limit(document_of(on_springs(loads=[load])), options).criterion
    assert judged.verdict(ROW | {"outcome": "rocking"}) == ("undecided" if undecided else "falls")


def test_a_thrown_block_that_turns_back_as_its_run_ends_is_undecided_unless_it_rests() -> None:
    data = on_springs(start={"settle": False})
    data["bodies"] = [data["bodies"][0] | {"spin": 0.1}]
    options = LimitOptions({"bodies.0.spin": {"from": 0.1, "to": 1.0}})
    judge = read_limit(document_of(data), options).criterion
    assert judge.verdict(ROW) == "falls"  # slid, and at rest
    assert judge.verdict(ROW | {"reason": "end of simulated time"}) == "undecided"


def test_standing_means_not_fallen_where_supports_move_unless_it_is_said() -> None:
    vary = {"ground.tilt": {"from": "5 deg", "to": "40 deg"}}
    fallen = "outcome != fell"
    for data, text in ((on_springs(), DEFAULT), (moving("ground"), fallen), (moving("body"), fallen)):
        assert read_limit(document_of(data), LimitOptions(vary)).criterion.text == text
        assert read_limit(document_of(data), LimitOptions(vary, stands=DEFAULT)).criterion.text == DEFAULT


def test_a_search_that_is_cut_short_says_so_and_continues_with_more_runs(tmp_path: Path) -> None:
    execution = formula(linear(0.06))
    whole = found_with(execution, tmp_path / "whole")
    assert whole.plan is not None
    assert not whole.is_cut
    assert whole.plan.usual_runs == 9 + 2 * 5
    found = whole
    for most in (9, 12, len(whole.rows), whole.runs - 1, whole.runs):
        found = found_with(execution, tmp_path / "cut", most_runs=most)
        assert found.runs <= most
        assert found.is_cut is (most < whole.runs)
        assert any("--most-runs" in text for text in found.warnings()) is found.is_cut
        assert json.loads((tmp_path / "cut/limit.json").read_text())["is_cut"] is found.is_cut
        assert not any("no such limit" in one.problem for one in found.brackets)
        assert min(abs(one.low - linear(0.06)(1.0)) for one in found.limits_as_given) < 5.0
    assert (found.limits, found.run) == (whole.limits, 2)  # a round
    assert len(execution.asked) == 2 * whole.runs


def test_without_a_start_at_rest_the_bracket_holds_what_goes_with_the_root_of_the_stiffness_too(tmp_path: Path) -> None:
    data = on_springs(start={"settle": False})
    for law in (linear(0.03), lambda scale: STIFF * (1.0 - 0.03 / math.sqrt(scale))):
        (answer,) = found_with(formula(law), tmp_path / f"{law(4.0)}", data).limits
        assert answer.low < STIFF < answer.high


def test_a_limit_that_stiffer_springs_do_not_have_is_told_and_left_as_given(tmp_path: Path) -> None:
    found = found_with(formula(lambda scale: 24.0 if scale == 1.0 else 50.0), tmp_path)
    (bracket,) = found.brackets
    assert bracket.problem == "with springs 10 times as stiff there is no such limit in the range"
    assert found.limits == [bracket.given]
    (change,) = json.loads((tmp_path / "limit.json").read_text())["changes"]
    assert (change["extrapolated"], change["problem"]) == (False, bracket.problem)


def test_a_search_stopped_after_every_third_run_goes_on_with_the_same_values_and_repeats_none(tmp_path: Path) -> None:
    execution = formula(linear(0.2))
    whole = found_with(execution, tmp_path / "whole")
    seen: list[object] = []

    def stop(*run: object) -> None:
        seen.append(run)
        if len(seen) % 3 == 0:
            raise KeyboardInterrupt

    while len(seen) < whole.runs:
        with suppress(StoppedEarlyError):
            found_with(execution, tmp_path / "stopped", on_run=stop)
    again = found_with(execution, tmp_path / "stopped")
    assert again.run == 0
    assert len(seen) == whole.runs == len((tmp_path / "stopped" / MANIFEST).read_text().splitlines())
    tables = [(tmp_path / name / "limit.csv").read_bytes() for name in ("whole", "stopped")]
    assert tables[0] == tables[1]
    assert again.limits == whole.limits


def test_springs_of_hertz_give_way_by_another_power_and_a_step_by_hand_is_shortened_with_them(tmp_path: Path) -> None:
    hertz = on_springs(contact={"restitution": 0, "law": "hertz-mindlin", "contact_radius": 0.01})
    softer = formula(lambda scale: STIFF * (1.0 - 0.06 / scale ** (2.0 / 3.0)))
    (answer,) = found_with(softer, tmp_path / "hertz", hertz).limits
    assert answer.low < STIFF < answer.high
    assert answer.high - answer.low < 5e-3 * STIFF
    noting = formula(linear(0.06))
    found_with(noting, tmp_path / "noting", on_springs(time={"scheme": "explicit", "end": 1.0, "step": 1e-6}))
    assert len({one.contact.stiffness_scale for one in noting.asked}) > 1
    for one in noting.asked:
        assert float(one.time.step) * math.sqrt(one.contact.stiffness_scale) == pytest.approx(1e-6)


@pytest.mark.parametrize("gravity", [0.5, 9.81])
def test_what_rest_cannot_tell_from_falling_is_an_acceleration_under_any_gravity(gravity: float) -> None:
    one = scenario_from_mapping({**block_on_a_slope((0.1, 0.1)), "gravity": gravity, "start": {"settle": False}})
    assert 0.0 < rest_acceleration(Model(one), None) <= 1e-2
    assert rest_acceleration(Model(one.model_copy(update={"gravity": GravityField(magnitude=0.0)})), None) == 0.0
