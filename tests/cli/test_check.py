"""blocksim check: scenarios that ship are valid; what a crowd comes to."""

import json
from pathlib import Path

from tests.cli.conftest import Command


def test_shipped_scenarios_are_valid(blocksim: Command, shipped: Path) -> None:
    answer = blocksim("check", shipped, "--quiet")
    assert (answer.code, answer.out, answer.err) == (0, "", "")


def test_json_of_a_crowd_has_every_block(blocksim: Command) -> None:
    data = json.loads(blocksim("check", "scenarios/wall.toml", "--json").out)
    assert [body["name"] for body in data["bodies"]] == [str(i + 1) for i in range(1000)]
    assert data["memory"] > 210_000_000 > data["bytes"] > 0
