"""Which values go together, and that mistakes are told before anything runs."""

import numpy as np
import pytest

from blocksim.errors import InvalidInputError, ScenarioError
from blocksim.scenario import Document
from blocksim.study import plan
from blocksim.study.plan import Values, cases_of, with_sweep
from blocksim.study.sampling.modes import design_of

KINETIC = "friction.block_block.kinetic"
SCALE = "contact.stiffness_scale"


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
def test_wrong_key_or_value_is_told_where_it_was_given(nominal: Document, vary: dict[str, Values], told: str) -> None:
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


def test_too_many_cases_are_refused_at_once(nominal: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MOST_CASES", 5)
    document = with_sweep(nominal, {KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0, 3.0]})
    sweep = document.build().sweep
    assert sweep is not None
    with pytest.raises(InvalidInputError, match="6 cases are too many"):
        cases_of(document, sweep)
