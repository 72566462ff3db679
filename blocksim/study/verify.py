"""Reproducibility of stored runs, sweeps and studies: whether they come out again, and if not, where and why.

A run is repeated to the last bit. Of run.json and done.json those entries are compared that follow from the scenario:
not wall times, nor when, where and in which parts the run was made.

Of a sweep, a sample of its rows, drawn with a seed, is run again, by digits. A study is repeated from its manifest,
without running anything, in a folder of its own: its tables and its answer have to come out again. A sample of its runs
is run again too, and runs that were kept are verified as runs.
"""

import json
import os
import random
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from blocksim.analysis.bits import Differences, differences
from blocksim.errors import InvalidInputError, StoppedEarlyError
from blocksim.options import silent
from blocksim.scenario import Model, input_files
from blocksim.scenario.structures.polygons import AS_READ
from blocksim.simulation import Watcher, checkpoint, files, instruments, observables, provenance, results, simulate
from blocksim.simulation.trajectory import csv_text
from blocksim.study import answer, manifest, plan, run_folder, sweep, sweep_folder
from blocksim.study.executors.ensemble import INTERRUPTED, rows_of
from blocksim.study.rows import FINISHED, TABLE, Head, Ranges, Row, as_cell, invalid_row

DECIDES = ("blocksim", provenance.ROOM_PREFIX, "python", "numpy", "numba", "llvmlite", "platform", "processor", "cpu")
ALWAYS = ("name", "steps", "time_step_s", "simulated_time_s", "energy_J")
OF_THE_MOTION = ("settled", "events", "movement", "convergence")
UNLESS_INTERRUPTED = ("reason", "exit_code")
HASHES = ("run", "scenario_hash")  # of the code, or of what it makes of a file, too
SAMPLE = 16  # rows, where nobody says how many
CASE, INSIDE = "case", "inside"
MM, DEGREES = "_mm", "_deg"


@dataclass(frozen=True)
class EntryDifference:
    """An entry that does not come out again; values as JSON has them."""

    file: str
    entry: str  # with points, as energy_J.kinetic
    stored: Any
    now: Any


def differing_entries(
    folder: Path, then: results.Summary, now: results.Summary, *, same_code: bool
) -> tuple[EntryDifference, ...]:
    """Return which entries of a run's folder are not those of its repetition; some of them only for the same code.

    The final state and the status are not among them: they are reported by themselves.
    """
    whole = then.status != INTERRUPTED
    names = [*ALWAYS, *OF_THE_MOTION, *(UNLESS_INTERRUPTED if whole else ()), *(HASHES if same_code else ())]
    stored, wanted = _read_entries(folder / files.SUMMARY), json.loads(now.to_json())
    if not whole and same_code:  # the repetition is of a scenario with another end
        wanted |= {name: getattr(then, name) for name in HASHES}
    found = [one for name in names for one in apart(files.SUMMARY, name, stored.get(name), wanted[name])]
    # the warnings are those of now, after what was reported when the run went on or began again, or read a drawing
    before = then.warnings[: len(then.warnings) - len(now.warnings)]
    is_allowed = bool(then.resumed_from) or all(text.endswith((checkpoint.STARTS_ANEW, AS_READ)) for text in before)
    if whole and not (is_allowed and (*before, *now.warnings) == then.warnings):
        found.append(EntryDifference(files.SUMMARY, "warnings", list(then.warnings), list(now.warnings)))
    if (folder / files.DONE).is_file():  # the mark of the end must not contradict run.json
        marked = _read_entries(folder / files.DONE)
        for name in ("run", "status"):
            found += apart(files.DONE, name, marked.get(name), getattr(then, name))
    return tuple(found)


def apart(file: str, entry: str, stored: Any, now: Any) -> Iterator[EntryDifference]:
    """Yield the differences of an entry, or of those in it."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for name, value in stored.items():
            yield from apart(file, f"{entry}.{name}".lstrip("."), value, now.get(name))
    elif isinstance(stored, list) and isinstance(now, list) and len(stored) == len(now):
        for number, values in enumerate(zip(stored, now, strict=True)):
            yield from apart(file, f"{entry}.{number}", *values)
    elif stored != now:
        yield EntryDifference(file, entry, stored, now)


def differing_samples(
    stored: Mapping[str, instruments.ProbeSeries], again: Mapping[str, instruments.ProbeSeries]
) -> Iterator[EntryDifference]:
    """Yield where the samples of each probe first are others, in the column that comes first."""
    for name, now in again.items():
        then, place = stored[name], f"probes/{name}"
        if then.step.tobytes() != now.step.tobytes():
            yield EntryDifference(files.FRAMES, f"{place}/step", len(then), len(now))
            continue
        for column, values in now.columns.items():
            before = then.columns.get(column)
            if before is None:
                yield EntryDifference(files.FRAMES, f"{place}/{column}", None, float(values[0]))
                break
            if before.tobytes() != values.tobytes():
                first = int(np.flatnonzero(before.view(np.int64) != values.view(np.int64))[0])
                where = f"{place}/{column} at step {now.step[first]}"
                yield EntryDifference(files.FRAMES, where, float(before[first]), float(values[first]))
                break


def _read_entries(path: Path) -> dict[str, Any]:
    """Return the entries of a file. Raises InputMissingError or InvalidInputError."""
    try:
        entries = json.loads(input_files.read_limited(path, results.MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"{path}: not the entries of a run: {error}") from error
    if not isinstance(entries, dict):
        raise InvalidInputError(f"{path}: not the entries of a run")
    return entries


@dataclass(frozen=True)
class OriginDifference:
    """One thing that the bits may depend on, as it was when the run was made and as it is now."""

    name: str
    then: str
    now: str


@dataclass(frozen=True)
class RunVerdict:
    """What came of running a stored run again."""

    folder: Path
    changed: tuple[str, ...]  # files that are not as the run left them, or gone
    state: bool  # whether the final state has the same hash,
    table: bool  # and final.csv the same bytes,
    status: tuple[str, str]  # and how the run ended, then and now
    frames: Differences
    origins: tuple[OriginDifference, ...]  # that are not the same as then
    entries: tuple[EntryDifference, ...] = ()  # of run.json and done.json

    @cached_property
    def agrees(self) -> bool:
        """Return True if the folder is what its scenario gives, to the last bit."""
        is_same = self.state and self.table and self.frames.is_none and self.status[0] == self.status[1]
        return is_same and not self.changed and not self.entries

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        return {"agrees": self.agrees, "kind": "run", **asdict(self), "folder": str(self.folder)}


def verify_run(place: Path | str, *, threads: int = 1, on_progress: Watcher = silent) -> RunVerdict:
    """Run the scenario of a run folder again, in memory, and compare everything that the folder keeps.

    A run that was interrupted is repeated as far as it got. Raises InputMissingError where no run is there,
    InvalidInputError (ScenarioError) for files that cannot be read, StoppedEarlyError where the repetition is stopped.
    """
    folder = run_folder.find_run(place)
    summary = results.read_summary(folder / files.SUMMARY)
    changed = results.changed_files(folder, summary)
    try:
        stored = results.read_result(folder)
    except InvalidInputError as error:  # what cannot be read because it was changed is reported as such
        if not changed:
            raise
        why = f"{folder}: changed after the run, by their checksums: {', '.join(changed)}"
        raise InvalidInputError(f"{error}\n{why}") from error
    scenario, was_cut = stored.scenario, summary.status == INTERRUPTED
    if was_cut:  # a run that was interrupted is repeated as far as it got
        time = scenario.time.model_copy(update={"end": summary.simulated_time_s})
        scenario = scenario.model_copy(update={"time": time})
    again = simulate(scenario, threads=threads, on_progress=on_progress)
    if again.status == INTERRUPTED:
        raise StoppedEarlyError(f"{folder}: stopped before the new run was complete")
    origins, is_same_code = origin_differences(summary.environment)
    now = Model(stored.scenario).hash
    if now != summary.scenario_hash:
        origins = (OriginDifference("scenario", summary.scenario_hash, now), *origins)
    return RunVerdict(
        folder,
        changed,
        state=again.summary.final_state_sha256 == summary.final_state_sha256,
        table=csv_text(again.columns).encode() == (folder / files.FINAL).read_bytes(),
        status=(again.status if was_cut else summary.status, again.status),
        frames=differences(stored.frames, again.frames),
        origins=origins,
        entries=(
            *differing_entries(folder, summary, again.summary, same_code=is_same_code),
            *differing_samples(stored.probes, again.probes),
        ),
    )


def origin_differences(then: Mapping[str, str]) -> tuple[tuple[OriginDifference, ...], bool]:
    """Return which entries of an older `environment` are others now, and whether the code is none of them.

    What it lacks cannot be compared. What is named by the hash of other code has another name.
    """
    now = provenance.environment()
    known = [name for name in now if name in then and name.startswith(DECIDES)]
    others = tuple(OriginDifference(name, then[name], now[name]) for name in known if then[name] != now[name])
    return others, not any(one.name.startswith(("blocksim", provenance.ROOM_PREFIX)) for one in others)


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
    origins: tuple[OriginDifference, ...] = ()  # what is not the same as when the sweep was made
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
    base = Model(document)
    cases = plan.cases_of(document, plan.plan_of(base))
    columns, lines = _read_table(folder / TABLE)
    numbers = _numbers(folder, cases, len(lines))
    rows = _chosen(len(lines), sample, seed)
    models = [case.model for row in rows if (case := cases[numbers[row]]).model is not None]
    ends = iter(rows_of(models, os.cpu_count() or 1))
    ranges = Ranges.of(base.scenario)
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
        end = invalid_row(case.problem) if case.model is None else next(ends)
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


def verify_study(folder: Path, study: answer.Study, sample: int = SAMPLE, seed: int = 0) -> tuple[SweepVerdict, ...]:
    """Verify a study; of one that consists of others all of them, and then itself.

    Raises InputMissingError or InvalidInputError for files that cannot be read or do not go together.
    """
    stored, replay = study.answer.read(folder), sweep.Replay.of(folder, by_number=study.is_design)
    parts = [(place, part) for place in study.parts(stored) if (part := answer.study_in(place)) is not None]
    verdicts = [verdict for place, part in parts for verdict in verify_study(place, part, sample, seed)]
    kind = stored.files
    with TemporaryDirectory() as place:
        again = study.repeat(stored, replay, Path(place) / "study")
        values = (answer.without_cases(one.to_dict()) for one in (stored, again))
        entries = tuple(apart(kind.origin, "", *values))
        tables = [path for path in sorted(again.folder.glob("*.csv")) if kind.tables.fullmatch(path.name)]
        cells = [one for path in tables for one in _cells_apart(folder / path.name, manifest.lines_in(path))]
    origins, is_same_code = _origins(folder, kind)
    chosen = _chosen(len(replay.runs), sample, seed)
    peaks = any(observables.PEAK in replay.runs[number][1].row for number in chosen)
    rows = rows_of([replay.runs[number][0].model for number in chosen], os.cpu_count() or 1, peaks=peaks)
    for number, row in zip(chosen, rows, strict=True):
        task, entry = replay.runs[number]
        then: Row = {CASE: entry.case, **entry.row}
        now: Row = {CASE: task.name if is_same_code else entry.case, **row}
        texts = [(name, *(str(as_cell(one.get(name))) for one in (then, now))) for name in dict.fromkeys((*then, *now))]
        cells += [CellDifference(number + 1, entry.case, *text) for text in texts if text[1] != text[2]]
    kept = tuple(verify_run(place) for place in sorted((folder / sweep_folder.CASES).glob("*")) if place.is_dir())
    checked = tuple(number + 1 for number in chosen)
    return (
        *verdicts,
        SweepVerdict(folder, len(replay.runs) or len(parts), checked, tuple(cells), origins, kept, entries),
    )


def _chosen(count: int, sample: int, seed: int) -> list[int]:
    return sorted(random.Random(seed).sample(range(count), min(sample, count)))  # noqa: S311 - no secret


def _origins(folder: Path, kind: sweep_folder.FolderKind) -> tuple[tuple[OriginDifference, ...], bool]:
    """Return what is not the same as when a study was made, and whether its code is known to be."""
    origin = sweep_folder.read_origin(folder, kind)
    return ((), False) if origin is None else origin_differences(origin.environment)


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
        raise InvalidInputError(f"{path}:{short}: {len(lines[short - 2])} cells, not {len(head)}")
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


def _cells(columns: Sequence[str], case: plan.SweepCase, row: Row, ranges: Ranges | None) -> dict[str, str]:
    """Return the cells of a row as texts, as the table of a sweep has them."""
    heads = (head for head in map(Head.read, columns) if head.key in case.settings)
    values: Row = {CASE: case.name, **{str(head): head.cell(case.settings[head.key]) for head in heads}, **row}
    if ranges is not None:
        values[INSIDE] = ranges.hold(row) if row["status"] == FINISHED else None
    cells = {name: as_cell(values.get(name)) for name in columns}
    return {name: "" if cell is None else str(cell) for name, cell in cells.items()}
