"""How ensembles are scored, and the search that continues where it was stopped."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.study.calibrate_plan import FIRST, Prior, Score, Trial, hits_of, miss_of, open_journal, score_of, search
from blocksim.study.executors.ensemble import Member
from blocksim.study.rows import Range

RANGES = (Range("1", "x_mm", 10.0, 14.0), Range("2", "rotation_deg", -95.0, -85.0))


def member(x: float, rotation: float = -90.0) -> Member:
    return Member({"block": ["1", "2"], "x_mm": [x, 0.0], "rotation_deg": [0.0, rotation]})


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
    narrow = (Range("1", "x_mm", 71.69, 78.53),)
    assert max(miss_of([value], narrow) for value in (71.69, 78.53)) <= 0.0
    assert min(miss_of([math.nextafter(at, to)], narrow) for at, to in ((71.69, 0.0), (78.53, 100.0))) > 0.0


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


PRIORS = (Prior("a", 0.0, 1.0), Prior("b", 10.0, 20.0, "mm"))
PLAN = {"scenario": "one", "seed": 3}


def hill(values: Mapping[str, object]) -> Score:
    """Return a probability of 1 near (0.3, 17 mm), 0 elsewhere; the miss grows with the distance."""
    a, b = (prior.number(values[prior.key]) for prior in PRIORS)
    off = max(abs(a - 0.3), abs(b - 17.0) / 10.0)
    inside = 8 if off < 0.05 else 0
    return Score(8, inside, 0, off)


def made(
    journal: Path, trials: int, seed: int = 3, evaluate: Callable[[Mapping[str, object]], Score] = hill
) -> list[Trial]:
    with open_journal(journal, PLAN) as study:
        return list(search(PRIORS, evaluate, study, trials=trials, seed=seed))


class KilledError(Exception):
    pass


def dies_after(count: int) -> Callable[[Mapping[str, object]], Score]:
    calls: Iterator[int] = iter(range(count))

    def evaluate(values: Mapping[str, object]) -> Score:
        if next(calls, None) is None:
            raise KilledError
        return hill(values)

    return evaluate


def test_finds_a_small_region_and_never_leaves_the_priors(tmp_path: Path) -> None:
    trials = made(tmp_path / "journal", 60)
    assert [trial.number for trial in trials] == list(range(1, 61))
    assert max(trial.score.share_inside for trial in trials) == 1.0
    for trial in trials:
        for prior in PRIORS:
            assert prior.low <= prior.number(trial.values[prior.key]) <= prior.high
    late = [trial.score.inside for trial in trials[-20:]]
    assert sum(late) > 3 * sum(trial.score.inside for trial in trials[:20])  # it learns


@pytest.mark.parametrize("killed_after", [0, FIRST, FIRST + 6])
def test_search_that_died_continues_as_if_it_had_not(tmp_path: Path, killed_after: int) -> None:
    expected = made(tmp_path / "whole", FIRST + 8)
    with pytest.raises(KilledError):
        made(tmp_path / "cut", FIRST + 8, evaluate=dies_after(killed_after))
    counted: list[object] = []

    def evaluate(values: Mapping[str, object]) -> Score:
        counted.append(values)
        return hill(values)

    assert made(tmp_path / "cut", FIRST + 8, evaluate=evaluate) == expected
    assert len(counted) == FIRST + 8 - killed_after


def test_longer_search_begins_as_a_shorter_one(tmp_path: Path) -> None:
    short = made(tmp_path / "short", FIRST + 2)
    assert made(tmp_path / "long", FIRST + 6)[: FIRST + 2] == short
    assert made(tmp_path / "short", FIRST + 6) == made(tmp_path / "long", FIRST + 6)
    assert made(tmp_path / "other", 1, seed=4)[0] != short[0]


def test_torn_last_line_is_forgotten(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    expected = made(journal, 4)
    with journal.open("ab") as file:
        file.write(b'{"op_code":4,"wor')
    assert made(journal, 6)[:4] == expected


def test_journal_of_another_plan_is_refused_and_kept(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    made(journal, 2)
    before = journal.read_bytes()
    with (
        pytest.raises(OutputExistsError, match=r"another calibration \(scenario differ"),
        open_journal(journal, {**PLAN, "scenario": "two"}),
    ):
        pass
    assert journal.read_bytes() == before


def test_two_at_once_are_refused(tmp_path: Path) -> None:
    @contextmanager
    def second() -> Iterator[None]:
        with open_journal(tmp_path / "journal", PLAN):
            yield

    with second(), pytest.raises(OutputExistsError, match="another calibration is running here"), second():
        pass


@pytest.mark.parametrize("content", [b"not a journal\n", b"[1, 2]\n", b'{"op_code": 4}\n', b"\xff\xfe\n"])
def test_file_that_is_no_journal_is_refused_and_kept(tmp_path: Path, content: bytes) -> None:
    journal = tmp_path / "journal"
    journal.write_bytes(content)
    with pytest.raises(InvalidInputError, match="not the journal of a calibration"), open_journal(journal, PLAN):
        pass
    assert journal.read_bytes() == content
