"""Rows of sweep.csv: columns with units, which are inside the measured ranges, and that a kill loses none of them."""

import math
import tomllib
import zlib
from pathlib import Path

from blocksim.scenario import Document
from blocksim.study.manifest import CaseIndex, Entry, Manifest, read_entries, short_hash
from blocksim.study.plan import Values, with_sweep
from blocksim.study.rows import Range, Ranges, as_cell, heads_of
from tests.golden import Golden
from tests.study.plans import cases, plan_of

VARIED: list[dict[str, Values]] = tomllib.loads(Path(__file__).with_name("heads.toml").read_text())["vary"]


def test_numbers_have_the_unit_that_was_typed(nominal: Document, golden: Golden) -> None:
    told = []
    for vary in VARIED:
        document = with_sweep(nominal, vary)
        (column,) = heads_of(plan_of(document))
        told.append(f"{column}: {', '.join(repr(column.cell(*row.values())) for row in cases(document).design)}")
    golden("\n".join(told), rules=["digits"])


def test_block_without_a_position_is_not_inside(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("block,quantity,unit,replicate,value\n1,x,mm,1,16\n")
    ranges = Ranges.read(table)
    rows: list[dict[str, object]] = [{"1.x_mm": 16.2}, {"1.x_mm": None}, {"1.x_mm": float("nan")}, {}]
    assert [ranges.hold(row) for row in rows] == [True, False, False, False]


def test_both_ends_of_a_measured_range_are_inside() -> None:
    measured = Range("1", "x_mm", 1.0, 2.0)
    assert [measured.holds(value) for value in (0.9, 1.0, 2.0, 2.1)] == [False, True, True, False]


def test_text_that_a_spreadsheet_would_compute_is_marked_and_quantities_are_not() -> None:
    for formula in ('=HYPERLINK("a")', "+cmd", "-a", "@SUM(A1)", "\t=1", "\r=1"):
        assert as_cell(formula) == f"'{formula}"
    for plain in ("-5 deg", "+3", "-1e-3", "stone", "", 2.0, None):
        assert as_cell(plain) is plain


ROW: dict[str, object] = {"status": "finished", "reason": 'at "rest",\n', "seconds": 0.1, "1.x_mm": 1.0 / 3.0}
ENTRIES = [Entry(number, f"{number:012x}", "00ff", {**ROW, "1.y_mm": 0.1 * number}) for number in range(4)]


def written(path: Path, entries: list[Entry]) -> list[int]:
    manifest = Manifest(path)
    starts = manifest.append(entries)
    manifest.close()
    return starts


def test_entries_come_back_to_the_last_bit_with_their_places_unless_a_byte_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    starts = written(path, ENTRIES[:2]) + written(path, ENTRIES[2:])
    assert list(read_entries(path)) == list(zip(starts, ENTRIES, strict=True))
    path.write_bytes(path.read_bytes().replace(b'"number":2', b'"number":7'))
    assert [entry.number for _, entry in read_entries(path)] == [0, 1, 3]
    infinite = Entry.from_line(Entry(0, "", "0", {"a": math.nan, "b": math.inf, "c": 1.0}).to_line())
    assert infinite is not None
    assert infinite.row == {"a": None, "b": None, "c": 1.0}


def test_torn_at_any_byte_it_loses_the_last_line_only(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    starts = written(path, ENTRIES[:3])
    whole = path.read_bytes()
    for end in range(starts[2], len(whole) - 1):
        path.write_bytes(whole[:end])
        assert [entry for _, entry in read_entries(path)] == ENTRIES[:2]
        (start,) = written(path, ENTRIES[3:])
        assert list(read_entries(path))[2:] == [(start, ENTRIES[3])]


def test_line_with_a_right_sum_that_no_sweep_has_written_is_passed_over() -> None:
    for text in (
        "[" * 100_000,
        '{"number":0',
        '{"number":"0","case":"","values":"0","row":{}',
        '{"number":true,"case":"","values":"0","row":{}',
        '{"number":0,"case":"","values":"0x","row":{}',
        '{"number":0,"case":"","values":"ffffffffffffffffffff","row":{}',
        '{"number":0,"case":"","values":"0","row":[]',
        '{"number":0,"case":[],"values":"0","row":{}',
    ):
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
