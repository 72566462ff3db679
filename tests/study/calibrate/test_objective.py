"""The objective of a calibration: probability first, guidance where it is the same all around."""

import itertools
import math

import pytest
from scipy.stats import binomtest

from blocksim.study.calibrate_search import Score, hits_of, miss_of, score_of
from blocksim.study.executors.ensemble import Member
from blocksim.study.rows import Range

RANGES = (Range("1", "x_mm", 10.0, 14.0), Range("2", "rotation_deg", -95.0, -85.0))


def member(x: float, rotation: float = -90.0) -> Member:
    return Member({"block": ["1", "2"], "x_mm": [x, 0.0], "rotation_deg": [0.0, rotation]})


def test_interval_is_the_one_that_sweeps_are_judged_with() -> None:
    exact = binomtest(301, 512).proportion_ci(method="exact")
    score = Score(members=512, inside=301, failed=0, miss=0.0)
    assert score.interval == pytest.approx((exact.low, exact.high), abs=1e-9)
    assert score.interval[0] < score.share_inside < score.interval[1]


def test_miss_is_zero_at_the_limit_and_grows_steadily_outwards() -> None:
    places = [12.0, 13.0, 13.9, 14.0, 14.1, 16.0, 50.0, 1e9]
    misses = [miss_of([x, -90.0], RANGES) for x in places]
    assert misses == sorted(misses)
    assert misses[0] == -1.0
    assert misses[3] == 0.0
    assert 0.0 < misses[4] < 0.05
    assert misses[-1] < 1.0
    assert miss_of([16.0, -90.0], RANGES) == pytest.approx(0.25)  # twice the half-width: (1 - 1/2) of one in two


def test_limits_count_as_inside_in_spite_of_rounding() -> None:
    narrow = Range("1", "x_mm", 71.69, 78.53)
    for value in (71.69, 78.53):
        assert miss_of([value], (narrow,)) <= 0.0
    for value in (math.nextafter(71.69, 0.0), math.nextafter(78.53, 100.0)):
        assert miss_of([value], (narrow,)) > 0.0


def test_probability_is_never_outweighed_by_guidance() -> None:
    kinds = [member(12.0), member(13.99), member(14.01), member(1e6), Member(None, "failed")]
    scores = [score_of(chosen, RANGES) for chosen in itertools.combinations_with_replacement(kinds, 3)]
    for one, other in itertools.permutations(scores, 2):
        if one.inside > other.inside:
            assert one.value > other.value


def test_guidance_tells_ensembles_without_a_hit_apart() -> None:
    near, far = (score_of([member(x), member(x + 1.0)], RANGES) for x in (15.0, 25.0))
    assert near.share_inside == far.share_inside == 0.0
    assert near.value > far.value


def test_failed_members_count_as_outside_and_are_reported() -> None:
    score = score_of([member(12.0), Member(None, "overlap"), member(math.nan)], RANGES)
    assert (score.members, score.inside, score.failed) == (3, 1, 2)
    assert score.share_inside == pytest.approx(1 / 3)


def test_each_quantity_is_reported_by_itself() -> None:
    members = [member(12.0, 0.0), member(20.0), member(22.0), Member(None, "overlap")]
    x, rotation = hits_of(members, RANGES)
    assert (x.median, x.share_inside) == (20.0, 0.25)
    assert (rotation.median, rotation.share_inside) == (-90.0, 0.5)
    (nothing, _) = hits_of(members[3:], RANGES)
    assert math.isnan(nothing.median)
    assert nothing.share_inside == 0.0
