"""blocksim check: what a scenario comes to."""

import json
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
    answer = blocksim("check", "scenarios/bounce.toml")
    (tmp_path / "again.toml").write_text(answer.out[: answer.out.index("block  ")])
    assert blocksim("check", "again.toml", "--quiet").code == 0


def test_blocks_of_two_depths_are_told_apart(blocksim: Command, tmp_path: Path) -> None:
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


def test_the_keys_that_decided_are_told_with_their_pairs(blocksim: Command, two_materials: str) -> None:
    answer = blocksim("check", two_materials)
    told = answer.out[answer.out.index("set by") : answer.out.index("where no key")]
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
def test_law_and_model_are_told(blocksim: Command, setting: str, told: str) -> None:
    assert told in blocksim("check", "scenarios/three_blocks_nominal.toml", "--set", setting).out


SHAKEN = '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nduration = "1.5 s"\n'


def test_the_motion_of_the_supports_is_told(blocksim: Command, tmp_path: Path) -> None:
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


def test_step_that_is_too_large_is_told_where_it_stands(blocksim: Command, tmp_path: Path) -> None:
    text = (tmp_path / "scenarios" / "slide.toml").read_text()
    (tmp_path / "big.toml").write_text(text.replace("[time]\n", '[time]\nstep = "1 ms"\n'))
    answer = blocksim("check", "big.toml")
    assert answer.code == 65
    assert "time.step: 0.001 s is above the largest safe step" in answer.err
    assert '| step = "1 ms"' in answer.err
