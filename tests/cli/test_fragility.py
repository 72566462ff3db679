"""blocksim fragility: what it prints, its exit codes, shards, and a kill."""

import json
import signal
import time
from pathlib import Path

import pytest

from tests.cli.conftest import Command, Process
from tests.sizes import in_all


@pytest.mark.long
def test_a_study_killed_again_and_again_ends_as_one_that_was_not(
    blocksim: Command, process: Process, tmp_path: Path
) -> None:
    wall = ("fragility", "scenarios/tilting_wall.toml", "--intensity", "ground.tilt=31deg:34deg:4", "--samples", 40)
    study = (*wall, "--scatter", "friction.block_block=0.65+-0.03", "--set", "time.stop_at_rest=false", "--jobs", 1)
    assert blocksim(*study, "--out", "whole").code == 0
    for _ in range(in_all(10)):
        running = process(*study, "--out", "killed")
        time.sleep(2.5)
        running.send_signal(signal.SIGKILL)
        running.communicate()
    assert blocksim(*study, "--out", "killed").code == 0
    for name in ("fragility.csv", "members.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    numbers = [json.loads(line)["number"] for line in (tmp_path / "killed" / "manifest.jsonl").read_text().splitlines()]
    assert sorted(numbers) == list(range(160))
