"""Which values go together, in combinations, lists and tables of cases, and which scenarios they give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Sweep, scenario_to_toml
from blocksim.simulation.provenance import run_hash
from blocksim.study import plan
from blocksim.study.plan import Design, Values, design_of, with_sweep
from tests.study.plans import KINETIC, OVERLAP, SCALE, TILT, cases, plan_of

COUNT = "structures.0.count"
SHAKEN = Path(__file__).parents[2] / "scenarios" / "shaking_table.toml"


@pytest.mark.parametrize(
    ("vary", "mode", "expected"),
    [
        ({KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}, "grid", [(0.1, 1.0), (0.1, 2.0), (0.2, 1.0), (0.2, 2.0)]),
        ({KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}, "list", [(0.1, 1.0), (0.2, 2.0)]),
        ({KINETIC: {"from": 0.1, "to": 0.3, "count": 3}}, "grid", [(0.1,), (0.2,), (0.3,)]),
        ({KINETIC: {"from": 0.3, "to": 0.1, "count": 3}}, "grid", [(0.3,), (0.2,), (0.1,)]),
        ({COUNT: {"from": 1, "to": 5, "count": 3}}, "grid", [(1,), (3,), (5,)]),
        ({COUNT: {"from": 100, "to": 1, "count": 3, "scale": "log"}}, "grid", [(100,), (10,), (1,)]),
        ({SCALE: np.array([0.5, 1.0])}, "grid", [(0.5,), (1.0,)]),
    ],
)
def test_grids_combine_all_values_and_lists_take_one_of_every_key(
    nominal: Document, vary: dict[str, Values], mode: str, expected: list[tuple[float, ...]]
) -> None:
    design = design_of(plan_of(with_sweep(nominal, vary, mode)))
    assert [tuple(values.values()) for values in design] == expected


def test_a_whole_number_key_refuses_values_of_a_range_that_are_not_whole(nominal: Document) -> None:
    uneven = cases(nominal, {COUNT: {"from": 1, "to": 6, "count": 3}}, "grid")
    problems = [case.problem for case in uneven]
    assert (problems[0], "3.5 is not a whole number" in problems[1], problems[2]) == ("", True, "")


def test_new_keys_replace_those_of_the_file_and_a_mode_alone_leaves_them(nominal: Document) -> None:
    before = with_sweep(nominal, {SCALE: [1.0, 2.0]}, "list")
    after = plan_of(with_sweep(before, {KINETIC: [0.1]}))
    assert (after.mode, set(after.vary)) == ("grid", {KINETIC})
    mode_only = plan_of(with_sweep(with_sweep(nominal, {SCALE: [1.0, 2.0]}), None, "list"))
    assert mode_only == plan_of(before)


def test_impossible_combination_is_kept_with_its_reason_beside_the_scenario_that_values_set_by_hand_give(
    nominal: Document,
) -> None:
    good, bad = cases(nominal, {KINETIC: [0.1, 0.9], OVERLAP: ["9 mm"]})
    by_hand = nominal.with_values({KINETIC: 0.1, OVERLAP: "9 mm"}).build()
    assert (good.scenario, good.name, by_hand.sweep) == (by_hand, run_hash(by_hand), None)
    assert bad.scenario is None
    assert "kinetic friction 0.9 is above static friction 0.31" in bad.problem


def test_sweep_without_a_possible_case_and_one_of_too_many_are_refused(
    nominal: Document, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InvalidInputError, match=r"none of the 2 cases can be simulated; the first: .*0\.8"):
        cases(nominal, {KINETIC: [0.8, 0.9]})
    monkeypatch.setattr(plan, "MOST_CASES", 5)
    with pytest.raises(InvalidInputError, match="6 cases are too many"):
        cases(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0, 3.0]})


def test_cases_are_made_when_they_are_asked_for(nominal: Document) -> None:
    friction, ends = ({"from": low, "to": high, "count": 1000} for low, high in ((0.1, 0.3), (1.0, 2.0)))
    many = cases(nominal, {KINETIC: friction, "time.end": ends})
    assert len(many) == 1_000_000
    last = many[-1].scenario
    assert last is not None
    assert (last.friction.block_block.kinetic, last.time.end, last.sweep) == (0.3, 2.0, None)
    assert [case.settings["time.end"] for case in (many[0], many[1])] == [1.0, 1.001001001001001]


def test_tables_of_motion_are_read_once_for_all_cases(tmp_path: Path) -> None:
    (tmp_path / "shake.csv").write_text("time_s,displacement_mm\n0,0\n1,2\n")
    text = SHAKEN.read_text() + '\n[sweep]\n"motion.scale" = [1.0, 2.0]\n'
    motion = text[text.index("[motion]") : text.index("\n[", text.index("[motion]") + 1)]
    document = Document.parse(text.replace(motion, '[motion]\nkind = "table"\ntable = "shake.csv"\n'), folder=tmp_path)
    made = cases(document)
    (tmp_path / "shake.csv").unlink()
    motions = [case.scenario.motion for case in made if case.scenario is not None]
    assert [(one.kind, getattr(one, "scale", None)) for one in motions if one] == [("table", 1.0), ("table", 2.0)]


@pytest.mark.parametrize("friction", [0.31, {"static": 0.31, "kinetic_ratio": 0.5}, None])
def test_a_resolved_sweep_has_the_same_cases(nominal: Document, friction: object) -> None:
    """Kinetic friction that follows the static one does so in the resolved file too."""
    values = {} if friction is None else {"friction.block_block": friction}
    data = {key: entry for key, entry in nominal.data.items() if key != ("friction" if friction is None else "")}
    first = with_sweep(replace(nominal, data=data).with_values(values), {"friction.block_block.static": [0.2, 0.4]})
    again = Document.parse(scenario_to_toml(first.build()))
    names = [[case.name for case in cases(document)] for document in (first, again)]
    assert names[0] == names[1]
    assert len(set(names[0])) == 2


def test_keys_to_vary_may_stand_under_vary_in_python() -> None:
    beside = Sweep.model_validate({"mode": "list", SCALE: [1.0, 2.0]})
    assert Sweep.model_validate({"mode": "list", "vary": {SCALE: [1.0, 2.0]}}) == beside


def test_any_row_can_be_asked_for_alone() -> None:
    design = Design({str(key): range(10) for key in range(18)}, is_grid=True)
    assert len(design) == 10**18
    assert "".join(str(value) for value in design[123456789012345678].values()) == "123456789012345678"
    assert design[-1] == dict.fromkeys(design[0], 9)


GOOD = """\
# overlaps measured with a feeler gauge
structures.0.overlap [mm], friction.block_block.kinetic ,time.scheme,structures.0.count
10.1,0.19,nonsmooth,3
9.8,0.21,nonsmooth,4
"""


@pytest.fixture
def document(nominal: Document, tmp_path: Path) -> Document:
    """Give a scenario that names a table which is not there yet."""
    data = {key: entry for key, entry in nominal.data.items() if key != "experiment"}
    data["sweep"] = {"mode": "table", "table": "samples.csv"}
    return Document(data, nominal.source, tmp_path)


def test_every_row_of_a_table_is_a_case_with_units_of_its_column_or_its_cells(document: Document) -> None:
    table = document.folder / "samples.csv"
    table.write_text(GOOD)
    made = cases(document)
    assert list(made[0].settings)[:2] == [OVERLAP, KINETIC]
    assert [tuple(case.settings.values()) for case in made] == [
        ("10.1 mm", 0.19, "nonsmooth", 3),
        ("9.8 mm", 0.21, "nonsmooth", 4),
    ]
    assert [case.problem for case in made] == ["", ""]
    named, listed = plan_of(document), plan_of(with_sweep(document, None))
    assert (named.mode, listed.mode) == ("table", "list")
    assert list(design_of(named)) == list(design_of(listed))
    table.write_text("structures.0.overlap,ground.tilt\n10 mm,1 deg\n0.9 cm,0\n")
    assert plan_of(with_sweep(document, None)).vary == {OVERLAP: ("10 mm", "0.9 cm"), TILT: ("1 deg", 0)}


def test_a_wrong_number_far_down_is_found(document: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MOST_TRIED", 3)
    numbers = "".join(f"{k / 1000}\n" for k in range(1, 400))
    (document.folder / "samples.csv").write_text(f"contact.restitution\n{numbers}1.5\n0.1\n")
    with pytest.raises(InvalidInputError, match=r"samples\.csv:401: contact\.restitution: 1\.5 is too large"):
        with_sweep(document, None)
