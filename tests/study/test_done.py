"""Which row of a case counts, where several processes have written some."""

from pathlib import Path

from blocksim.study.progress import CaseIndex, Entry, values_hash

ONE: dict[str, object] = {"friction": 0.2}
OTHER: dict[str, object] = {"friction": 0.3}


def entry(status: str, settings: dict[str, object] = ONE) -> Entry:
    return Entry(0, "case", values_hash(settings), {"status": status})


def test_row_of_other_values_is_none_of_this_case(tmp_path: Path) -> None:
    done = CaseIndex(tmp_path, 1)
    done.note(tmp_path / "manifest.jsonl", 0, entry("finished"))
    assert done.holds(0, ONE)
    assert not done.holds(0, OTHER)
    assert done.count() == 0


def test_case_that_ended_well_stays_so_whatever_comes_after(tmp_path: Path) -> None:
    done = CaseIndex(tmp_path, 1)
    for start, status in enumerate(("failed", "finished", "failed")):
        done.note(tmp_path / "manifest.jsonl", start, entry(status))
    assert done.starts[0] == 1
