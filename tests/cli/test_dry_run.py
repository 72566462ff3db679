"""blocksim sweep --dry-run: count, cost and size, and nothing done."""

import json
from pathlib import Path

from tests.cli.conftest import SOFT, Command

PLAN = ("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, "--jobs", 2, "--dry-run")
KINETIC = "friction.block_block.kinetic"


def test_cost_is_reported_and_nothing_written(blocksim: Command, tmp_path: Path) -> None:
    before = sorted(tmp_path.rglob("*"))
    answer = blocksim(*PLAN, "--vary", f"{KINETIC}=0.1:0.3:50", "--vary", "time.end=1:2:20")
    assert (answer.code, answer.err) == (0, "")
    cases, solving, results, memory, source = answer.out.splitlines()
    assert cases == "cases      1000"
    assert solving.startswith("solving    at most about ")
    assert solving.endswith(" on 2 cores")
    assert results.startswith("results    at most about ")
    assert memory == "memory     about 210 MB for a process that runs one case"
    assert source == "from the steps of 32 cases at the measured speed; less if they stop at rest"
    assert max(map(len, answer.out.splitlines())) <= 80
    assert sorted(tmp_path.rglob("*")) == before


def test_cost_grows_with_cases_and_steps(blocksim: Command) -> None:
    def seconds(*vary: str) -> float:
        return float(json.loads(blocksim(*PLAN, "--json", *vary).out)["seconds"])

    one = seconds("--vary", f"{KINETIC}=0.2")
    assert seconds("--vary", f"{KINETIC}=0.2,0.21,0.22") / one == 3.0
    assert 1.9 < seconds("--vary", "time.end=4") / one < 2.1


def test_models_of_particles_cost_what_was_measured(blocksim: Command) -> None:
    # measured for three blocks with 164 particles each, over the exact faces: kernel 30, particles 20
    def seconds(model: str) -> float:
        return float(json.loads(blocksim(*PLAN, "--json", "--vary", f"contact.model={model}").out)["seconds"])

    surface = seconds("surface")
    assert 20.0 < seconds("kernel") / surface < 60.0
    assert 12.0 < seconds("particles") / surface < 40.0


def test_cases_that_cannot_be_simulated_are_reported_of(blocksim: Command) -> None:
    answer = blocksim(*PLAN, "--vary", f"{KINETIC}=0.2,0.9")
    assert answer.code == 0
    assert "1 of these 2 cannot be simulated; the first: " in answer.out
    assert "kinetic friction 0.9 is above static friction 0.31" in answer.out


def test_unbalanced_sobol_points_are_remarked_on(blocksim: Command) -> None:
    answer = blocksim(*PLAN, "--vary", f"{KINETIC}=0.2:0.3", "--mode", "sobol", "--samples", 10)
    assert (answer.code, answer.err) == (0, "10 Sobol points are not balanced; 8 or 16 are\n")
