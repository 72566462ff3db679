"""Reproducibility of stored sweeps and studies: their tables and answers, and a sample of their runs by digits.

Of a sweep, a sample of its rows, drawn with a seed, is run again. A study is repeated from its manifest, without
running anything, in a folder of its own: its tables and its answer have to come out again. A sample of its runs is run
again too, and runs that were kept are verified as runs.
"""

import os
import random
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

from blocksim.errors import InvalidInputError
from blocksim.simulation.observables import PEAK
from blocksim.study import manifest, plan, sweep, sweep_folder
from blocksim.study.executors.ensemble import rows_of
from blocksim.study.rows import FINISHED, TABLE, Head, Ranges, Row, as_cell, invalid_row, varied_cells
from blocksim.study.runs import Replay
from blocksim.study.study import Study, study_in
from blocksim.study.verify_run import (
    EntryDifference,
    Origin,
    RunVerdict,
    apart,
    changed_origins,
    tells_of_code,
    verify_run,
)

SAMPLE = 16  # rows, where nobody says how many
CASE, INSIDE = "case", "inside"
MM, DEGREES = "_mm", "_deg"


@dataclass(frozen=True)
class CellDifference:
    """One cell of a table that does not come out again; texts as they stand there."""

    row: int  # 1 is the first below the heads
    case: str
    column: str
    stored: str
    now: str


@dataclass(frozen=True)
class SweepVerdict:
    """What came of running rows of a stored sweep or study again."""

    folder: Path
    rows: int  # of the table
    checked: tuple[int, ...]  # numbers of the rows that were run again, from 1
    cells: tuple[CellDifference, ...]
    origins: tuple[Origin, ...] = ()  # what is not the same as when the sweep was made
    runs: tuple[RunVerdict, ...] = ()  # of those rows whose folders were kept
    entries: tuple[EntryDifference, ...] = ()  # of the answer of a study

    @cached_property
    def agrees(self) -> bool:
        """Return True if all rows that were run again have come out as they stand in the table."""
        return not (self.cells or self.entries) and all(run.agrees for run in self.runs)

    def largest(self, unit: str) -> float:
        """Return the largest difference of two numbers in columns of a unit; of a case that failed there is none."""
        sizes = [0.0]
        for one in self.cells:
            with suppress(ValueError):
                sizes += [abs(float(one.stored) - float(one.now))] if one.column.endswith(unit) else []
        return max(sizes)

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        data = {**asdict(self), "folder": str(self.folder), "runs": [run.to_dict() for run in self.runs]}
        first = {name: data.pop(name) for name in ("folder", "rows", "checked", "cells")}
        largest = {"largest_mm": self.largest(MM), "largest_deg": self.largest(DEGREES)}
        return {"agrees": self.agrees, "kind": "sweep", **first, **largest, **data}


def verify_sweep(folder: Path, sample: int = SAMPLE, seed: int = 0) -> SweepVerdict:
    """Run a sample of the rows of a sweep's table again and compare every cell; and the name of every case.

    These names are hashes of the code too: the same code has to give them, other code finds those of the manifest.
    Where the folders of these cases were kept, they are verified as runs.
    Raises InputMissingError, or InvalidInputError where table, plan and manifests do not go together.
    """
    document = sweep_folder.read_plan(folder)
    base = document.build()
    cases = plan.cases_of(document, plan.plan_of(base))
    columns, lines = _read_table(folder / TABLE)
    numbers = _numbers(folder, cases, len(lines))
    rows = _chosen(len(lines), sample, seed)
    scenarios = [case.scenario for row in rows if (case := cases[numbers[row]]).scenario is not None]
    ends = iter(rows_of(scenarios, os.cpu_count() or 1))
    ranges = sweep.measured_ranges(base)
    origins, is_same_code = _origins(folder, sweep_folder.SWEEP)
    entries = (entry for path in sorted(folder.glob(manifest.PATTERN)) for _, entry in manifest.read_entries(path))
    names = {entry.number: entry.case for entry in entries}  # the last one of each
    if is_same_code:
        names |= {numbers[row]: cases[numbers[row]].name for row in rows}
    found = [
        CellDifference(row + 1, line[0], CASE, line[0], names[numbers[row]])
        for row, line in enumerate(lines)
        if line[0] != names.get(numbers[row], line[0])
    ]
    for row in rows:
        case, stored = cases[numbers[row]], dict(zip(columns, lines[row], strict=True))
        end = invalid_row(case.problem) if case.scenario is None else next(ends)
        now = _cells(columns, case, end, ranges)
        found += [
            CellDifference(row + 1, stored[CASE], name, stored[name], now[name])
            for name in columns
            if name != CASE and stored[name] != now[name]
        ]
    checked = tuple(row + 1 for row in rows)
    kept = tuple(
        verify_run(place) for row in rows if (place := sweep_folder.case_folder(folder, lines[row][0])) is not None
    )
    return SweepVerdict(folder, len(lines), checked, tuple(found), origins, kept)


def verify_study(folder: Path, study: Study, sample: int = SAMPLE, seed: int = 0) -> tuple[SweepVerdict, ...]:
    """Verify a study; of one that consists of others all of them, and then itself.

    Raises InputMissingError or InvalidInputError for files that cannot be read or do not go together.
    """
    stored, replay = study.answer.read(folder), Replay.of(folder, by_number=study.is_design)
    parts = [(place, part) for place in study.parts(stored) if (part := study_in(place)) is not None]
    verdicts = [verdict for place, part in parts for verdict in verify_study(place, part, sample, seed)]
    kind = stored.files
    with TemporaryDirectory() as place:
        again = study.repeat(stored, replay, Path(place) / "study")
        entries = tuple(apart(kind.origin, "", stored.comparable(), again.comparable()))
        tables = [path for path in sorted(again.folder.glob("*.csv")) if kind.tables.fullmatch(path.name)]
        cells = [one for path in tables for one in _cells_apart(folder / path.name, manifest.lines_in(path))]
    origins, is_same_code = _origins(folder, kind)
    tasks = replay.tasks
    chosen = _chosen(len(tasks), sample, seed)
    known = [entry for number in chosen if (entry := replay.entry(tasks[number])) is not None]  # all were there
    peaks = any(PEAK in entry.row for entry in known)
    rows = rows_of([tasks[number].scenario for number in chosen], os.cpu_count() or 1, peaks=peaks)
    for number, entry, row in zip(chosen, known, rows, strict=True):
        then: Row = {CASE: entry.case, **entry.row}
        now: Row = {CASE: tasks[number].name if is_same_code else entry.case, **row}
        texts = [(name, *(str(as_cell(one.get(name))) for one in (then, now))) for name in dict.fromkeys((*then, *now))]
        cells += [CellDifference(number + 1, entry.case, *text) for text in texts if text[1] != text[2]]
    kept = tuple(verify_run(place) for place in sorted((folder / sweep_folder.CASES).glob("*")) if place.is_dir())
    checked = tuple(number + 1 for number in chosen)
    return (*verdicts, SweepVerdict(folder, len(tasks) or len(parts), checked, tuple(cells), origins, kept, entries))


def _chosen(count: int, sample: int, seed: int) -> list[int]:
    return sorted(random.Random(seed).sample(range(count), min(sample, count)))  # noqa: S311 - no secret


def _origins(folder: Path, kind: sweep_folder.FolderKind) -> tuple[tuple[Origin, ...], bool]:
    """Return what is not the same as when a study was made, and whether its code is known to be."""
    origin = sweep_folder.read_origin(folder, kind)
    origins = () if origin is None else changed_origins(origin.environment)
    return origins, origin is not None and not tells_of_code(origins)


def _cells_apart(path: Path, now: list[list[str]]) -> Iterator[CellDifference]:
    """Yield the cells of a stored table that are not those of the table as it comes out again."""
    stored = manifest.lines_in(path)
    heads = stored[0] if stored else []
    if [len(stored), *stored[:1]] != [len(now), *now[:1]]:
        shown = [f"{len(lines)} lines, {len(lines[0]) if lines else 0} columns" for lines in (stored, now)]
        yield CellDifference(0, path.name, "", *shown)
        return
    for row, (then, again) in enumerate(zip(stored[1:], now[1:], strict=True), start=1):
        for column, one, other in zip(heads, then, again, strict=False):
            if one != other:
                yield CellDifference(row, f"{path.name} {then[0]}", column, one, other)


def _read_table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows as texts: what a person cites. Raises InputMissingError or InvalidInputError."""
    head, *lines = manifest.lines_in(path) or [[]]
    if head[:1] != [CASE] or not set(manifest.OUTCOME) <= set(head) or len(set(head)) < len(head):
        message = f"{path}: {manifest.NO_TABLE}: its columns are not case, ..., {', '.join(manifest.OUTCOME)}, ..."
        raise InvalidInputError(message)
    short = next((number for number, line in enumerate(lines, start=2) if len(line) != len(head)), None)
    if short is not None:
        message = f"{path}:{short}: {len(lines[short - 2])} cells, not {len(head)}"
        raise InvalidInputError(message)
    return head, lines


def _numbers(folder: Path, cases: plan.Cases, count: int) -> Sequence[int]:
    """Return the number of the case of each of `count` rows. Raises InvalidInputError."""
    if count == len(cases):
        return range(count)
    done = manifest.CaseIndex(folder, len(cases))
    held = [number for number in range(len(cases)) if done.holds(number, cases.design[number])]
    if len(held) != count:
        message = f"{folder / TABLE}: {count} rows of {len(cases)} cases, but the manifest has {len(held)}"
        raise InvalidInputError(message)
    return held


def _cells(columns: Sequence[str], case: plan.Case, row: Row, ranges: Ranges | None) -> dict[str, str]:
    """Return the cells of a row as texts, as the table of a sweep has them."""
    heads = (head for head in map(Head.read, columns) if head.key in case.settings)
    values: Row = {CASE: case.name, **varied_cells(heads, case.settings), **row}
    if ranges is not None:
        values[INSIDE] = ranges.hold(row) if row["status"] == FINISHED else None
    cells = {name: as_cell(values.get(name)) for name in columns}
    return {name: "" if cell is None else str(cell) for name, cell in cells.items()}
