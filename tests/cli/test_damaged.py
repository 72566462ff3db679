"""Runs with damaged and missing files, asked by every command that reads them."""

from pathlib import Path

import pytest

from tests.cli.conftest import Command

JUDGED = ("run.json", "final.csv", "scenario.toml", "experiment.csv")


@pytest.mark.parametrize(
    ("command", "name"),
    [*(("compare", name) for name in JUDGED), ("plot", "run.h5"), ("export", "run.h5"), ("animate", "run.h5")],
)
@pytest.mark.parametrize("content", [None, b"", b"rubbish" * 100, b"\x00\xff\xfe"])
def test_damaged_file_is_named(blocksim: Command, copied: Path, command: str, name: str, content: bytes | None) -> None:
    if content is None:
        (copied / name).unlink()
    else:
        (copied / name).write_bytes(content)
    answer = blocksim(command, copied)
    assert answer.code in ({65, 66} if content is None else {65})
    assert name in answer.err
    assert answer.out == ""
