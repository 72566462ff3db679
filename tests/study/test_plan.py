"""Which values go together, and that mistakes are reported before anything runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError, ScenarioError
from blocksim.scenario import Document, scenario_to_toml
from blocksim.simulation.provenance import run_hash
from blocksim.study import plan
from blocksim.study.plan import Values, cases_of, with_sweep
from blocksim.study.sampling import design_of

KINETIC = "friction.block_block.kinetic"
SCALE = "contact.stiffness_scale"
SHAKEN = Path(__file__).parents[2] / "scenarios" / "shaking_table.toml"


def settings(document: Document, vary: dict[str, Values], mode: str | None = None) -> list[tuple[object, ...]]:
    sweep = with_sweep(document, vary, mode).build().sweep
    assert sweep is not None
    return [tuple(values.values()) for values in design_of(sweep)]


def test_grid_takes_all_combinations(nominal: Document) -> None:
    assert settings(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}) == [
        (0.1, 1.0),
        (0.1, 2.0),
        (0.2, 1.0),
        (0.2, 2.0),
    ]


def test_list_takes_one_value_of_every_key_at_a_time(nominal: Document) -> None:
    assert settings(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}, "list") == [(0.1, 1.0), (0.2, 2.0)]


def test_range_includes_both_ends(nominal: Document) -> None:
    assert settings(nominal, {KINETIC: {"from": 0.1, "to": 0.3, "count": 3}}) == [(0.1,), (0.2,), (0.3,)]


def test_arrays_of_numpy_are_lists_of_numbers(nominal: Document) -> None:
    assert settings(nominal, {SCALE: np.array([0.5, 1.0])}) == [(0.5,), (1.0,)]


def test_lists_of_different_lengths_are_refused(nominal: Document) -> None:
    with pytest.raises(ScenarioError, match=f"2 for {KINETIC}, 1 for {SCALE}"):
        settings(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0]}, "list")


@pytest.mark.parametrize(
    ("vary", "told"),
    [
        ({"friction.block_blok": [0.1]}, "unknown key, did you mean 'block_block'"),
        ({SCALE: [-1.0]}, "-1"),
        ({SCALE: []}, "empty"),
        ({"name": ["a"]}, "name cannot be varied"),
        ({SCALE: {"from": 1.0, "to": 2.0, "count": 1}}, "count 1 is not a whole number from 2"),
    ],
)
def test_wrong_key_or_value_is_reported_where_it_was_given(
    nominal: Document, vary: dict[str, Values], told: str
) -> None:
    key = next(iter(vary))
    with pytest.raises(ScenarioError, match=told) as caught:
        with_sweep(nominal, vary, labels={key: f"{key}=typed"}).build()
    assert str(caught.value).startswith(f"--vary {key}=typed: ")


def test_new_keys_replace_those_of_the_file(nominal: Document) -> None:
    before = with_sweep(nominal, {SCALE: [1.0, 2.0]}, "list")
    after = with_sweep(before, {KINETIC: [0.1]}).build().sweep
    assert after is not None
    assert (after.mode, set(after.vary)) == ("grid", {KINETIC})
    mode_only = with_sweep(with_sweep(nominal, {SCALE: [1.0, 2.0]}), None, "list").build().sweep
    assert mode_only is not None
    assert (mode_only.mode, set(mode_only.vary)) == ("list", {SCALE})


def test_impossible_combination_is_kept_with_its_reason(nominal: Document) -> None:
    document = with_sweep(nominal, {KINETIC: [0.1, 0.9]})
    sweep = document.build().sweep
    assert sweep is not None
    good, bad = cases_of(document, sweep)
    assert good.scenario is not None
    assert good.scenario.sweep is None
    assert good.scenario.friction.block_block.kinetic == 0.1
    assert bad.scenario is None
    assert "kinetic friction 0.9 is above static friction 0.31" in bad.problem


def test_sweep_without_a_possible_case_is_refused(nominal: Document) -> None:
    document = with_sweep(nominal, {KINETIC: [0.8, 0.9]})
    sweep = document.build().sweep
    assert sweep is not None
    with pytest.raises(InvalidInputError, match=r"none of the 2 cases can be simulated; the first: .*0\.8"):
        cases_of(document, sweep)


def test_cases_are_made_when_they_are_asked_for(nominal: Document) -> None:
    document = with_sweep(nominal, {KINETIC: spread(0.1, 0.3, 1000), "time.end": spread(1.0, 2.0, 1000)})
    sweep = document.build().sweep
    assert sweep is not None
    cases = cases_of(document, sweep)
    assert len(cases) == 1_000_000
    last = cases[-1].scenario
    assert last is not None
    assert (last.friction.block_block.kinetic, last.time.end, last.sweep) == (0.3, 2.0, None)
    assert [case.settings["time.end"] for case in cases[:2]] == [1.0, 1.001001001001001]


def spread(first: float, last: float, count: int) -> dict[str, object]:
    return {"from": first, "to": last, "count": count}


def test_a_case_is_the_scenario_with_its_values_set_by_hand(nominal: Document) -> None:
    document = with_sweep(nominal, {KINETIC: [0.1], "structures.0.overlap": ["9 mm"]})
    sweep = document.build().sweep
    assert sweep is not None
    by_hand = nominal.with_values({KINETIC: 0.1, "structures.0.overlap": "9 mm"}).build()
    assert cases_of(document, sweep)[0].scenario == by_hand
    assert cases_of(document, sweep)[0].name == run_hash(by_hand)


def test_tables_of_motion_are_read_once_for_all_cases(tmp_path: Path) -> None:
    (tmp_path / "shake.csv").write_text("time_s,displacement_mm\n0,0\n1,2\n")
    text = SHAKEN.read_text() + '\n[sweep]\n"motion.scale" = [1.0, 2.0]\n'
    motion = text[text.index("[motion]") : text.index("\n[", text.index("[motion]") + 1)]
    document = Document.parse(text.replace(motion, '[motion]\nkind = "table"\ntable = "shake.csv"\n'), folder=tmp_path)
    sweep = document.build().sweep
    assert sweep is not None
    cases = cases_of(document, sweep)
    (tmp_path / "shake.csv").unlink()
    motions = [case.scenario.motion for case in cases if case.scenario is not None]
    assert [(motion.kind, getattr(motion, "scale", None)) for motion in motions if motion] == [
        ("table", 1.0),
        ("table", 2.0),
    ]


def test_a_distribution_that_leaves_the_possible_values_is_refused_before_anything_runs(nominal: Document) -> None:
    vary: dict[str, Values] = {"contact.restitution": {"mean": 0.1, "sd": 0.1}, KINETIC: {"mean": 0.2, "sd": 0.01}}
    document = with_sweep(nominal, vary, "normal", {key: f"{key}=typed" for key in vary}, samples=100)
    sweep = document.build().sweep
    assert sweep is not None
    with pytest.raises(ScenarioError, match=r"--vary contact.restitution=typed: drawn: -0\.\d+ is too small") as caught:
        cases_of(document, sweep)
    assert len(caught.value.problems) == 1
    assert "cut the distribution with from and to" in str(caught.value)


@pytest.mark.parametrize(
    ("vary", "mode", "told"),
    [
        ({SCALE: {"from": 0.1, "to": 1}}, "grid", "a distribution needs one of the modes lhs, sobol and normal"),
        ({SCALE: {"mean": 0.1, "sd": 1}}, "list", "a distribution needs one of the modes lhs, sobol and normal"),
        ({SCALE: {"from": 0.1, "to": 1, "count": 3}}, "lhs", "count belongs to the modes"),
        ({SCALE: {"from": 1, "to": 1}}, "lhs", "from = 1 is not below to = 1"),
        ({SCALE: {"from": 0.0, "to": 1, "scale": "log"}}, "lhs", "needs from and to above 0"),
        ({SCALE: {"mean": 0.5, "sd": -0.1}}, "normal", "the standard deviation -0.1 is not above 0"),
        ({SCALE: {"mean": 0.5, "sd": 0.1, "from": 0.9, "to": 0.1}}, "sobol", "from = 0.9 is not below to = 0.1"),
        ({SCALE: {"mean": 0.5, "sd": 0.1, "from": 2}}, "sobol", "everything within 8 standard deviations"),
        ({SCALE: {"mean": 0.5}}, "sobol", "sd is missing"),
        ({SCALE: {"form": 0.5, "to": 1.0}}, "sobol", "unknown key \"form\", did you mean 'from'?"),
        ({"structures.0.overlap": {"mean": "10 mm", "sd": "1 s"}}, "normal", "are not of one kind"),
        ({"structures.0.overlap": {"mean": "10 s", "sd": "1 s"}}, "normal", '"10 s" is a time; a length'),
        ({"structures.0.overlap": {"from": "1 s", "to": "2 s", "count": 2}}, "grid", '"1 s" is a time; a length'),
    ],
)
def test_impossible_distributions_are_reported(
    nominal: Document, vary: dict[str, Values], mode: str, told: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        with_sweep(nominal, vary, mode).build()
    assert told in str(caught.value)


def test_mistakes_of_a_sampled_sweep_are_reported_together(nominal: Document) -> None:
    vary: dict[str, Values] = {SCALE: {"from": 2, "to": 1}, KINETIC: {"mean": 1, "sd": 0}, "seeds": [1]}
    with pytest.raises(ScenarioError) as caught:
        with_sweep(nominal, vary, "lhs", samples=0, seed=-1).build()
    messages = [problem.message for problem in caught.value.problems]
    assert len(messages) == 5
    assert "unknown key, did you mean 'seed'?" in messages


def test_samples_belong_to_sampled_modes(nominal: Document) -> None:
    with pytest.raises(ScenarioError, match='samples: mode "grid" has no key samples, which belongs to "lhs", "sobol"'):
        with_sweep(nominal, {SCALE: [1.0]}, samples=3).build()


def test_a_ratio_keeps_kinetic_friction_in_step_with_the_static_one(nominal: Document) -> None:
    ratio = {"friction.block_block": {"static": 0.31, "kinetic_ratio": 0.5}}
    document = with_sweep(nominal.with_values(ratio), {"friction.block_block.static": [0.2, 0.4]})
    sweep = document.build().sweep
    assert sweep is not None
    kinetic = [case.scenario.friction.block_block.kinetic for case in cases_of(document, sweep) if case.scenario]
    assert kinetic == [0.1, 0.2]


@pytest.mark.parametrize("friction", [0.31, {"static": 0.31, "kinetic_ratio": 0.5}, None])
def test_a_resolved_sweep_has_the_same_cases(nominal: Document, friction: object) -> None:
    """Kinetic friction that follows the static one does so in the resolved file too."""
    values = {} if friction is None else {"friction.block_block": friction}
    data = {key: entry for key, entry in nominal.data.items() if key != ("friction" if friction is None else "")}
    first = with_sweep(replace(nominal, data=data).with_values(values), {"friction.block_block.static": [0.2, 0.4]})
    again = Document.parse(scenario_to_toml(first.build()))
    names = []
    for document in (first, again):
        sweep = document.build().sweep
        assert sweep is not None
        names.append([case.name for case in cases_of(document, sweep)])
    assert names[0] == names[1]
    assert len(set(names[0])) == 2


def test_too_many_cases_are_refused_at_once(nominal: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MOST_CASES", 5)
    document = with_sweep(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0, 3.0]})
    sweep = document.build().sweep
    assert sweep is not None
    with pytest.raises(InvalidInputError, match="6 cases are too many"):
        cases_of(document, sweep)
