"""Which values go together, in combinations, lists and tables of cases, and which scenarios they give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Document, Sweep, scenario_to_toml
from blocksim.simulation.provenance import run_hash
from blocksim.study import plan, plan as mode
from blocksim.study.plan import Design, Values, design_of, with_sweep
from tests.study.plans import SCALE, cases, plan_of

KINETIC = "friction.block_block.kinetic"
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


def test_a_whole_number_key_takes_a_spaced_range_whose_values_are_whole(nominal: Document) -> None:
    spread = with_sweep(nominal, {COUNT: {"from": 1, "to": 5, "count": 3}}, "grid")
    assert [case.scenario is not None for case in cases(spread)] == [True] * 3
    uneven = with_sweep(nominal, {COUNT: {"from": 1, "to": 6, "count": 3}}, "grid")
    problems = [case.problem for case in cases(uneven)]
    assert (problems[0], "3.5 is not a whole number" in problems[1], problems[2]) == ("", True, "")


def test_new_keys_replace_those_of_the_file_and_a_mode_alone_leaves_them(nominal: Document) -> None:
    before = with_sweep(nominal, {SCALE: [1.0, 2.0]}, "list")
    after = plan_of(with_sweep(before, {KINETIC: [0.1]}))
    assert (after.mode, set(after.vary)) == ("grid", {KINETIC})
    mode_only = plan_of(with_sweep(with_sweep(nominal, {SCALE: [1.0, 2.0]}), None, "list"))
    assert (mode_only.mode, set(mode_only.vary)) == ("list", {SCALE})


def test_impossible_combination_is_kept_with_its_reason(nominal: Document) -> None:
    good, bad = cases(nominal, {KINETIC: [0.1, 0.9]})
    assert good.scenario is not None
    assert good.scenario.sweep is None
    assert good.scenario.friction.block_block.kinetic == 0.1
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
    many = cases(nominal, {KINETIC: spread(0.1, 0.3, 1000), "time.end": spread(1.0, 2.0, 1000)})
    assert len(many) == 1_000_000
    last = many[-1].scenario
    assert last is not None
    assert (last.friction.block_block.kinetic, last.time.end, last.sweep) == (0.3, 2.0, None)
    assert [case.settings["time.end"] for case in (many[0], many[1])] == [1.0, 1.001001001001001]


def spread(first: float, last: float, count: int) -> dict[str, object]:
    return {"from": first, "to": last, "count": count}


def test_a_case_is_the_scenario_with_its_values_set_by_hand(nominal: Document) -> None:
    by_hand = nominal.with_values({KINETIC: 0.1, "structures.0.overlap": "9 mm"}).build()
    (case,) = cases(nominal, {KINETIC: [0.1], "structures.0.overlap": ["9 mm"]})
    assert (case.scenario, case.name) == (by_hand, run_hash(by_hand))


def test_tables_of_motion_are_read_once_for_all_cases(tmp_path: Path) -> None:
    (tmp_path / "shake.csv").write_text("time_s,displacement_mm\n0,0\n1,2\n")
    text = SHAKEN.read_text() + '\n[sweep]\n"motion.scale" = [1.0, 2.0]\n'
    motion = text[text.index("[motion]") : text.index("\n[", text.index("[motion]") + 1)]
    document = Document.parse(text.replace(motion, '[motion]\nkind = "table"\ntable = "shake.csv"\n'), folder=tmp_path)
    made = cases(document)
    (tmp_path / "shake.csv").unlink()
    motions = [case.scenario.motion for case in made if case.scenario is not None]
    assert [(motion.kind, getattr(motion, "scale", None)) for motion in motions if motion] == [
        ("table", 1.0),
        ("table", 2.0),
    ]


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


def test_combinations_go_through_the_last_key_first() -> None:
    design = Design({"a": (1, 2), "b": ("x", "y", "z")}, is_grid=True)
    assert [tuple(row.values()) for row in design] == [(1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z")]
    assert [list(row) for row in design] == [["a", "b"]] * 6


def test_any_row_can_be_asked_for_alone() -> None:
    design = Design({str(key): range(10) for key in range(18)}, is_grid=True)
    assert len(design) == 10**18
    assert "".join(str(value) for value in design[123456789012345678].values()) == "123456789012345678"
    assert design[-1] == dict.fromkeys(design[0], 9)
    assert list(Design({"a": (1, 2, 3), "b": (4, 5, 6)}))[1:] == [{"a": 2, "b": 5}, {"a": 3, "b": 6}]


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


def told(document: Document, text: str) -> str:
    """Return what a user is told of a table with this text."""
    (document.folder / "samples.csv").write_text(text)
    with pytest.raises(BlocksimError) as caught:
        with_sweep(document, None)
    assert caught.value.exit_code == 65
    return str(caught.value)


def test_every_row_is_a_case(document: Document) -> None:
    (document.folder / "samples.csv").write_text(GOOD)
    made = cases(document)
    assert [tuple(case.settings.values()) for case in made] == [
        ("10.1 mm", 0.19, "nonsmooth", 3),
        ("9.8 mm", 0.21, "nonsmooth", 4),
    ]
    assert list(made[0].settings)[:2] == ["structures.0.overlap", "friction.block_block.kinetic"]
    assert [case.problem for case in made] == ["", ""]


def test_the_design_of_a_table_is_the_same_as_that_of_its_lists(document: Document) -> None:
    (document.folder / "samples.csv").write_text(GOOD)
    named, listed = plan_of(document), plan_of(with_sweep(document, None))
    assert (named.mode, listed.mode) == ("table", "list")
    assert list(design_of(named)) == list(design_of(listed))


def test_cells_may_have_units_of_their_own(document: Document) -> None:
    (document.folder / "samples.csv").write_text("structures.0.overlap,ground.tilt\n10 mm,1 deg\n0.9 cm,0\n")
    assert plan_of(with_sweep(document, None)).vary == {
        "structures.0.overlap": ("10 mm", "0.9 cm"),
        "ground.tilt": ("1 deg", 0),
    }


def test_a_wrong_number_far_down_is_found(document: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mode, "MOST_TRIED", 3)
    found = told(document, "contact.restitution\n" + "".join(f"{k / 1000}\n" for k in range(1, 400)) + "1.5\n0.1\n")
    assert "samples.csv:401: contact.restitution: 1.5 is too large" in found
