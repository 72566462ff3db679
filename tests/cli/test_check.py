"""blocksim check: what a scenario comes to."""

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Command


def test_shipped_scenarios_are_valid(blocksim: Command, shipped: Path) -> None:
    answer = blocksim("check", shipped, "--quiet")
    assert (answer.code, answer.out, answer.err) == (0, "", "")


def test_tables_show_masses_contacts_and_cost_in_80_columns(blocksim: Command) -> None:
    answer = blocksim("check", "scenarios/three_blocks_nominal.toml")
    assert "1      16.00   25.00    32.00    50.00     25.00  0.10887     3.1971e-05" in answer.out
    assert "aluminium - ground     0.38  0.38  0.2" in answer.out
    assert "time step  " in answer.out
    tables = answer.out[answer.out.index("block   x mm") :]
    assert max(map(len, tables.splitlines())) <= 80


def test_resolved_values_can_be_loaded_again(blocksim: Command, tmp_path: Path) -> None:
    answer = blocksim("check", "scenarios/bounce.toml", "--resolved")
    (tmp_path / "again.toml").write_text(answer.out)
    assert blocksim("check", "again.toml", "--quiet").code == 0


def test_blocks_of_two_depths_are_reported_apart(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    other = '\n[blocks.slab]\nwidth = 0.1\nheight = 0.02\nlength = 0.2\nmaterial = "aluminium"\n'
    (tmp_path / "two.toml").write_text(text + other + '[[bodies]]\nblock = "slab"\nx = 1.0\ny = 0.01\n')
    answer = blocksim("check", "two.toml")
    assert "aluminium 50 mm - ground" in answer.out
    assert "aluminium 200 mm - aluminium 50 mm" in answer.out


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


@pytest.fixture
def two_materials(tmp_path: Path) -> str:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    (tmp_path / "two.toml").write_text(text + TWO_MATERIALS)
    return "two.toml"


def test_the_keys_that_decided_are_reported_with_their_pairs(blocksim: Command, two_materials: str) -> None:
    answer = blocksim("check", two_materials)
    told = answer.out[answer.out.index("set by") : answer.out.index("other values")]
    assert told == TOLD.lstrip("\n")
    tables = answer.out[answer.out.index("block  ") :]
    assert max(map(len, tables.splitlines())) <= 80


TOLD = """
set by                            for
────────────────────────────────  ────────────────────────────────
pairs.oak.ground.friction         oak - ground
pairs.aluminium.oak.restitution   oak - aluminium
friction.block_ground             aluminium - ground
contact.restitution.block_ground  aluminium - ground, oak - ground
contact.restitution.block_block   aluminium - aluminium, oak - oak
"""


def test_json_has_the_rule_of_every_cell(blocksim: Command, two_materials: str) -> None:
    pairs = {pair["pair"]: pair for pair in json.loads(blocksim("check", two_materials, "--json").out)["pairs"]}
    assert set(pairs) == {
        "aluminium - ground",
        "aluminium - aluminium",
        "oak - ground",
        "oak - aluminium",
        "oak - oak",
    }
    oak = pairs["oak - ground"]
    assert (oak["static_friction"], oak["kinetic_friction"]) == (pytest.approx(3**-0.5), 0.4)
    assert pairs["oak - aluminium"]["restitution"] == 0.05
    assert oak["rules"] == {
        "friction": "pairs.oak.ground.friction",
        "restitution": "contact.restitution.block_ground",
        "normal_stiffness": "materials",
        "shear_stiffness_ratio": "materials",
        "shear_damping_ratio": "default",
    }


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("contact.law=hertz-mindlin", "K stiffness in N/m^1.5 of one contact point (a face has two)"),
        ("contact.law=linear", "K stiffness in N/m of one contact point (a face has two)"),
        ("contact.model=kernel", "492 particles (wendland-c2, smoothing length 1.30 mm)"),
        ("contact.model=particles", "492 particles (at most 1.00 mm apart)"),
        ("contact.model=particles", "of one contact point (the particles of a face share 2 K)"),
    ],
)
def test_law_and_model_are_reported(blocksim: Command, setting: str, told: str) -> None:
    assert told in blocksim("check", "scenarios/three_blocks_nominal.toml", "--set", setting).out


SHAKEN = '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nduration = "1.5 s"\n'


def test_the_motion_of_the_supports_is_reported(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    (tmp_path / "shaken.toml").write_text(text.replace('end = "0.5 s"', 'end = "2 s"') + SHAKEN)
    answer = blocksim("check", "shaken.toml")
    assert "supports   move at most 10.00 mm and 125.66 mm/s, 0.00 mm/s at the end\n" in answer.out
    assert json.loads(blocksim("check", "shaken.toml", "--json").out)["motion"]["displacement"] == pytest.approx(0.01)


def test_json_has_masses_pairs_and_cost(blocksim: Command) -> None:
    answer = blocksim("check", "scenarios/three_blocks_nominal.toml", "--json")
    data = json.loads(answer.out)
    assert answer.err == ""
    assert data["bodies"][0]["mass"] == pytest.approx(0.10887, rel=1e-4)
    assert data["bodies"][0]["inertia"] == pytest.approx(3.1971e-5, rel=1e-4)
    assert data["pairs"][0]["normal_stiffness"] == pytest.approx(9.478e8, rel=1e-3)
    assert data["steps"] * data["step"] == pytest.approx(2.0, rel=1e-6)
    assert data["scenario"]["contact"]["stiffness_scale"] == 1.0


def test_step_that_is_too_large_is_reported_where_it_stands(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    (tmp_path / "big.toml").write_text(text.replace("[time]\n", '[time]\nstep = "1 ms"\n'))
    answer = blocksim("check", "big.toml")
    assert answer.code == 65
    assert "time.step: 0.001 s is above the largest safe step" in answer.err
    assert '| step = "1 ms"' in answer.err


def test_skin_is_reported_as_it_follows_from_the_blocks_or_as_it_is_given(blocksim: Command) -> None:
    usual = blocksim("check", "scenarios/three_blocks_nominal.toml")
    assert "neighbours checked up to 8 mm apart\n" in usual.out  # a quarter of 32 mm
    given = ("check", "scenarios/three_blocks_nominal.toml", "--set", "contact.skin=0.25 mm")
    assert "neighbours checked up to 0.25 mm apart\n" in blocksim(*given).out
    assert json.loads(blocksim(*given, "--json").out)["skin"] == 2.5e-4


def test_skin_that_a_step_outruns_is_reported_where_it_stands(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    (tmp_path / "thin.toml").write_text(text.replace("[contact]\n", '[contact]\nskin = "5 um"\n'))
    assert blocksim("check", "thin.toml", "--set", "contact.stiffness_scale=1", "--quiet").code == 0
    answer = blocksim("check", "thin.toml", "--set", "contact.stiffness_scale=3e-4")
    assert answer.code == 65
    assert "contact.skin: 0.005 mm is too small for this time step: two blocks that meet at " in answer.err
    assert '| skin = "5 um"' in answer.err


def tables_of(out: str) -> list[str]:
    """Return the lines of all tables; the first is what a person looks for."""
    lines = out.splitlines()
    assert lines[0].startswith("time step  ")
    return lines


def test_a_crowd_of_blocks_is_reported_by_kinds_in_80_columns(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "wall.toml").read_text()
    plate = '\n[blocks.plate]\nwidth = 3\nheight = 0.02\nlength = 0.1\nmaterial = "aluminium"\n'
    above = '[[bodies]]\nblock = "plate"\nx = "1 m"\ny = "2 m"\nfixed = true\n'
    (tmp_path / "crowd.toml").write_text(text + plate + above)
    lines = tables_of(blocksim("check", "crowd.toml").out)
    assert "kind   blocks  along x  upright  depth mm  mass kg  inertia kg m²" in lines
    assert "brick    1000    50.00    25.00     32.00  0.10887     2.8351e-05" in lines
    assert any(line.startswith("plate       1  3000.00    20.00    100.00") for line in lines)
    assert "1001 blocks, 1 of them fixed" in lines
    assert "centres at x 25.00 to 2000.00 mm, y 12.50 to 2000.00 mm" in lines
    assert len(lines) < 40
    assert max(map(len, lines)) <= 80


def test_the_rarest_of_many_kinds_are_only_counted(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    side = 'width = 0.1\nheight = 0.1\nlength = 0.1\nmaterial = "aluminium"\n'
    kinds = "".join(f'\n[blocks.k{i}]\n{side}[[bodies]]\nblock = "k{i}"\nx = {i}\ny = 0.05\n' for i in range(1, 15))
    (tmp_path / "kinds.toml").write_text(text + kinds)
    lines = tables_of(blocksim("check", "kinds.toml").out)
    assert "... and 3 more kinds" in lines


def test_cost_is_reported_in_units_that_people_read(blocksim: Command) -> None:
    lines = blocksim("check", "scenarios/wall.toml", "--set", "time.end=10000", "--set", "output.every=1").out
    assert re.search(
        r"^solving    at most about [0-9.]{3,5} (h|days) on one core, less if it stops at rest$", lines, re.MULTILINE
    )
    assert re.search(r"^memory     about [0-9.]{3,5} MB, of which 210 MB for the program itself$", lines, re.MULTILINE)
    assert "results    at most 10001 frames, about 481 MB\n" in lines


def test_json_of_a_crowd_has_every_block(blocksim: Command) -> None:
    data = json.loads(blocksim("check", "scenarios/wall.toml", "--json").out)
    assert [body["name"] for body in data["bodies"]] == [str(i + 1) for i in range(1000)]
    assert data["memory"] > 210_000_000 > data["bytes"] > 0


def test_rigid_contacts_show_what_their_step_implies_in_80_columns(blocksim: Command) -> None:
    answer = blocksim("check", "scenarios/tower.toml", "--set", "time.scheme=nonsmooth", "--set", "time.step=1 ms")
    assert "sag        142 µm of block 10 at rest; grows with the square of the step" in answer.out
    assert "in 4 substeps, each solved to 1 mm/s; manual limit 4.4e-03 s" in answer.out
    tables = answer.out[answer.out.index("block   x mm") :]
    assert "ζ" not in tables
    assert "stiffness from E" not in tables
    assert max(map(len, tables.splitlines())) <= 80


def test_step_that_is_too_long_for_rigid_contacts_is_shown_where_it_stands(blocksim: Command) -> None:
    answer = blocksim("check", "scenarios/tower.toml", "--set", "time.scheme=nonsmooth", "--set", "time.step=20 ms")
    assert answer.code == 65
    assert answer.err.startswith("--set time.step=20 ms: 0.02 s is too long: blocks could move farther than a tenth")
    forced = ["--set", "time.force_step=true"]
    again = ("check", "scenarios/tower.toml", "--set", "time.scheme=nonsmooth", "--set", "time.step=20 ms", *forced)
    assert blocksim(*again, "--quiet").code == 0


@pytest.mark.parametrize("end", ["5e-324", "1e-310", "1e-300 s"])
def test_an_end_of_next_to_nothing_is_no_internal_error(blocksim: Command, end: str) -> None:
    answer = blocksim("check", "scenarios/three_blocks.toml", "--set", f"time.end={end}")
    assert answer.code in {0, 65}  # the interval of checks was infinite


def test_an_absurd_stiffness_is_no_internal_error(blocksim: Command) -> None:
    settings = ("--set", "materials.aluminium.young_modulus=1e30", "--set", "contact.stiffness_scale=1")
    answer = blocksim("check", "scenarios/three_blocks.toml", *settings)
    assert answer.code == 65
    assert "time.step" in answer.err


def test_friction_angle_without_its_unit_is_warned_of(blocksim: Command) -> None:
    settings = ("scenarios/slide.toml", "--set", "friction.block_ground=30")
    warning = 'warning: friction.block_ground = 30 is a friction coefficient; for an angle write "30 deg"\n'
    assert warning in blocksim("check", *settings).err
    assert warning in blocksim("run", *settings).err
    assert warning in blocksim("sweep", *settings[:1], "--vary", "friction.block_ground=20,30", "--dry-run").err
    assert "warning" not in blocksim("check", *settings[:2], "friction.block_ground=30 deg").err
