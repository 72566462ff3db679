"""Calibration: priors, scatter of inputs about what is fitted, scores, a search that continues, and the fitted file."""

import itertools
import math
from collections.abc import Callable, Mapping
from difflib import ndiff
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import OutputExistsError
from blocksim.scenario import Document, Model, Sweep
from blocksim.scenario.models.study import Normal, Uniform
from blocksim.study.calibrate import scenario_text
from blocksim.study.calibrate_plan import (
    FIRST,
    FRESH,
    Prior,
    Score,
    Trial,
    centre_on_fit,
    hits_of,
    members_of,
    miss_of,
    open_journal,
    prior_of,
    score_of,
    search,
)
from blocksim.study.executors.ensemble import Member
from blocksim.study.rows import Range
from tests.golden import Golden
from tests.study.conftest import SCENARIOS
from tests.study.plans import KINETIC, OVERLAP

FRICTION = Prior(KINETIC, 0.17, 0.31)
LENGTH = Prior(OVERLAP, 9.5, 10.5, "mm")
SCALE = Prior("contact.stiffness_scale", 1e-3, 1.0, log=True)


def test_values_are_rounded_to_what_matters_never_leave_the_bounds_and_are_noticed_there() -> None:
    rounded = FRICTION.value(0.192345678), LENGTH.value(10.123456), SCALE.value(0.00123456)
    assert rounded == (0.1923, "10.123 mm", 0.001235)
    for prior in (FRICTION, LENGTH, SCALE, Prior("gravity", 9.8149, 9.81507)):
        for share in (0.0, 1e-9, 0.3, 1.0 - 1e-9, 1.0):
            assert prior.low <= prior.number(prior.value(prior.at(share))) <= prior.high
    assert SCALE.at(0.5) == pytest.approx(10**-1.5)  # the middle of the logarithm
    assert FRICTION.at(0.5) == pytest.approx(0.24)
    assert [FRICTION.lies_at_bound(value) for value in (0.17, 0.3093, 0.172)] == [True, True, False]
    assert [SCALE.lies_at_bound(value) for value in (0.00105, 0.01)] == [True, False]


@pytest.mark.parametrize(
    ("written", "table", "expected"),
    [
        (0.17, Uniform(0.17, 0.31), Prior("key", 0.17, 0.31)),
        ("9.5 mm", Uniform(0.0095, 0.0105), Prior("key", 9.5, 10.5, "mm")),
        ("1e-2 m", Uniform(0.01, 0.02), Prior("key", 0.01, 0.02, "m")),
        ("18 deg", Uniform(0.3141592653589793, 0.4, angle=True), Prior("key", 18.0, 22.9183118052, "deg")),
    ],
)
def test_prior_keeps_the_unit_of_its_lower_end(written: object, table: Uniform, expected: Prior) -> None:
    assert prior_of("key", table, written) == expected


SCATTER = Sweep.model_validate(
    {"mode": "sobol", OVERLAP: {"mean": "10 mm", "sd": "0.3 mm"}, KINETIC: {"from": 0.18, "to": 0.2}}
)


def drawn(key: str, fitted: dict[str, object], count: int, *stream: str) -> list[float]:
    """Return the numbers that members of a seed have for a key."""
    return [float(str(row[key])) for row in members_of(SCATTER, fitted, count, 5, *stream)]


def test_every_trial_has_the_same_points_and_fresh_members_are_others_of_the_same_distribution() -> None:
    one, other = (drawn(OVERLAP, {"contact.restitution": e}, 16) for e in (0.2, 0.3))
    assert one == other
    assert len(set(one)) == 16
    fresh = drawn(OVERLAP, {}, 4096, FRESH)
    assert not set(drawn(OVERLAP, {}, 64)) & set(fresh)
    assert np.mean(fresh) == pytest.approx(0.01, abs=3 * 0.0003 / 64)
    assert np.std(fresh) == pytest.approx(0.0003, rel=0.05)


def test_fitted_key_scatters_about_its_fitted_value_however_it_is_quoted_and_needs_no_scatter() -> None:
    values = drawn(KINETIC, {KINETIC: 0.25}, 256)
    assert np.mean(values) == pytest.approx(0.25, abs=1e-4)
    assert 0.24 <= min(values) < 0.241
    assert 0.259 < max(values) <= 0.26
    quoted = 'friction."block_block".kinetic'
    assert drawn(quoted, {quoted: 0.25}, 256) == values
    assert [len(row) for row in members_of(SCATTER, {quoted: 0.25}, 4, 5)] == [2] * 4
    assert list(members_of(None, {KINETIC: 0.2}, 2, 0)) == [{KINETIC: 0.2}, {KINETIC: 0.2}]


@pytest.mark.parametrize(
    ("distribution", "value", "fitted", "expected"),
    [
        (Normal(0.01, 0.0003), 0.0103, "11 mm", 0.0113),
        (Uniform(0.2, 0.4), 0.25, 0.5, 0.45),
        (Uniform(0.01, 1.0, "log"), 1.0, 0.5, 5.0),
        (Normal(0.1, 0.02, angle=True), "0.12 rad", "0.3 rad", "0.32 rad"),
    ],
)
def test_scatter_is_moved_to_the_fitted_value(
    distribution: Normal | Uniform, value: object, fitted: object, expected: object
) -> None:
    moved, wanted = (str(one).split(" ") for one in (centre_on_fit(distribution, value, fitted), expected))
    assert float(moved[0]) == pytest.approx(float(wanted[0]))
    assert moved[1:] == wanted[1:]


RANGES = (Range("1", "x_mm", 10.0, 14.0), Range("2", "rotation_deg", -95.0, -85.0))
FAILED = Member(None, "overlap")


def member(x: float, rotation: float = -90.0) -> Member:
    return Member({"block": ["1", "2"], "x_mm": [x, 0.0], "rotation_deg": [0.0, rotation]})


def test_miss_is_zero_at_the_limit_and_grows_steadily_outwards() -> None:
    places = [12.0, 13.0, 13.9, 14.0, 14.1, 16.0, 50.0, 1e9]
    misses = [miss_of([x, -90.0], RANGES) for x in places]
    assert misses == sorted(misses)
    assert (misses[0], misses[3]) == (-1.0, 0.0)
    assert 0.0 < misses[4] < 0.05
    assert misses[-1] < 1.0
    assert miss_of([16.0, -90.0], RANGES) == pytest.approx(0.25)  # twice the half-width: (1 - 1/2) of one in two
    narrow = (Range("1", "x_mm", 71.69, 78.53),)  # whose limits are inside in spite of rounding
    assert max(miss_of([value], narrow) for value in (71.69, 78.53)) <= 0.0
    assert min(miss_of([math.nextafter(at, to)], narrow) for at, to in ((71.69, 0.0), (78.53, 100.0))) > 0.0


def test_failed_members_count_as_outside_and_each_quantity_is_reported_by_itself() -> None:
    score = score_of([member(12.0), FAILED, member(math.nan)], RANGES)
    assert (score.members, score.inside, score.failed) == (3, 1, 2)
    assert score.share_inside == pytest.approx(1 / 3)
    near, far = (score_of([member(x), member(x + 1.0)], RANGES).value for x in (15.0, 25.0))
    assert 0.0 > near > far >= -0.25  # of two, never as much as one of them
    x, rotation = hits_of([member(12.0, 0.0), member(20.0), member(22.0), FAILED], RANGES)
    assert (x.median, x.share_inside, rotation.median, rotation.share_inside) == (20.0, 0.25, -90.0, 0.5)
    (nothing, _) = hits_of([FAILED], RANGES)
    assert math.isnan(nothing.median)
    assert nothing.share_inside == 0.0


PRIORS = (Prior("a", 0.0, 1.0), Prior("b", 10.0, 20.0, "mm"))
PLAN = {"scenario": "one", "seed": 3}
Values = Mapping[str, object]


def hill(values: Values) -> Score:
    """Return a probability of 1 near (0.3, 17 mm), 0 elsewhere; the miss grows with the distance."""
    a, b = (prior.number(values[prior.key]) for prior in PRIORS)
    off = max(abs(a - 0.3), abs(b - 17.0) / 10.0)
    return Score(8, 8 if off < 0.05 else 0, 0, off)


def made(journal: Path, trials: int, seed: int = 3, evaluate: Callable[[Values], Score] = hill) -> list[Trial]:
    with open_journal(journal, PLAN) as study:
        return list(search(PRIORS, evaluate, study, trials=trials, seed=seed))


@pytest.mark.parametrize("killed_after", [0, FIRST, FIRST + 6])
def test_search_that_died_continues_as_if_it_had_not(tmp_path: Path, killed_after: int) -> None:
    expected, counted = made(tmp_path / "whole", FIRST + 8), itertools.count()

    def evaluate(values: Values) -> Score:
        if next(counted) == killed_after:
            raise ZeroDivisionError
        return hill(values)

    with pytest.raises(ZeroDivisionError):
        made(tmp_path / "cut", FIRST + 8, evaluate=evaluate)
    assert made(tmp_path / "cut", FIRST + 8, evaluate=evaluate) == expected
    assert next(counted) == FIRST + 8 + 1  # and what died


def test_longer_search_begins_as_a_shorter_one_whose_last_line_may_be_torn(tmp_path: Path) -> None:
    short, long = tmp_path / "short", made(tmp_path / "long", FIRST + 6)
    assert made(short, FIRST + 2) == long[: FIRST + 2]
    with short.open("ab") as file:
        file.write(b'{"op_code":4,"wor')
    assert made(short, FIRST + 6) == long
    assert made(tmp_path / "other", 1, seed=4)[0] != long[0]


def test_journal_of_another_plan_or_of_a_calibration_that_runs_is_refused_and_kept(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    made(journal, 2)
    before = journal.read_bytes()
    for plan, told in (
        ({**PLAN, "scenario": "two"}, r"another calibration \(scenario differ"),
        (PLAN, "another calibration is running here"),
    ):
        with (
            open_journal(tmp_path / "second" if plan != PLAN else journal, PLAN),
            pytest.raises(OutputExistsError, match=told),
            open_journal(journal, plan),
        ):
            pass
    assert journal.read_bytes() == before


WRITTEN: dict[str, tuple[str, dict[str, object], list[str]]] = {
    "values": ("three_blocks", {KINETIC: 0.2, "contact.restitution": 0.25}, []),
    "bare number": ("three_blocks_nominal", {KINETIC: 0.2, "contact.restitution.block_ground": 0.1}, []),
    "units": ("three_blocks", {OVERLAP: "10.12 mm", "structures.0.left": "1 mm"}, []),
    "new keys": ("three_blocks", {"contact.shear_damping_ratio": 0.3, "ground.tilt": "1 deg", "gravity": 9.8}, []),
    "settings": ("three_blocks", {KINETIC: 0.2}, ["contact.stiffness_scale=0.01", "time.end=1 s"]),
    "value of a list": ("slide", {"bodies.0.velocity.0": "0.61 m/s"}, []),
}


@pytest.mark.parametrize("case", WRITTEN)
def test_values_are_replaced_and_everything_else_stays(tmp_path: Path, golden: Golden, case: str) -> None:
    name, values, settings = WRITTEN[case]
    path, out = SCENARIOS / f"{name}.toml", tmp_path / "scenario.toml"
    document = Document.read(path).with_settings(settings)
    out.write_text(scenario_text(document, values, dict.fromkeys(values, "calibrated"), tmp_path, "by a test"))
    found, expected = Document.read(out).build(), document.with_values(values).build()
    assert Model(found).hash == Model(expected).hash
    assert found.experiment == expected.experiment
    assert {found.provenance[key] for key in values} == {"calibrated"}
    changed = ndiff(path.read_text().splitlines(), out.read_text().splitlines())
    golden("\n".join(line for line in changed if line[0] in "+-" and "table =" not in line))


def test_text_that_cannot_be_edited_is_written_out_resolved(tmp_path: Path) -> None:
    text = (SCENARIOS / "slide.toml").read_text().replace('velocity = ["0.5 m/s", 0]', "velocity = [\n  0.5,\n  0,\n]")
    document = Document.parse(text, "slide.toml", SCENARIOS)
    values = {"bodies.0.velocity": (0.6, 0.0), "friction.block_ground": 0.3}
    found = scenario_text(document, values, {"friction.block_ground": "calibrated"}, tmp_path, "by a test")
    assert "Resolved by blocksim" in found
    built = Document.parse(found, folder=tmp_path).build()
    assert Model(built).hash == Model(document.with_values(values).build()).hash
    assert built.provenance == {"friction.block_ground": "calibrated"}
