"""blocksim limit: what it prints, its exit codes, and a kill."""

import json
import math
import re
import shutil
import types
from pathlib import Path

import pytest

from blocksim.scenario import scenario_from_mapping, scenario_to_toml
from tests.cli.conftest import Command
from tests.golden import Golden
from tests.study.test_limit import SLENDER, block_on_a_slope

WALL = ("limit", "scenarios/tilting_wall.toml")
TILT = ("--vary", "ground.tilt=20deg:40deg")
FELL = ("--stands", "outcome != fell")
ROUGHER = ("--to", "20%", "--no-runs", "--out", "out")


def test_the_dry_wall_falls_where_limit_analysis_says_in_at_most_25_runs(blocksim: Command, golden: Golden) -> None:
    answer = blocksim(*WALL, *TILT, *FELL, "--out", "out")
    assert answer.code == 0
    assert answer.err.endswith("picture of the mechanism: blocksim plot out\n")
    title, _, heads, *_ = lines = answer.out.splitlines()
    golden(f"{title}\n{heads}")
    assert lines[-1].startswith("stands up to 32.")
    data = json.loads(blocksim(*WALL, *TILT, *FELL, "--out", "out", "--json").out)
    assert data[0]["runs"] <= 25
    (change,) = data[0]["changes"]
    assert 32.37 < change["low"] < change["high"] < 32.74  # atan 0.634 to atan 0.643


def test_both_laws_are_compared(blocksim: Command, golden: Golden) -> None:
    soft = ("--set", "contact.stiffness_scale=0.001", "--set", "time.end=0.25 s", "--set", "start.settle=true")
    answer = blocksim(*WALL, "--vary", "ground.tilt=0 deg:40 deg:3", *ROUGHER, "--both-laws", *soft)
    assert answer.code == 0
    changes = [
        json.loads(Path(f"out/{law}/limit.json").read_text())["changes"] for law in ("springs", "rigid-contacts")
    ]
    springs, rigid = (change["low"] + change["high"] for (change,) in changes)
    assert f"rigid contacts against springs: {rigid / springs - 1.0:+.2%} (middles of the brackets)\n" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80
    assert {path.name for path in Path("out").iterdir()} == {"springs", "rigid-contacts"}
    golden("\n".join(line for line in answer.err.splitlines() if line.startswith("warning: ")))


def on_soft_springs() -> dict[str, object]:
    """Return a slender block on springs, whose toe sinks in by 0.03 of its width before it topples."""
    width, height = 0.1, 0.2
    weight = 2500 * width * height * 9.81  # of 1 m
    return {
        "schema": 1,
        "name": "soft",
        "materials": {"stone": {"density": 2500, "young_modulus": "30 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": width, "height": height, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.5 * height}],
        "friction": {"block_ground": 2.0},
        "contact": {"restitution": 0.0, "normal_stiffness": weight / (0.03 * width)},
        "start": {"settle": True},
        "time": {"end": 0.5, "safety": 0.1},
    }


def test_springs_that_give_way_are_extrapolated_to_stiff_contacts_unless_wanted_as_given(
    blocksim: Command, tmp_path: Path
) -> None:
    (tmp_path / "soft.toml").write_text(scenario_to_toml(scenario_from_mapping(on_soft_springs())))
    limit = ("limit", "soft.toml", "--vary", "ground.tilt=24.8deg:26.6deg:2", "--to", "2%", "--no-runs", "--out", "out")
    stiff = math.degrees(math.atan(0.5))
    given = blocksim(*limit, "--as-given")
    (soft,) = re.findall(r"^stands up to (\S+) deg", given.out, re.MULTILINE)
    assert stiff - float(soft) == pytest.approx(1.55, abs=0.3)  # 0.03 rad cos(tilt), on one corner
    (told,) = re.findall(r"the limit is off by some (\S+)%; leave --as-given out", given.err)
    assert float(told) == pytest.approx(6.0, rel=0.15)
    answer = blocksim(*limit)  # the same folder: what was run is not run again
    assert "warning" not in answer.err
    runs, now = map(int, re.findall(r"(\d+) runs, (\d+) of them now", answer.err)[0])
    assert runs - now == int(re.findall(r"(\d+) runs", given.err)[0])
    scales = re.findall(r"^stiffness scale (\S+): .* \((\S+)%\)$", answer.out, re.MULTILINE)
    assert [one for one, _ in scales] == ["1", "10"]
    assert [float(off) for _, off in scales] == pytest.approx([-6.0, -0.6], abs=0.7)
    low, high = re.findall(r"^stands up to (\S+) deg, falls from (\S+) deg", answer.out, re.MULTILINE)[-1]
    assert float(low) < stiff < float(high)
    assert float(high) - float(low) < 0.025 * stiff
    (change,) = json.loads((tmp_path / "out" / "limit.json").read_text())["changes"]
    assert change["low"] == pytest.approx(float(low), rel=1e-6)
    assert change["below"]["value"] == pytest.approx(float(soft), rel=1e-6)
    assert blocksim("report", "out").code == 0
    assert "extrapolated with 1/stiffness" in Path("report.html").read_text()


def test_the_mechanism_of_a_limit_is_drawn_also_where_its_load_falls_before_time_zero(
    blocksim: Command, tmp_path: Path
) -> None:
    for settles in (True, False):
        scene = {**block_on_a_slope(SLENDER), "start": {"settle": settles}}
        (tmp_path / "slender.toml").write_text(scenario_to_toml(scenario_from_mapping(scene)))
        folder = f"settles-{settles}"
        rough = ("--vary", "ground.tilt=5deg:30deg:2", "--to", "90%", *FELL, "--out", folder)
        answer = blocksim("limit", "slender.toml", *rough)
        assert "\nstands up to " in answer.out
        assert f"\npicture of the mechanism: blocksim plot {folder}" in answer.err
        assert ("start.settle = false: loads that come at once shift limits" in answer.err) is not settles
        (change,) = json.loads(Path(folder, "limit.json").read_text())["changes"]
        assert change["above"]["outcome"] == "fell"
        assert blocksim("plot", folder).code == 0


def test_full_disk_is_74_and_not_a_limit_without_its_runs(
    blocksim: Command, tmp_path: Path, small_disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "slope.toml").write_text(scenario_to_toml(scenario_from_mapping(block_on_a_slope(SLENDER))))
    search = ("limit", "slope.toml", "--vary", "ground.tilt=5deg:40deg:2", "--to", "50%", "--out", small_disk / "out")
    room = shutil.disk_usage(small_disk).free
    (small_disk / "others").write_bytes(bytes(room - 200_000))
    roomy = types.SimpleNamespace(free=10**9)  # as if others filled it while the search runs
    with monkeypatch.context() as patch:
        patch.setattr("shutil.disk_usage", lambda _: roomy)
        answer = blocksim(*search)
    assert answer.code == 74
    assert "No space left on device; the limit is found, its runs are not kept" in answer.err
    (change,) = json.loads((small_disk / "out" / "limit.json").read_text())["changes"]
    (small_disk / "others").unlink()
    answer = blocksim(*search)
    assert answer.code == 0
    assert ", 0 of them now" in answer.err
    (again,) = json.loads((small_disk / "out" / "limit.json").read_text())["changes"]
    assert (again["low"], again["high"]) == (change["low"], change["high"])
    assert (small_disk / "out" / "cases" / again["below"]["case"] / "done.json").is_file()
