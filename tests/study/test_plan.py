"""Which values go together, in combinations, lists, tables and samples, and which scenarios they give."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Model, Sweep, scenario_to_toml
from blocksim.scenario.models.study import Normal, Uniform
from blocksim.simulation.provenance import run_hash
from blocksim.study import plan
from blocksim.study.plan import Design, Values, design_of, draw_values, open_interval, remarks, with_sweep
from tests.study.plans import KINETIC, OVERLAP, RATIO, SCALE, TILT, cases, plan_of, sweep_of

COUNT = "structures.0.count"


@pytest.mark.parametrize(
    ("vary", "mode", "expected"),
    [
        ({KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}, "grid", [(0.1, 1.0), (0.1, 2.0), (0.2, 1.0), (0.2, 2.0)]),
        ({KINETIC: [0.1, 0.2], SCALE: [1.0, 2.0]}, "list", [(0.1, 1.0), (0.2, 2.0)]),
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
    assert good.model is not None
    assert (good.model.scenario, good.name, by_hand.sweep) == (by_hand, run_hash(Model(by_hand)), None)
    assert bad.model is None
    assert "kinetic friction 0.9 is above static friction 0.31" in bad.problem


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


MIDDLES = (np.arange(10_000) + 0.5) / 10_000


def numbers(values: Normal | Uniform) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array(draw_values(values, MIDDLES), dtype=float)


@pytest.mark.parametrize(("low", "high"), [(0.5, math.inf), (-math.inf, 0.5), (-1.0, 2.0), (4.0, 5.0)])
def test_truncated_values_stay_inside_and_keep_the_shape(low: float, high: float) -> None:
    expected = stats.truncnorm(low, high).ppf(MIDDLES[::500])
    values = numbers(Normal(0.0, 1.0, low, high))
    assert low <= values.min() <= values.max() <= high
    assert values[::500] == pytest.approx(expected, abs=1e-9)


def test_values_on_a_logarithmic_scale_fill_every_decade_evenly(nominal: Document) -> None:
    values = numbers(Uniform(0.001, 10.0, "log"))
    assert np.histogram(np.log10(values), bins=4, range=(-3.0, 1.0))[0].tolist() == [2500] * 4
    sweep = sweep_of(nominal, "grid", {SCALE: {"from": 0.001, "to": 1, "count": 4, "scale": "log"}})
    assert column(sweep, SCALE) == [0.001, 0.01, 0.1, 1.0]


def test_places_at_the_very_ends_give_finite_values() -> None:
    low, high = draw_values(Normal(0.0, 1.0), open_interval(np.array([0.0, 1.0])))
    assert -9.0 < float(str(low)) < -8.0
    assert 8.0 < float(str(high)) < 9.0


UNIT = {"from": 1, "to": 2}  # minus 1: the places themselves
SAMPLED = ("lhs", "sobol", "normal")


def column(sweep: Sweep, key: str) -> list[object]:
    return [row[key] for row in design_of(sweep)]


def places(document: Document, mode: str, samples: int, seed: int = 0) -> NDArray[np.float64]:
    """Return where in the unit square a mode puts its samples."""
    sweep = sweep_of(document, mode, {RATIO: UNIT, SCALE: UNIT}, samples=samples, seed=seed)
    return np.array([[row[RATIO], row[SCALE]] for row in design_of(sweep)], dtype=float) - 1.0


def correlation(points: NDArray[np.float64]) -> float:
    one, other = (points - points.mean(axis=0)).T
    return float(np.sum(one * other) / math.sqrt(np.sum(one * one) * np.sum(other * other)))


@pytest.mark.parametrize("samples", [1, 7, 100])
def test_a_latin_hypercube_has_one_value_in_every_interval(nominal: Document, samples: int) -> None:
    strata = np.floor(places(nominal, "lhs", samples) * samples).astype(int)
    assert [sorted(keys) for keys in strata.T] == [list(range(samples))] * 2


def test_the_columns_of_a_latin_hypercube_are_not_in_step(nominal: Document) -> None:
    assert abs(correlation(places(nominal, "lhs", 1000))) < 4 / math.sqrt(1000)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_first_two_sobol_dimensions_are_a_net(nominal: Document, seed: int) -> None:
    """A (0, 6, 2) net in base 2: every cell of 1/64 of the square, however long, has exactly one of 64 points."""
    points = places(nominal, "sobol", 64, seed)
    for bits in range(7):
        cells = np.floor(points * [2**bits, 2 ** (6 - bits)]).astype(int)
        assert len({(x, y) for x, y in cells}) == 64


def test_sobol_points_beyond_one_chunk_continue_the_sequence_and_unbalanced_numbers_are_reported(
    nominal: Document,
) -> None:
    long = places(nominal, "sobol", 5000)
    assert np.array_equal(long[:100], places(nominal, "sobol", 100))
    cells = np.floor(long[:4096] * 64).astype(int)
    assert len({(x, y) for x, y in cells}) == 4096
    drawn = [
        sweep_of(nominal, mode, {SCALE: UNIT}, samples=n) for mode, n in (("sobol", 100), ("sobol", 64), ("lhs", 100))
    ]
    assert [remarks(one) for one in drawn] == [["100 Sobol points are not balanced; 64 or 128 are"], [], []]


@pytest.mark.parametrize("mode", SAMPLED)
def test_the_same_seed_draws_the_same_and_another_does_not(nominal: Document, mode: str) -> None:
    one, same, other = (
        column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=16, seed=seed), SCALE) for seed in (5, 5, 6)
    )
    assert one == same
    assert not set(one) & set(other)


FIRST = {  # from seed 0; another machine, or another version of scipy, has to draw the same
    "lhs": [(0.00997806719025, "0.0150627503951 rad"), (0.0096485136897, "0.00568704708097 rad")],
    "sobol": [(0.0100960435651, "0.00999242410775 rad"), (0.00948605085194, "0.00825796093011 rad")],
    "normal": [(0.00990748846648, "0.000488649724667 rad"), (0.0103717729413, "0.0135480266426 rad")],
}


@pytest.mark.parametrize("mode", SAMPLED)
def test_the_values_of_a_seed_stay_the_same_for_good(nominal: Document, mode: str) -> None:
    vary = {OVERLAP: {"mean": "10 mm", "sd": "0.3 mm"}, TILT: {"from": "0 deg", "to": "1 deg"}}
    design = design_of(sweep_of(nominal, mode, vary, samples=4))
    assert [tuple(row.values()) for row in (design[0], design[1])] == FIRST[mode]


@pytest.mark.parametrize("mode", SAMPLED)
def test_other_keys_their_order_and_more_samples_leave_values_as_they_are(nominal: Document, mode: str) -> None:
    """Sobol points have a dimension for each key: only a range added at the end leaves the others."""
    alone = column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=16), SCALE)
    more = {RATIO: UNIT, TILT: ["0 deg", "1 deg"], SCALE: UNIT}
    among = {SCALE: UNIT, RATIO: UNIT} if mode == "sobol" else more
    assert column(sweep_of(nominal, mode, among, samples=16), SCALE) == alone
    if mode != "lhs":  # more samples begin with the same ones
        assert column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=40), SCALE)[:16] == alone
    quoted = sweep_of(nominal, mode, {'contact."stiffness_scale"': UNIT}, samples=16)
    assert column(quoted, 'contact."stiffness_scale"') == alone
