"""Static limits as a study: exact bounds of loads, brackets of other keys, folder, picture, repetition, refusals."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from blocksim import plot, static_limit
from blocksim.errors import ExitCode, InvalidInputError
from blocksim.study.answer import study_in
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
    assert any("(statics)" in line for line in found.overview().lines)
    scanned = limit(slab(), vary, out=tmp_path / "scan", tolerance=0.5, scan=3, keep_runs=False, stiffer=False)
    assert scanned.static_bound is None
    assert {0.0, 1.0, 2.0} <= set(scanned.rows)


def test_where_blocks_slide_runs_begin_at_the_estimate_and_fall_far_below_the_bound(tmp_path: Path) -> None:
    """Four courses with a door in the middle; the lintel has whole stones on both sides of the door below it."""
    door = {"left": 0.2, "width": 0.2, "height": 0.2, "lintel": 0.4}
    wall = {"kind": "wall", "block": "b", "rows": 4, "columns": 3, "ends": "flush", "openings": [door]}
    scenario = slab(
        blocks={"b": {"width": 0.2, "height": 0.1, "length": 1.0, "material": "stone"}},
        bodies=[],
        structures=[wall],
        friction={"block_block": 0.8, "block_ground": 0.8},
        loads=[{"kind": "horizontal", "name": "push", "magnitude": 0.1}],
        contact={"restitution": 0.0},
    )
    vary = {PUSH: {"from": 0.0, "to": 1.2}}
    (static,) = static_limit(scenario, vary, out=tmp_path / "static").limits
    found = limit(scenario, vary, out=tmp_path / "runs", tolerance=0.01, keep_runs=False)
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
