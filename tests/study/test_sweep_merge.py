"""Shards share a folder, and are merged only when they are all there."""

from pathlib import Path

from blocksim.scenario import Document
from blocksim.study.manifest import Shard, read_sweep
from blocksim.study.sweep import merge, sweep

VARY = {"friction.block_block.kinetic": [0.1 + 0.02 * k for k in range(10)]}


def test_sweep_does_what_shards_have_left(quick: Document, tmp_path: Path) -> None:
    sweep(quick, VARY, out=tmp_path / "one")
    sweep(quick, VARY, out=tmp_path / "two", shard=Shard(0, 2))
    sweep(quick, VARY, out=tmp_path / "two")
    assert (tmp_path / "two" / "manifest.jsonl").read_text().count("\n") == 5
    assert (tmp_path / "two" / "sweep.csv").read_bytes() == (tmp_path / "one" / "sweep.csv").read_bytes()


def test_case_that_was_retried_elsewhere_counts_as_finished(quick: Document, tmp_path: Path) -> None:
    sweep(quick, VARY, out=tmp_path)
    lines = (tmp_path / "manifest.jsonl").read_text().splitlines(keepends=True)
    from blocksim.study.manifest import Entry  # noqa: PLC0415

    entry = Entry.from_line(lines[3].encode())
    assert entry is not None
    died = Entry(entry.number, entry.case, entry.values, {"status": "failed", "reason": "died", "seconds": 0.0})
    (tmp_path / "manifest-0-of-2.jsonl").write_bytes(died.to_line())
    assert merge(tmp_path).failed == 0
    assert read_sweep(tmp_path).failed == 0


def test_shards_share_all_cases_out() -> None:
    shards = [Shard.parse(f"{index}/3") for index in range(3)]
    assert sorted(number for shard in shards for number in range(11)[shard.slice]) == list(range(11))
