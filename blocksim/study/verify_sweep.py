"""Reproducibility of a stored sweep: a sample of its rows, drawn with a seed, run again and compared by digits."""

import csv
import io
import os
import random
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.study.executors.ensemble import rows_of
from blocksim.study.plan import Case, Cases
from blocksim.study.progress import PATTERN, CaseIndex, read_entries
from blocksim.study.rows import FINISHED, TABLE, Head, Ranges, Row, as_cell, invalid_row, varied_cells
from blocksim.study.sweep import cases_in, measured_ranges
from blocksim.study.sweep_folder import case_folder, read_origin, read_plan
from blocksim.study.sweep_table import NO_TABLE, OUTCOME, lines_in
from blocksim.study.verify_run import EntryDifference, Origin, RunVerdict, changed_origins, tells_of_code, verify_run

SAMPLE = 16  # rows, where nobody says how many
CASE, INSIDE = "case", "inside"
MM, DEGREES = "_mm", "_deg"


@dataclass(frozen=True)
class CellDifference:
    """One cell of sweep.csv that does not come out again; texts as they stand there."""

    row: int  # 1 is the first below the heads
    case: str
    column: str
    stored: str
    now: str


@dataclass(frozen=True)
class SweepVerdict:
    """What came of running rows of a stored sweep again."""

    folder: Path
    rows: int  # of the table
    checked: tuple[int, ...]  # numbers of the rows that were run again, from 1
    cells: tuple[CellDifference, ...]
    largest_mm: float
    largest_deg: float
    origins: tuple[Origin, ...]  # what is not the same as when the sweep was made
    runs: tuple[RunVerdict, ...] = ()  # of those rows whose folders were kept
    entries: tuple[EntryDifference, ...] = ()  # of the answer of a study

    @cached_property
    def agrees(self) -> bool:
        """Return True if all rows that were run again have come out as they stand in the table."""
        return not (self.cells or self.entries) and all(run.agrees for run in self.runs)

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        runs = [run.to_dict() for run in self.runs]
        return {"agrees": self.agrees, "kind": "sweep", **asdict(self), "folder": str(self.folder), "runs": runs}


def verify_sweep(folder: Path, sample: int = SAMPLE, seed: int = 0) -> SweepVerdict:
    """Run a sample of the rows of a sweep's table again and compare every cell; and the name of every case.

    These names are hashes of the code too: the same code has to give them, other code finds those of the manifest.
    Where the folders of these cases were kept, they are verified as runs.
    Raises InputMissingError, or InvalidInputError where table, plan and manifests do not go together.
    """
    document = read_plan(folder)
    cases = cases_in(document)
    columns, lines = _read_table(folder / TABLE)
    numbers = _numbers(folder, cases, len(lines))
    rows = sorted(random.Random(seed).sample(range(len(lines)), min(sample, len(lines))))  # noqa: S311 - no secret
    ends = _ends([cases[numbers[row]] for row in rows])
    ranges = measured_ranges(document.build())
    origins = () if (origin := read_origin(folder)) is None else changed_origins(origin.environment)
    names = _names(folder)
    if origin is not None and not tells_of_code(origins):
        names |= {numbers[row]: cases[numbers[row]].name for row in rows}
    found = [
        CellDifference(row + 1, line[0], CASE, line[0], names[numbers[row]])
        for row, line in enumerate(lines)
        if line[0] != names.get(numbers[row], line[0])
    ]
    for row, (case, end) in zip(rows, ends, strict=True):
        stored, now = dict(zip(columns, lines[row], strict=True)), _cells(columns, case, end, ranges)
        found += [
            CellDifference(row + 1, stored[CASE], name, stored[name], now[name])
            for name in columns
            if name != CASE and stored[name] != now[name]
        ]
    return SweepVerdict(
        folder,
        len(lines),
        tuple(row + 1 for row in rows),
        tuple(found),
        largest(found, MM),
        largest(found, DEGREES),
        origins,
        tuple(verify_run(kept) for row in rows if (kept := case_folder(folder, lines[row][0])) is not None),
    )


def _read_table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows as texts: what a person cites. Raises InputMissingError or InvalidInputError."""
    head, *lines = lines_in(path) or [[]]
    if head[:1] != [CASE] or not set(OUTCOME) <= set(head) or len(set(head)) < len(head):
        message = f"{path}: {NO_TABLE}: its columns are not case, ..., {', '.join(OUTCOME)}, ..."
        raise InvalidInputError(message)
    short = next((number for number, line in enumerate(lines, start=2) if len(line) != len(head)), None)
    if short is not None:
        message = f"{path}:{short}: {len(lines[short - 2])} cells, not {len(head)}"
        raise InvalidInputError(message)
    return head, lines


def _names(folder: Path) -> dict[int, str]:
    """Return the names that the manifests have for cases, by their numbers; the last one of each."""
    paths = sorted(folder.glob(PATTERN))
    return {entry.number: entry.case for path in paths for _, entry in read_entries(path)}


def _numbers(folder: Path, cases: Cases, count: int) -> Sequence[int]:
    """Return the number of the case of each of `count` rows. Raises InvalidInputError."""
    if count == len(cases):
        return range(count)
    done = CaseIndex(folder, len(cases))
    held = [number for number in range(len(cases)) if done.holds(number, cases.design[number])]
    if len(held) != count:
        message = f"{folder / TABLE}: {count} rows of {len(cases)} cases, but the manifest has {len(held)}"
        raise InvalidInputError(message)
    return held


def _ends(cases: Sequence[Case]) -> Iterator[tuple[Case, Row]]:
    """Run cases and yield each with its row."""
    scenarios = [case.scenario for case in cases if case.scenario is not None]
    rows = iter(rows_of(scenarios, os.cpu_count() or 1))
    for case in cases:
        yield case, invalid_row(case.problem) if case.scenario is None else next(rows)


def _cells(columns: Sequence[str], case: Case, row: Row, ranges: Ranges | None) -> dict[str, str]:
    """Return the cells of a row as texts, as the table of a sweep has them."""
    heads = (head for head in map(Head.read, columns) if head.key in case.settings)
    values: Row = {CASE: case.name, **varied_cells(heads, case.settings), **row}
    if ranges is not None:
        values[INSIDE] = ranges.hold(row) if row["status"] == FINISHED else None
    text = io.StringIO(newline="")
    csv.writer(text).writerow([as_cell(values.get(name)) for name in columns])
    return dict(zip(columns, next(csv.reader(io.StringIO(text.getvalue(), newline=""))), strict=True))


def largest(found: Sequence[CellDifference], unit: str) -> float:
    """Return the largest difference of two numbers in columns of a unit."""
    return max((_apart(one) for one in found if one.column.endswith(unit)), default=0.0)


def _apart(one: CellDifference) -> float:
    try:
        return abs(float(one.stored) - float(one.now))
    except ValueError:  # one of the two is empty: this case did not finish
        return float("nan")
