"""Fragility by real runs: a closed form for every member, draws, resuming, shards, and what lies in the folder."""

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from blocksim.analysis.compare import interval
from blocksim.analysis.lognormal import Counts, Curve, NoCurve, fit
from blocksim.errors import UnavailableError
from blocksim.scenario import Document
from blocksim.study.fragility import FragilityAnswer, fragility, read_fragility
from blocksim.study.manifest import Shard
from tests.sizes import in_all

MU = "friction.block_ground"
SLIDES = "outcome = slid"
TILTS = {"ground.tilt": ["14 deg", "17 deg", "20 deg", "23 deg", "26 deg"]}
FRICTION = {MU: {"mean": 0.38, "sd": 0.06}}
STONE = {"density": 2500, "young_modulus": "30 GPa", "poisson_ratio": 0.2}
SLOPE: dict[str, Any] = {
    "schema": 1,
    "name": "slope",
    "materials": {"stone": STONE},
    "blocks": {"b": {"width": 0.1, "height": 0.05, "length": 0.1, "material": "stone"}},
    "bodies": [{"block": "b", "x": 0, "y": 0.025}],
    "friction": {"block_ground": 0.38},
    "contact": {"restitution": 0},
    "time": {"scheme": "nonsmooth", "end": 0.5, "step": 2e-3},
    "output": {"every": 0.05},
}


def slides(out: Path, members: int = 8, **wanted: Any) -> FragilityAnswer:
    return fragility(SLOPE, TILTS, FRICTION, out=out, **{"members": members, "fails": SLIDES, "jobs": 1, **wanted})


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> FragilityAnswer:
    """Give a study that was run in one go; not to be changed."""
    return slides(tmp_path_factory.mktemp("whole") / "study")


def test_each_member_slides_where_its_own_friction_is_less_than_the_tangent_of_the_tilt(whole: FragilityAnswer) -> None:
    plan = whole.plan
    assert plan is not None
    slopes = [math.tan(math.radians(number)) for number in plan.levels]
    below = [
        sum(float(str(case[MU])) < slope for case in list(plan.cases.design)[i :: len(slopes)])
        for i, slope in enumerate(slopes)
    ]
    assert [point.failures for point in whole.points] == below
    assert [point.members for point in whole.points] == [8] * 5
    assert [(point.low, point.high) for point in whole.points] == [interval(k, 8) for k in below]
    assert isinstance(whole.curve, Curve)
    assert whole.curve.median_interval[0] < math.degrees(math.atan(0.38)) < whole.curve.median_interval[1]
    assert whole.curve.median == pytest.approx(whole.to_dict()["curve"]["median"])  # type: ignore[index]


def test_a_member_depends_on_its_number_and_intensity_alone() -> None:
    def drawn(tilts: list[str], members: int, seed: int = 0, **others: Any) -> dict[tuple[float, int], object]:
        scatter = {**FRICTION, **others}
        plan = read_fragility(Document.from_mapping(SLOPE), {"ground.tilt": tilts}, scatter, members=members, seed=seed)
        numbers = list(plan.levels)
        values = enumerate(case[MU] for case in plan.cases.design)
        return {(numbers[case % len(numbers)], case // len(numbers)): value for case, value in values}

    few, many = (
        drawn(["14 deg", "20 deg"], 4),
        drawn(["23 deg", "0.34906585039886591 rad", "14 deg"], 9, gravity=[9.0, 9.1]),
    )
    assert {place: many[place] for place in few} == few
    assert len(set(many.values())) == len(many)  # no value is common to intensities
    assert not set(drawn(["14 deg"], 4, seed=1).values()) & set(few.values())


def test_more_members_and_another_criterion_do_not_repeat_what_has_run(tmp_path: Path) -> None:
    first = slides(tmp_path, members=3)
    more = slides(tmp_path, members=5)
    assert (first.run, more.run) == (15, 10)
    none = slides(tmp_path, members=5, fails=["turned > 10 deg", "outcome == fell"])
    assert none.run == 0
    assert isinstance(none.curve, NoCurve)
    assert [point.failures for point in none.points] == [0] * 5


def test_shards_in_any_order_give_the_study_that_one_process_gives(tmp_path: Path, whole: FragilityAnswer) -> None:
    parts = [slides(tmp_path, shard=Shard(index, 3)) for index in (2, 0, 1)]
    assert [part.missing for part in parts] == [27, 13, 0]
    assert not (tmp_path / "fragility.csv").exists()
    merged = slides(tmp_path)
    assert (merged.run, merged.missing) == (0, 0)
    for name in ("fragility.csv", "members.csv"):
        assert (tmp_path / name).read_bytes() == (whole.folder / name).read_bytes()


def test_members_whose_runs_fail_count_neither_as_failures_nor_as_survivors(tmp_path: Path) -> None:
    springs = SLOPE | {"time": {"end": 0.01}, "contact": {"restitution": 0, "stiffness_scale": 0.001}}
    limits = {"contact.max_overlap": [1e-2, 1e-12]}
    found = fragility(
        springs, {"ground.tilt": ["10 deg", "20 deg"]}, limits, members=8, fails="moved < 1 m", out=tmp_path
    )
    assert found.failed > 0
    for point in found.points:
        assert point.members + point.no_result == 8
        assert point.failures == point.members


def test_members_that_do_not_come_to_rest_before_time_zero_fail(tmp_path: Path) -> None:
    settled = SLOPE | {"start": {"settle": True}, "time": {"end": 0.01, "scheme": "nonsmooth"}}
    friction = {"friction.block_ground": [0.3, 0.4]}
    found = fragility(
        settled, {"ground.tilt": ["10 deg", "60 deg"]}, friction, members=4, fails="moved > 1 m", out=tmp_path
    )
    assert [(point.members, point.failures, point.no_result) for point in found.points] == [(4, 0, 0), (4, 4, 0)]


def test_survivors_that_move_on_at_the_end_are_counted(tmp_path: Path) -> None:
    found = slides(tmp_path, members=4, fails="moved > 100 m")
    assert sum(point.moving_on for point in found.points) > 0
    assert found.points[-1].moving_on == sum(
        row["moves_on"] in (True, "True") for _, row in _members(tmp_path).iterrows() if row["ground.tilt [deg]"] == 26
    )


def _members(folder: Path) -> Any:
    import pandas as pd  # noqa: PLC0415

    return pd.read_csv(folder / "members.csv")


def test_keys_that_take_whole_numbers_are_drawn_as_such() -> None:
    wall = SLOPE | {
        "bodies": [],
        "structures": [
            {"kind": "wall", "block": "b", "rows": 3, "columns": 3, "gap": "5 mm", "offset": "2 mm", "seed": 0}
        ],
    }
    seeds = {"structures.0.seed": {"from": 1, "to": 4}}
    plan = read_fragility(Document.from_mapping(wall), TILTS, seeds, members=40)
    drawn = [case["structures.0.seed"] for case in plan.cases.design]
    assert all(type(seed) is int for seed in drawn)
    assert np.bincount(drawn)[1:].tolist() == pytest.approx([50] * 4, abs=25)  # type: ignore[arg-type]


def test_the_folder_holds_counts_curve_members_and_scenario(whole: FragilityAnswer) -> None:
    head, first, *_ = (whole.folder / "fragility.csv").read_text().splitlines()
    assert head.startswith("intensity [deg],members,failures,share,low,high,curve,curve_low,curve_high")
    assert first.startswith(f"14.0,8,{whole.points[0].failures},")
    data = json.loads((whole.folder / "fragility.json").read_text())
    assert (data["key"], data["unit"], data["fails"], data["seed"]) == ("ground.tilt", "deg", SLIDES, 0)
    assert data["scatter"] == {MU: {"mean": 0.38, "sd": 0.06}}
    assert [point["failures"] for point in data["points"]] == [point.failures for point in whole.points]
    assert Document.read(whole.folder / "fragility.toml").build().name == "slope"


def test_without_scipy_it_says_what_to_install_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "scipy.special", None)
    with pytest.raises(UnavailableError, match=r"pip install 'blocksim\[study\]'"):
        slides(tmp_path / "study")
    assert not (tmp_path / "study").exists()


@pytest.mark.long
def test_intervals_cover_the_closed_form_through_the_whole_chain(tmp_path: Path) -> None:
    studies, covered, fitted = in_all(100), 0, 0
    truth = [float(norm.cdf((math.tan(math.radians(tilt)) - 0.38) / 0.06)) for tilt in (14, 17, 20, 23, 26)]
    for seed in range(studies):
        found = slides(tmp_path / str(seed), members=24, seed=seed)
        covered += sum(point.low <= p <= point.high for point, p in zip(found.points, truth, strict=True))
        assert isinstance(found.curve, Curve)
        low, high = found.curve.median_interval
        fitted += low <= math.degrees(math.atan(0.38)) <= high
    # four standard deviations
    assert covered / (5 * studies) > 0.95 - 4.0 * math.sqrt(0.95 * 0.05 / (5 * studies))
    assert abs(fitted / studies - 0.95) < 4.0 * math.sqrt(0.95 * 0.05 / studies)


RECORDS = [0.25, 0.29, 0.33, 0.37, 0.41, 0.45]


def test_stripes_have_each_record_once_at_each_intensity_and_wider_intervals(tmp_path: Path) -> None:
    stripes: dict[str, Any] = {"stripes": {MU: RECORDS}, "fails": SLIDES, "jobs": 1}
    found = fragility(SLOPE, TILTS, **stripes, out=tmp_path / "study")
    table = _members(tmp_path / "study")
    assert [sorted(rows[MU]) for _, rows in table.groupby("ground.tilt [deg]")] == [RECORDS] * 5
    assert [point.members for point in found.points] == [6] * 5
    assert found.inflation is not None
    assert found.inflation > 1.5
    both = [found.curve, fit(Counts.of([14, 17, 20, 23, 26], [p.failures for p in found.points], [6] * 5))]
    narrow, wide = sorted(c.median_interval[1] - c.median_interval[0] for c in both if isinstance(c, Curve))
    assert narrow < 0.8 * wide
    assert FragilityAnswer.read(tmp_path / "study").picture_of().band is not None
    twice = fragility(SLOPE, TILTS, {"gravity": [9.8, 9.9]}, **stripes, members=12, out=tmp_path / "twice")
    assert [point.members for point in twice.points] == [12] * 5
    assert twice.to_dict()["records"] == 6


def test_a_median_beyond_what_was_run_is_known_as_such(whole: FragilityAnswer, tmp_path: Path) -> None:
    low = {"ground.tilt": ["14 deg", "17 deg"]}
    found = fragility(SLOPE, low, stripes={MU: [0.2, 0.26, *RECORDS[2:]]}, fails=SLIDES, jobs=1, out=tmp_path / "low")
    assert isinstance(found.curve, Curve)
    assert found.curve.median > 17.0
    assert [one.fitted["median_extrapolated"] for one in (found, whole)] == [True, False]
