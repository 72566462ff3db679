"""blocksim check: what a scenario comes to."""

import json
import shlex
from pathlib import Path

import pytest

from blocksim.scenario import scenario_to_toml
from tests.cli.conftest import SCENARIOS, Command
from tests.golden import Golden
from tests.soils import column, scene

NOMINAL = "scenarios/three_blocks_nominal.toml"
SLIDE = (SCENARIOS / "slide.toml").read_text()
SLAB = """
[blocks.slab]
width = 0.1
height = 0.02
length = 0.2
material = "aluminium"
[[bodies]]
block = "slab"
x = 1.0
y = 0.01
"""
TWO_MATERIALS = """
[materials.oak]
density = 700
young_modulus = "11 GPa"
poisson_ratio = 0.3

[blocks.plank]
width = "100 mm"
height = "20 mm"
length = "50 mm"
material = "oak"

[[bodies]]
block = "plank"
x = 1
y = "10 mm"

[pairs.oak.ground]
friction = { static = "30 deg", kinetic = 0.4 }

[pairs.aluminium.oak]
restitution = 0.05
"""
PLATE = """
[blocks.plate]
width = 3
height = 0.02
length = 0.1
material = "aluminium"
[[bodies]]
block = "plate"
x = "1 m"
y = "2 m"
fixed = true
"""
DRIVEN = """motion = { kind = "rotation", angle = "-20 deg", duration = "0.1 s", start = "0.1 s" }
name = "plate"
[[events]]
when = "rest"
free = ["plate"]
[[events]]
at = "0.25 s"
remove = ["block"]
"""
LOADED = (
    """
[[loads]]
kind = "force"
name = "push"
body = "block"
magnitude = "25 kN"
direction = "180 deg"
axes = "body"
history = { kind = "ramp", end = "0.2 s" }
[[loads]]
kind = "moment"
body = "block"
magnitude = "-3 N m"
history = { kind = "steps", times = [0, 0.1], factors = [0, 1] }
[[loads]]
kind = "pressure"
body = "block"
face = "left"
water_level = "10 mm"
[[loads]]
kind = "pressure"
body = "block"
face = "top"
magnitude = "2.5 MPa"
[[loads]]
kind = "horizontal"
magnitude = 0.25
[[loads]]
kind = "gravity"
to = "20 deg"
rate = "100 deg/s"
[[events]]
at = "0.2 s"
unload = ["push"]
[[probes]]
kind = "force"
on = "ground"
by = "block"
every = "step"
[[probes]]
kind = "point"
body = "block"
name = "corner"
every = "2 ms"
"""
    + '[[probes]]\nkind = "energy"\n' * 9
)
SHAKEN = '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nduration = "1.5 s"\n'
CUBE = 'width = 0.1\nheight = 0.1\nlength = 0.1\nmaterial = "aluminium"\n'
KINDS = "".join(f'\n[blocks.k{i}]\n{CUBE}[[bodies]]\nblock = "k{i}"\nx = {i}\ny = 0.05\n' for i in range(1, 15))
MADE = {
    "two_depths.toml": SLIDE + SLAB,
    "two_materials.toml": SLIDE + TWO_MATERIALS,
    "shaken.toml": SLIDE.replace('end = "0.5 s"', 'end = "2 s"') + SHAKEN,
    "crowd.toml": (SCENARIOS / "wall.toml").read_text() + PLATE,
    "kinds.toml": SLIDE + KINDS,
    "loaded.toml": SLIDE + LOADED,
    "driven.toml": SLIDE + PLATE.replace("fixed = true\n", DRIVEN),
}


@pytest.fixture(autouse=True)
def place(tmp_path: Path) -> None:
    """Write scenarios beside those that ship."""
    for name, text in MADE.items():
        (tmp_path / name).write_text(text)


def test_shipped_scenarios_are_valid(blocksim: Command, shipped: Path) -> None:
    answer = blocksim("check", shipped, "--quiet")
    assert (answer.code, answer.out, answer.err) == (0, "", "")


@pytest.mark.parametrize(
    "line",
    [
        NOMINAL,
        f"{NOMINAL} --set contact.law=hertz-mindlin",
        f"{NOMINAL} --set contact.model=kernel",
        f"{NOMINAL} --set contact.model=particles --set 'contact.skin=0.25 mm'",
        "scenarios/tower.toml --set time.scheme=nonsmooth --set 'time.step=1 ms'",
        "scenarios/wall.toml --set time.end=10000 --set output.every=1",
        *MADE,
    ],
    ids=str,
)
def test_tables(blocksim: Command, golden: Golden, line: str) -> None:
    answer = blocksim("check", *shlex.split(line))
    assert answer.code == 0
    assert max(map(len, answer.out.splitlines())) <= 80
    golden(answer.err + answer.out)


def test_resolved_values_can_be_loaded_again(blocksim: Command) -> None:
    Path("again.toml").write_text(blocksim("check", "scenarios/bounce.toml", "--resolved").out)
    assert blocksim("check", "again.toml", "--quiet").code == 0


@pytest.mark.parametrize("line", [NOMINAL, "two_materials.toml", "shaken.toml"])
def test_json(blocksim: Command, golden: Golden, line: str) -> None:
    answer = blocksim("check", line, "--json")
    data = json.loads(answer.out)
    assert (answer.code, answer.err) == (0, "")
    assert data["steps"] * data["step"] == pytest.approx(data.pop("scenario")["time"]["end"], rel=1e-6)
    golden(json.dumps(data, indent=1), rules=["digits"])


def test_json_of_a_crowd_has_every_block(blocksim: Command) -> None:
    data = json.loads(blocksim("check", "scenarios/wall.toml", "--json").out)
    assert [body["name"] for body in data["bodies"]] == [str(i + 1) for i in range(1000)]
    assert data["memory"] > 210_000_000 > data["bytes"] > 0


def test_friction_angle_without_its_unit_is_warned_of(blocksim: Command) -> None:
    settings = ("scenarios/slide.toml", "--set", "friction.block_ground=30")
    warning = 'warning: friction.block_ground = 30 is a friction coefficient; for an angle write "30 deg"\n'
    assert warning in blocksim("check", *settings).err
    assert warning in blocksim("run", *settings).err
    assert warning in blocksim("sweep", *settings[:1], "--vary", "friction.block_ground=20,30", "--dry-run").err
    assert "warning" not in blocksim("check", *settings[:2], "friction.block_ground=30 deg").err


def test_thrust_of_soil_that_is_too_small_is_warned_of_before_and_after_a_run(
    blocksim: Command, tmp_path: Path
) -> None:
    warning = "warning: soils.backfill.gradient: with raw gradients"
    settings = ("scenarios/soil/retaining_wall_stands.toml", "--set", "soils.backfill.gradient=raw")
    assert warning in blocksim("check", *settings).err
    assert "warning" not in blocksim("check", *settings[:1]).err
    told = blocksim("run", *settings, "--set", "time.end=1e-3", "--out", str(tmp_path / "run"))
    assert warning in told.err
    assert warning.removeprefix("warning: ") in (tmp_path / "run" / "run.json").read_text()


def test_a_step_that_one_side_makes_ten_times_shorter_is_told_with_its_cure(blocksim: Command, tmp_path: Path) -> None:
    (tmp_path / "soil.toml").write_text(scenario_to_toml(scene(column(0.05, 0.05, 0.005))))
    told = blocksim("check", "soil.toml").out
    assert "blocks allow" in told
    assert "stiffness_scale" not in told.split("pair")[0]
    told = blocksim("check", "soil.toml", "--set", "materials.soft.young_modulus=6e11").out
    assert "warning: because of the blocks" in told
    assert max(map(len, told.splitlines())) <= 80


@pytest.mark.parametrize(
    ("scheme", "keys"), [("explicit", []), ("nonsmooth", ["time.step", "time.restitution_threshold"])]
)
@pytest.mark.parametrize("size", [1e-4, 1e3])
def test_speeds_left_at_defaults_are_told_where_blocks_are_not_of_centimetres(
    blocksim: Command, size: float, scheme: str, keys: list[str]
) -> None:
    line = ["check", "scenarios/bounce.toml", "--set", f"time.scheme={scheme}"]
    assert "defaults" not in blocksim(*line).out.split("\n\n")[0]
    for key in ("blocks.brick.width", "blocks.brick.height", "blocks.brick.length", "bodies.0.y"):
        line += ["--set", f"{key}={size}"]
    told = " ".join(blocksim(*line).out.split("\n\n")[0].split())
    assert all(key in told for key in ["time.rest_speed", *keys])
    assert ("time.step" in told) == ("time.step" in keys)
    given = {"rest_speed": 1, "rest_hold": 1, "velocity_tolerance": 1, "restitution_threshold": 1, "step": 1e-4}
    for key, value in given.items() if scheme == "nonsmooth" else list(given.items())[:2]:
        line += ["--set", f"time.{key}={value}"]
    assert "defaults" not in blocksim(*line).out.split("\n\n")[0]


def test_a_table_outside_is_refused_unless_asked_for(blocksim: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "three_blocks.toml").read_text(encoding="utf-8")
    table = SCENARIOS / "experiments" / "three_blocks.csv"
    (tmp_path / "mine").mkdir()
    scenario = tmp_path / "mine" / "case.toml"
    scenario.write_text(text.replace("experiments/three_blocks.csv", str(table)), encoding="utf-8")
    refused = blocksim("check", scenario, "--quiet")
    assert refused.code == 65
    line = 1 + text[: text.index("experiments/three_blocks.csv")].count("\n")
    assert f"case.toml:{line}: experiment.table" in refused.err
    assert "--allow-outside" in refused.err
    assert blocksim("check", scenario, "--quiet", "--allow-outside").code == 0
    assert blocksim("check", scenario, "--quiet").code == 65, "asked for once, allowed ever after"
