"""Static limits as a study: exact bounds of loads, brackets of other keys, folder, picture, repetition, refusals."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from blocksim import plot, static_limit
from blocksim.errors import ExitCode, InvalidInputError
from blocksim.study.answer import study_in
from blocksim.study.criterion import Stability
from blocksim.study.limit import limit
from blocksim.study.static_limit import NONE, POSSIBLE
from blocksim.study.sweep import Replay

STONE = {"density": 2000.0, "young_modulus": 1e10, "poisson_ratio": 0.2}
PUSH = "loads.push.magnitude"


def slab(**tables: Any) -> dict[str, Any]:
    """Return a block of 0.2 x 0.4 m and 1 m, 1569.6 N at 9.81 m/s2, pushed at its centre."""
    return {
        "schema": 1,
        "name": "slab",
        "gravity": 9.81,
        "materials": {"stone": STONE},
        "blocks": {"b": {"width": 0.2, "height": 0.4, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.2}],
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "loads": [{"kind": "force", "name": "push", "body": "1", "magnitude": 10.0}],
        "time": {"scheme": "nonsmooth", "end": 1.0},
        **tables,
    }


def test_a_load_has_the_exact_bound_on_both_sides_and_a_range_with_one_side_has_that(tmp_path: Path) -> None:
    topple = 0.5 * 0.2 * 0.4 * 2000.0 * 9.81
    both = static_limit(slab(), {PUSH: {"from": "-1 kN", "to": "2 kN"}}, out=tmp_path / "both")
    assert both.is_linear
    below, above = both.limits
    assert (below.bound, above.bound) == pytest.approx((-1e-3 * topple, 1e-3 * topple), rel=1e-9)
    assert (below.below, below.above, above.below, above.above) == (NONE, POSSIBLE, POSSIBLE, NONE)
    one = static_limit(slab(), {PUSH: {"from": "0 kN", "to": "2 kN"}}, out=tmp_path / "one")
    assert [limit.bound for limit in one.limits] == [above.bound]
    none = static_limit(slab(), {PUSH: {"from": "0 kN", "to": "0.5 kN"}}, out=tmp_path / "none")
    assert (none.limits, none.overview().code) == ((), ExitCode.OUTSIDE)


LOCKED = "statics sets no bound in this range: an equilibrium is possible at all values of the range"
EARLIER = "joints that slip without opening may give way earlier"
RUNS_DECIDE = "whether a possible equilibrium is reached from rest, runs decide: leave --static out"


def slot(**tables: Any) -> dict[str, Any]:
    """Return a block of 1569.6 N between the ground and a fixed lid that touches it, pushed at its centre."""
    size = {"width": 0.4, "height": 0.2, "length": 1.0, "material": "stone"}
    lid = {"block": "b", "x": 0.0, "y": 0.3, "fixed": True}
    return slab(
        blocks={"b": size},
        bodies=[{"block": "b", "x": 0.0, "y": 0.1}, lid],
        friction={"block_block": 0.4, "block_ground": 0.4},
        **tables,
    )


def test_joints_that_are_locked_as_they_would_have_to_open_are_no_bound_but_have_an_estimate(tmp_path: Path) -> None:
    """The block slides at 0.4 of its weight: that it cannot rise makes no friction, but would make a bound infinite."""
    slides = 1e-3 * 0.4 * 0.4 * 0.2 * 2000.0 * 9.81
    for low, expected in (("0 kN", [slides]), ("-80 kN", [-slides, slides]), ("1 kN", [])):
        found = static_limit(slot(), {PUSH: {"from": low, "to": "70 kN"}}, out=tmp_path / low)
        assert found.estimates == pytest.approx(expected, rel=2e-3)
        answer = found.overview()
        assert (found.limits, answer.code, answer.lines[0]) == ((), ExitCode.OUTSIDE, LOCKED)
        assert answer.lines[1].startswith(EARLIER)
        assert ("estimate" in answer.lines[1]) == bool(expected)
        assert RUNS_DECIDE in answer.notes


def door() -> dict[str, Any]:
    """Four courses with a door in the middle; the lintel has whole stones on both sides of the door below it."""
    opening = {"left": 0.2, "width": 0.2, "height": 0.2, "lintel": 0.4}
    wall = {"kind": "wall", "block": "b", "rows": 4, "columns": 3, "ends": "flush", "openings": [opening]}
    return slab(
        blocks={"b": {"width": 0.2, "height": 0.1, "length": 1.0, "material": "stone"}},
        bodies=[],
        structures=[wall],
        friction={"block_block": 0.8, "block_ground": 0.8},
        loads=[{"kind": "horizontal", "name": "push", "magnitude": 0.1}],
        contact={"restitution": 0.0},
    )


def test_an_estimate_within_the_range_is_given_where_the_bound_is_beyond_it(tmp_path: Path) -> None:
    found = static_limit(door(), {PUSH: {"from": 0.0, "to": 0.5}}, out=tmp_path / "door")
    assert (found.limits, found.overview().lines[0]) == ((), LOCKED)
    assert found.estimates == pytest.approx((1.0 / 3.0,), rel=1e-3)
    (limit,) = static_limit(door(), {PUSH: {"from": 0.0, "to": 1.2}}, out=tmp_path / "more").limits
    assert limit.bound > 0.55


def island(x: float) -> dict[str, Any]:
    """Return a slab on a fixed pier of 20 mm, its centre at x (m)."""
    pier = {"width": 0.02, "height": 1.0, "length": 1.0, "material": "stone"}
    cap = {"width": 1.0, "height": 0.2, "length": 1.0, "material": "stone"}
    bodies = [{"block": "pier", "x": 0.0, "y": 0.5, "fixed": True}, {"block": "cap", "x": x, "y": 1.1}]
    return slab(blocks={"pier": pier, "cap": cap}, bodies=bodies, loads=[])


@pytest.mark.parametrize(("low", "high"), [("-0.5 m", "0.47 m"), ("-0.45 m", "0.45 m"), ("-0.5 m", "0.0625 m")])
def test_an_equilibrium_between_two_values_of_the_scan_is_found_where_the_least_is_missing(
    low: str, high: str, tmp_path: Path
) -> None:
    """Between -10 and 10 mm; of two values that are as far from it neither is passed by."""
    found = static_limit(island(0.0), {"bodies.1.x": {"from": low, "to": high, "count": 8}}, out=tmp_path / "island")
    ends = [(limit.low, limit.high) for limit in found.limits]
    assert [0.5 * sum(end) for end in ends] == pytest.approx([-0.01, 0.01], abs=1e-5)
    assert any("may be missed: --scan N" in note for note in found.overview().notes)


def test_no_equilibrium_anywhere_is_said_of_the_values_that_were_tried(tmp_path: Path) -> None:
    found = static_limit(island(0.0), {"bodies.1.x": {"from": "0.02 m", "to": "0.4 m", "count": 4}}, out=tmp_path)
    assert found.overview().lines == [f"no equilibrium at all {len(found.cells)} values that were tried"]


def test_a_value_at_which_statics_has_no_answer_is_named(tmp_path: Path) -> None:
    vary = {"bodies.1.x": {"from": "0.4 m", "to": "0.6 m"}}
    with pytest.raises(InvalidInputError, match=r"^bodies\.1\.x = 0\.6 m: statics: block 2 rests on nothing"):
        static_limit(island(0.0), vary, out=tmp_path / "refused")


def test_a_tilt_is_bracketed_to_a_millionth_and_its_folder_is_drawn_and_repeated(tmp_path: Path) -> None:
    place = tmp_path / "tilt"
    found = static_limit(slab(loads=[]), {"ground.tilt": {"from": "5 deg", "to": "45 deg"}}, out=place)
    (change,) = found.limits
    assert not found.is_linear
    assert change.low <= math.degrees(math.atan(0.5)) <= change.high
    assert change.high - change.low < 2e-6 * change.high
    written = json.loads((place / "static.json").read_text())
    assert written["limits"][0]["joints"][0]["margin_m"] == pytest.approx(0.0, abs=1e-6)
    assert (place / "static.csv").read_text().startswith("value [deg],verdict")
    study = study_in(place)
    assert study is not None
    assert study.answer.read(place).to_dict() == found.to_dict()
    again = study.repeat(study.answer.read(place), Replay.of(place), tmp_path / "again")
    assert again.to_dict()["limits"] == found.to_dict()["limits"]
    picture = plot(place, out=tmp_path / "thrust.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_limit_of_runs_begins_at_the_bound_and_says_it_and_a_scan_is_made_where_it_is_asked_for(
    tmp_path: Path,
) -> None:
    vary = {PUSH: {"from": "0 kN", "to": "2 kN"}}
    found = limit(slab(), vary, out=tmp_path / "near", tolerance=0.01, keep_runs=False)
    topple = 1e-3 * 0.5 * 0.2 * 0.4 * 2000.0 * 9.81
    assert found.static_bound == pytest.approx(topple, rel=1e-9)
    assert found.brackets[0].low <= topple * 1.01
    assert found.brackets[0].high >= topple * 0.99
    assert found.runs <= 6
    bound = f"no equilibrium above {topple:.7g} kN (statics)"
    assert bound in found.overview().lines
    (bracket,) = found.brackets  # runs that fall below and stand above would make no other bound of it
    sides = {"below": bracket.below.model_copy(update={"verdict": Stability.FALLS})}
    sides["above"] = bracket.above.model_copy(update={"verdict": Stability.STANDS})
    wedged = found.model_copy(update={"brackets": (bracket.model_copy(update=sides),)})
    assert bound in wedged.overview().lines
    scanned = limit(slab(), vary, out=tmp_path / "scan", tolerance=0.5, scan=3, keep_runs=False, stiffer=False)
    assert scanned.static_bound is None
    assert {0.0, 1.0, 2.0} <= set(scanned.rows)


def test_where_blocks_slide_runs_begin_at_the_estimate_and_fall_far_below_the_bound(tmp_path: Path) -> None:
    vary = {PUSH: {"from": 0.0, "to": 1.2}}
    (static,) = static_limit(door(), vary, out=tmp_path / "static").limits
    found = limit(door(), vary, out=tmp_path / "runs", tolerance=0.01, keep_runs=False)
    assert static.estimate is not None
    assert static.estimate == pytest.approx(1.0 / 3.0, rel=1e-3)
    assert static.bound > 0.55
    (bracket,) = found.brackets
    assert 0.98 * static.estimate < bracket.low < bracket.high < 1.02 * static.estimate
    assert found.runs <= 10  # a scan begins with nine


def test_scenes_that_statics_cannot_judge_are_refused_with_the_reason_and_searched_by_runs(tmp_path: Path) -> None:
    ramp = {"kind": "ramp", "start": 0.0, "end": 1.0}
    loads = [{"kind": "force", "name": "push", "body": "1", "magnitude": 10.0, "history": ramp}]
    vary = {PUSH: {"from": "0 kN", "to": "2 kN"}}
    with pytest.raises(InvalidInputError, match="statics: load push changes with time"):
        static_limit(slab(loads=loads), vary, out=tmp_path / "refused")
    assert not (tmp_path / "refused").exists()
    found = limit(slab(loads=loads), vary, out=tmp_path / "runs", tolerance=0.5, scan=None, keep_runs=False)
    assert found.static_bound is None
    assert len(found.limits) == 1
