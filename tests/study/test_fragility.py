"""Fragility by real runs: a closed form for every member, draws, resuming, shards, and what lies in the folder."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from blocksim.analysis.compare import interval
from blocksim.analysis.lognormal import Counts, Curve, NoCurve, fit
from blocksim.errors import InvalidInputError
from blocksim.scenario import Document
from blocksim.study.fragility import FragilityAnswer, fragility, read_fragility
from blocksim.study.manifest import Shard
from blocksim.study.pictures import plot
from blocksim.study.report import report
from tests.study.plans import MU, SCATTER, SLIDES, SLOPE, TILT, TILTS


def slides(out: Path, members: int = 8, **wanted: Any) -> FragilityAnswer:
    return fragility(SLOPE, TILTS, SCATTER, out=out, **{"members": members, "fails": SLIDES, "jobs": 1, **wanted})


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
        scatter = {**SCATTER, **others}
        plan = read_fragility(Document.from_mapping(SLOPE), {TILT: tilts}, scatter, members=members, seed=seed)
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
    tilts = {TILT: ["10 deg", "20 deg"]}
    found = fragility(springs, tilts, limits, members=8, fails="moved < 1 m", out=tmp_path / "springs")
    assert found.failed > 0
    for point in found.points:
        assert point.members + point.no_result == 8
        assert point.failures == point.members
    settled = SLOPE | {"start": {"settle": True}, "time": {**SLOPE["time"], "end": 0.01}}
    tilts, friction = {TILT: ["10 deg", "60 deg"]}, {MU: [0.3, 0.4]}  # the second one does not come to rest before zero
    found = fragility(settled, tilts, friction, members=4, fails="moved > 1 m", out=tmp_path / "settled")
    assert [(point.members, point.failures, point.no_result) for point in found.points] == [(4, 0, 0), (4, 4, 0)]


def test_survivors_that_move_on_at_the_end_are_counted(tmp_path: Path) -> None:
    found = slides(tmp_path, members=4, fails="moved > 100 m")
    assert sum(point.moving_on for point in found.points) > 0
    steepest = pd.read_csv(tmp_path / "members.csv").query("`ground.tilt [deg]` == 26")
    assert found.points[-1].moving_on == steepest["moves_on"].astype(str).eq("True").sum()


def test_keys_that_take_whole_numbers_are_drawn_as_such() -> None:
    wall = {"kind": "wall", "block": "b", "rows": 3, "columns": 3, "gap": "5 mm", "offset": "2 mm", "seed": 0}
    document = Document.from_mapping(SLOPE | {"bodies": [], "structures": [wall]})
    plan = read_fragility(document, TILTS, {"structures.0.seed": {"from": 1, "to": 4}}, members=40)
    drawn = [case["structures.0.seed"] for case in plan.cases.design]
    assert all(type(seed) is int for seed in drawn)
    assert np.bincount(drawn)[1:].tolist() == pytest.approx([50] * 4, abs=25)  # type: ignore[arg-type]


def test_the_picture_has_the_counts_and_the_curve_of_the_result(whole: FragilityAnswer, tmp_path: Path) -> None:
    found = FragilityAnswer.read(whole.folder).picture_of()
    assert whole.plan is not None
    assert found.x.tolist() == list(whole.plan.levels)
    assert found.share.tolist() == [point.share for point in whole.points]
    assert list(zip(found.low, found.high, strict=True)) == [(point.low, point.high) for point in whole.points]
    assert found.band is not None
    curve = whole.probability(found.band.x)
    assert curve is not None
    assert found.band.probability == pytest.approx(curve)
    assert "median 21.7" in found.notes[0]
    assert plot(whole, out=tmp_path / "picture.png").stat().st_size > 0
    assert 'src="data:image/png;base64,' in report(whole.folder, out=tmp_path / "study.html").read_text()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"points": "none"}, "not the answer of a fragility study"),
        ({"points": []}, "no sample of this study has a result"),
    ],
)
def test_a_damaged_answer_is_told(whole: FragilityAnswer, tmp_path: Path, change: dict[str, object], why: str) -> None:
    data = json.loads((whole.folder / "fragility.json").read_text())
    (tmp_path / "fragility.json").write_text(json.dumps({**data, **change}))
    (tmp_path / "fragility.toml").write_bytes((whole.folder / "fragility.toml").read_bytes())
    with pytest.raises(InvalidInputError, match=why):
        plot(tmp_path, out=tmp_path / "picture.png")
    assert not (tmp_path / "picture.png").exists()


RECORDS = [0.25, 0.29, 0.33, 0.37, 0.41, 0.45]


def test_stripes_have_each_record_once_at_each_intensity_and_wider_intervals(tmp_path: Path) -> None:
    stripes: dict[str, Any] = {"stripes": {MU: RECORDS}, "fails": SLIDES, "jobs": 1}
    found = fragility(SLOPE, TILTS, **stripes, out=tmp_path / "study")
    table = pd.read_csv(tmp_path / "study" / "members.csv")
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
    low = {TILT: ["14 deg", "17 deg"]}
    found = fragility(SLOPE, low, stripes={MU: [0.2, 0.26, *RECORDS[2:]]}, fails=SLIDES, jobs=1, out=tmp_path / "low")
    assert isinstance(found.curve, Curve)
    assert found.curve.median > 17.0
    assert [one.fitted["median_extrapolated"] for one in (found, whole)] == [True, False]
