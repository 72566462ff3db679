"""blocksim sweep --dry-run: count, cost and size, and nothing done."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import SOFT, Command
from tests.golden import Golden

PLAN = ("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, "--jobs", 2, "--dry-run")
KINETIC = "friction.block_block.kinetic"


@pytest.mark.parametrize(
    "options",
    [
        f"--vary {KINETIC}=0.1:0.3:50 --vary time.end=1:2:20",
        f"--vary {KINETIC}=0.2,0.9",
        f"--vary {KINETIC}=0.2:0.3 --mode sobol --samples 10",
    ],
    ids=["thousand cases", "a case that cannot be simulated", "unbalanced Sobol points"],
)
def test_cost_is_told_and_nothing_written(blocksim: Command, tmp_path: Path, golden: Golden, options: str) -> None:
    before = sorted(tmp_path.rglob("*"))
    answer = blocksim(*PLAN, *options.split())
    assert answer.code == 0
    assert max(map(len, answer.out.splitlines()[:5])) <= 80
    assert sorted(tmp_path.rglob("*")) == before
    golden(answer.out + answer.err, rules=["times", "sizes"])


def test_twice_the_cores_take_half_the_time(blocksim: Command) -> None:
    def solving(jobs: int) -> str:
        return blocksim(*PLAN, "--jobs", jobs, "--vary", "time.end=2,4").out.splitlines()[1]

    assert solving(1).endswith(" on 1 core")
    assert solving(1).removesuffix(" on 1 core") != solving(8).removesuffix(" on 8 cores")


def test_cost_grows_with_cases_and_steps(blocksim: Command) -> None:
    def seconds(*vary: str) -> float:
        return float(json.loads(blocksim(*PLAN, "--json", *vary).out)["seconds"])

    one = seconds("--vary", f"{KINETIC}=0.2")
    assert seconds("--vary", f"{KINETIC}=0.2,0.21,0.22") / one == 3.0
    assert 1.9 < seconds("--vary", "time.end=4") / one < 2.1
