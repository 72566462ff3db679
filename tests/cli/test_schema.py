"""blocksim schema prints JSON and nothing else."""

import json

from tests.cli.conftest import Command


def test_schema_is_json(blocksim: Command) -> None:
    answer = blocksim("schema")
    assert json.loads(answer.out)["properties"]["schema"]
    assert answer.err == ""
