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
