"""blocksim converge: tables, verdicts, picture and exit codes."""

import json
import signal
import time
from pathlib import Path

import pytest
from PIL import Image

from tests.cli.conftest import PATIENCE, SOFT, Command, Process

SLIDE = ("converge", "scenarios/slide.toml", "--set", "contact.stiffness_scale=0.01", "--jobs", 1)


def test_tables_verdicts_recommendation_and_picture(blocksim: Command) -> None:
    answer = blocksim(*SLIDE, "--size", "500x400px", "--dpi", 80)
    assert answer.code == 0
    lines = answer.out.splitlines()
    assert lines[0] == "time step: time.safety"
    assert lines[1].split() == ["value", "block:", "x", "mm", "change", "mm", "order", "seconds"]
    assert any(line.startswith("0.05 (own)") for line in lines)
    assert sum(line.startswith("converged: the last two refinements move no block by more than") for line in lines) == 2
    assert 'the particle spacing has no effect on contact.model = "surface": not studied' in lines
    assert lines[-3] == "recommended: time.safety=0.1, contact.stiffness_scale=0.001"
    assert lines[-1] == ("blocksim run scenarios/slide.toml --set time.safety=0.1 --set contact.stiffness_scale=0.001")
    assert max(map(len, lines[:-1])) <= 80
    assert "time.safety = 0.1: finished (at rest)" in answer.err
    assert answer.err.splitlines()[-1] == "picture: results/slide/converge.png"
    with Image.open("results/slide/converge.png") as picture:
        assert picture.size == (500, 400)


def test_json_and_quiet_tell_nothing_else(blocksim: Command) -> None:
    told = blocksim(*SLIDE, "--study", "stiffness", "--out", "mine.svg", "--json")
    data = json.loads(told.out)
    assert (told.code, told.err, data["picture"], data["converged"]) == (0, "", "mine.svg", True)
    (study,) = data["studies"]
    assert (study["key"], study["verdict"], study["recommended"]) == ("contact.stiffness_scale", "converged", 0.001)
    assert study["levels"][0]["change_mm"] is None
    assert study["levels"][2]["is_own"] is True
    assert data["recommended"]["settings"] == {"contact.stiffness_scale": 0.001}
    quiet = blocksim(*SLIDE, "--study", "stiffness", "--no-picture", "--quiet")
    assert (quiet.code, quiet.err) == (0, "")
    assert not Path("results/slide/converge.png").exists()


def test_many_blocks_show_those_that_move_most(blocksim: Command) -> None:
    falling = ("--set", "contact.stiffness_scale=0.001", "--set", "structures.0.offset=3.5 mm", "--set", "time.end=0.3")
    answer = blocksim(
        "converge", "scenarios/tower.toml", *falling, "--study", "step", "--tolerance", 100, "--jobs", 1, "--no-picture"
    )
    lines = answer.out.splitlines()
    assert answer.code == 0
    assert lines[1].count(": x mm") == 3
    assert "10: x mm" in lines[1]
    assert "the 3 of 10 blocks that move most; change: the largest of all blocks" in lines
    assert max(map(len, lines[:-1])) <= 80


def test_tower_on_the_brink_flips_with_the_stiffness(blocksim: Command) -> None:
    # three equal offsets d stay up while 1.5 d < 16 mm; springs that give way tip the tower a little earlier
    brink = ("--set", "structures.0.count=3", "--set", "structures.0.offset=10.65 mm", "--set", "time.end=0.5")
    soft = ("--set", "contact.stiffness_scale=0.01", "--study", "stiffness", "--levels", 2)
    answer = blocksim("converge", "scenarios/tower.toml", *brink, *soft, "--jobs", 1, "--no-picture", "-q")
    lines = answer.out.splitlines()
    assert answer.code == 0
    assert "not converged: the outcome flips between levels. A single run says little:" in lines
    assert "outcome differs between 0.01 and 0.0316228: blocks 2, 3" in lines
    assert lines[-1] == "no recommendation before every study has converged"


def test_failing_scenario_is_76_and_draws_nothing(blocksim: Command) -> None:
    answer = blocksim(*SLIDE, "--set", "contact.max_overlap=1e-9", "--study", "step")
    assert answer.code == 76
    assert "not judged: 4 of 4 levels did not finish; the first, 0.1: an overlap exceeds" in answer.out
    last = answer.out.splitlines()[-1]
    assert last.startswith("the scenario as it is failed: an overlap exceeds contact.max_overlap (block block and the")
    assert "picture" not in answer.err


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.long)])
def test_ctrl_c_ends_all_runs_with_75(process: Process, tmp_path: Path, jobs: int) -> None:
    endless = ("--set", "time.end=1e4", "--set", "time.stop_at_rest=false", "--set", "output.every=10")
    running = process("converge", "scenarios/three_blocks_nominal.toml", *SOFT, *endless, "--jobs", jobs, "-q")
    began = time.monotonic()
    while not list(tmp_path.glob("results/three_blocks_nominal/converge/*/run.h5")):
        assert running.poll() is None, running.communicate()
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.01)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (75, "")
    assert err == "stopped after 0 runs; rerun the command to finish\n"
