"""What has been run of a sweep, and that a kill loses no line of it."""

import math
import zlib
from pathlib import Path

import pytest

from blocksim.errors import OutputExistsError
from blocksim.study.manifest import CaseIndex, Entry, Manifest, read_entries, short_hash

ROW: dict[str, object] = {"status": "finished", "reason": 'at "rest",\n', "seconds": 0.1, "1.x_mm": 1.0 / 3.0}
ENTRIES = [Entry(number, f"{number:012x}", "00ff", {**ROW, "1.y_mm": 0.1 * number}) for number in range(4)]


def written(path: Path, entries: list[Entry]) -> list[int]:
    manifest = Manifest(path)
    starts = manifest.append(entries)
    manifest.close()
    return starts


def test_entries_come_back_to_the_last_bit_with_their_places(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    starts = written(path, ENTRIES[:2]) + written(path, ENTRIES[2:])
    assert list(read_entries(path)) == list(zip(starts, ENTRIES, strict=True))


def test_number_that_is_not_finite_is_null() -> None:
    entry = Entry.from_line(Entry(0, "", "0", {"a": math.nan, "b": math.inf, "c": 1.0}).to_line())
    assert entry is not None
    assert entry.row == {"a": None, "b": None, "c": 1.0}


def test_torn_at_any_byte_it_loses_the_last_line_only(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    starts = written(path, ENTRIES[:3])
    whole = path.read_bytes()
    for end in range(starts[2], len(whole) - 1):
        path.write_bytes(whole[:end])
        assert [entry for _, entry in read_entries(path)] == ENTRIES[:2]
        (start,) = written(path, ENTRIES[3:])
        assert list(read_entries(path))[2:] == [(start, ENTRIES[3])]


def test_changed_byte_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    written(path, ENTRIES)
    path.write_bytes(path.read_bytes().replace(b'"number":2', b'"number":7'))
    assert [entry.number for _, entry in read_entries(path)] == [0, 1, 3]


def test_second_writer_is_refused_until_the_first_has_gone(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    first = Manifest(path)
    with pytest.raises(OutputExistsError, match="already running"):
        Manifest(path)
    first.close()
    Manifest(path).close()


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"number":0',
        '{"number":"0","case":"","values":"0","row":{}',
        '{"number":true,"case":"","values":"0","row":{}',
        '{"number":0,"case":"","values":"0x","row":{}',
        '{"number":0,"case":"","values":"ffffffffffffffffffff","row":{}',
        '{"number":0,"case":"","values":"0","row":[]',
        '{"number":0,"case":[],"values":"0","row":{}',
    ],
)
def test_line_with_a_right_sum_that_no_sweep_has_written_is_passed_over(text: str) -> None:
    head = text.encode()
    assert Entry.from_line(b'%s,"sum":"%08x"}\n' % (head, zlib.crc32(head))) is None


ONE: dict[str, object] = {"friction": 0.2}
OTHER: dict[str, object] = {"friction": 0.3}


def entry(status: str, settings: dict[str, object] = ONE) -> Entry:
    return Entry(0, "case", short_hash(settings), {"status": status})


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
