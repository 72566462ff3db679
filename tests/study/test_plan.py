"""Which values go together, and that mistakes are reported before anything runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Sweep, scenario_to_toml
from blocksim.simulation.provenance import run_hash
from blocksim.study import plan
from blocksim.study.plan import Values, design_of, with_sweep
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
