"""Reproducibility of stored limits, curves of limits and fragility studies.

The study is repeated from its manifest, without running anything, in a folder of its own: its tables and its answer
have to come out again. A sample of its runs, drawn with a seed, is run again and compared by digits, and runs that were
kept are verified as runs.
"""

import csv
import io
import json
import os
import random
import shutil
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document
from blocksim.scenario.bounded_read import read_limited
from blocksim.simulation.movement import PEAK
from blocksim.study.executors import Batch, Execution, Run, Setting, Task
from blocksim.study.executors.ensemble import rows_of
from blocksim.study.fragility import MEMBERS_TABLE, run_fragility
from blocksim.study.fragility import TABLE as COUNTS
from blocksim.study.fragility_plan import read_fragility
from blocksim.study.limit import find_limit, with_sides
from blocksim.study.limit_curve import TABLE as CURVE
from blocksim.study.limit_curve import curve_rows, folder_named
from blocksim.study.limit_plan import read_limit
from blocksim.study.limit_result import TABLE as RUNS
from blocksim.study.limit_result import LimitResult, write_result
from blocksim.study.progress import PATTERN, Entry, read_entries, values_hash
from blocksim.study.rows import Row, as_cell
from blocksim.study.study_pictures import MOST_BYTES
from blocksim.study.sweep_folder import CASES, FRAGILITY, LIMIT, LIMIT_CURVE, OVER, FolderKind, Origin, read_origin
from blocksim.study.sweep_table import lines_in
from blocksim.study.verify_run import EntryDifference, RunVerdict, apart, changed_origins, tells_of_code, verify_run
from blocksim.study.verify_sweep import DEGREES, MM, CellDifference, SweepVerdict, largest

CASE = "case"
ASKED = (None, True, False)  # stiffer springs: what was asked for is not kept
Answer = dict[str, Any]
Look = Callable[[Task], Entry | None]


@dataclass(frozen=True)
class Replay(Execution):
    """What runs nothing: rows come from a manifest."""

    look: Look = lambda _: None
    tasks: list[Task] = field(default_factory=list)  # all that were asked for

    def ready(self) -> tuple[Run, Setting]:
        """Return itself, for tasks one by one."""
        return self.run, Setting(1)

    def for_rounds(self) -> AbstractContextManager[Run]:
        """Give itself."""
        return nullcontext(self.run)

    def run(self, tasks: Iterator[Task], _: Setting) -> Generator[Batch, None, None]:
        """Yield every task with the row that it has. Raises InvalidInputError."""
        for task in tasks:
            entry = self.look(task)
            if entry is None:
                values = ", ".join(f"{key} = {value}" for key, value in task.settings.items())
                message = f"the manifest has no run with {values}"
                raise InvalidInputError(message)
            self.tasks.append(task)
            yield Batch((task,), (entry.row,), 0.0, "")


@dataclass(frozen=True)
class Repeated:
    """A study as it comes out of its manifest."""

    tables: Mapping[str, str]
    answer: Answer
    tasks: Sequence[Task]
    look: Look
    limit: LimitResult | None = None


def verify_study(folder: Path, kind: FolderKind, sample: int, seed: int = 0) -> tuple[SweepVerdict, ...]:
    """Verify a study; of a curve of limits every search, and then the curve.

    Raises InputMissingError or InvalidInputError for files that cannot be read or do not go together.
    """
    if kind is LIMIT_CURVE:
        return _verify_curve(folder, sample, seed)
    return (_verified(folder, kind, _repeated(folder, kind), sample, seed),)


def _verify_curve(folder: Path, sample: int, seed: int) -> tuple[SweepVerdict, ...]:
    answer = _read_answer(folder, LIMIT_CURVE)
    found: list[SweepVerdict] = []
    entries: list[EntryDifference] = []
    searches: dict[float, LimitResult] = {}
    try:
        for point in answer["points"]:
            place = folder / folder_named(float(point[OVER]), answer["over_unit"])
            repeated = _repeated(place, LIMIT)
            found.append(_verified(place, LIMIT, repeated, sample, seed))
            stored = {name: value for name, value in point.items() if name != OVER}
            entries += apart(LIMIT_CURVE.origin, f"{OVER} {point[OVER]:g}", _bare(stored), _bare(repeated.answer))
            searches |= {} if repeated.limit is None else {point[OVER]: repeated.limit}
    except (KeyError, TypeError, ValueError) as error:
        raise _no_answer(folder, LIMIT_CURVE, error) from error
    table = folder / CURVE
    lines = [*lines_in(table)[:1], *curve_rows(searches)]
    cells = tuple(_cells_apart(table, _lines(_text(lines))))
    whole = SweepVerdict(folder, len(searches), (), cells, 0.0, 0.0, (), entries=tuple(entries))
    return (*found, whole)


def _text(rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _verified(folder: Path, kind: FolderKind, repeated: "Repeated", sample: int, seed: int) -> SweepVerdict:
    origin = read_origin(folder, kind)
    origins = () if origin is None else changed_origins(origin.environment)
    is_same_code = origin is not None and not tells_of_code(origins)
    cells = [one for name, text in repeated.tables.items() for one in _cells_apart(folder / name, _lines(text))]
    entries = [*apart(kind.origin, "", _bare(_read_answer(folder, kind)), _bare(repeated.answer))]
    tasks = repeated.tasks
    chosen = sorted(random.Random(seed).sample(range(len(tasks)), min(sample, len(tasks))))  # noqa: S311 - no secret
    known = [entry for number in chosen if (entry := repeated.look(tasks[number])) is not None]  # all were there
    peaks = any(PEAK in entry.row for entry in known)
    rows = rows_of([tasks[number].scenario for number in chosen], os.cpu_count() or 1, peaks=peaks)
    for number, entry, row in zip(chosen, known, rows, strict=True):
        name = tasks[number].name if is_same_code else entry.case
        cells += _row_apart(number + 1, entry, {CASE: name, **row})
    return SweepVerdict(
        folder,
        len(tasks),
        tuple(number + 1 for number in chosen),
        tuple(cells),
        largest(cells, MM),
        largest(cells, DEGREES),
        origins,
        _kept_runs(folder),
        tuple(entries),
    )


def _kept_runs(folder: Path) -> tuple[RunVerdict, ...]:
    """Verify the runs that were kept for pictures."""
    return tuple(verify_run(place) for place in sorted((folder / CASES).glob("*")) if place.is_dir())


def _repeated(folder: Path, kind: FolderKind) -> Repeated:
    """Make tables and answer again from the manifest. Raises InvalidInputError where that is not possible."""
    answer = _read_answer(folder, kind)
    try:
        return _fragility(folder, answer) if kind is FRAGILITY else _limit(folder, answer)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _no_answer(folder, kind, error) from error


def _no_answer(folder: Path, kind: FolderKind, error: Exception) -> InvalidInputError:
    return InvalidInputError(f"{folder / kind.origin}: not the answer of {kind.what}: {error}")


def _limit(folder: Path, answer: Answer) -> Repeated:
    """Search again, with stiffer springs or not as in the first way that leads to the answer, or to any."""
    ends: dict[str, object] = {name: answer[name] for name in ("from", "to")}
    if answer["is_whole"]:
        ends = {name: int(answer[name]) for name in ends}
    elif answer["unit"]:
        ends = {name: f"{answer[name]:.12g} {answer['unit']}" for name in ends}
    span: dict[str, Any] = {**ends, "count": answer["count"], **({"scale": "log"} if answer["is_log"] else {})}
    document = Document.read(folder / LIMIT.plan, is_stored=True)
    plan = read_limit(document, {answer["key"]: span}, stands=answer["stands"], tolerance=answer["tolerance"])
    known = {entry.values: entry for entry in _entries(folder)}
    tried: list[Repeated] = []
    for stiffer in ASKED:
        replay = Replay(look=lambda task: known.get(values_hash(task.settings)))
        with TemporaryDirectory() as place, suppress(InvalidInputError):
            found = find_limit(plan, replay, out=Path(place) / "limit", keep_runs=False, stiffer=stiffer)
            found = _with_kept(found, folder)
            tried.append(replace(_read_repeated(found.folder, LIMIT, (RUNS,), replay), limit=found))
            if _bare(tried[-1].answer) == _bare(answer):
                return tried[-1]
    if not tried:
        message = f"{folder}: the manifest lacks runs of this search"
        raise InvalidInputError(message)
    return tried[0]


def _with_kept(found: LimitResult, folder: Path) -> LimitResult:
    """Return a result with what the runs show that were kept of the stored one; those are not run again."""
    if not (folder / CASES).is_dir():
        return found
    shutil.copytree(folder / CASES, found.folder / CASES)
    result = with_sides(found)
    write_result(result)
    return result


def _fragility(folder: Path, answer: Answer) -> Repeated:
    unit = answer["unit"]
    levels = [f"{one['intensity']!r} {unit}" if unit else one["intensity"] for one in answer["points"]]
    plan = read_fragility(
        Document.read(folder / FRAGILITY.plan, is_stored=True),
        {answer["key"]: levels},
        answer["scatter"],
        members=answer["members"],
        fails=answer["fails"].split(" or "),
        seed=answer["seed"],
    )
    known = {entry.number: entry for entry in _entries(folder)}
    replay = Replay(look=lambda task: known.get(task.number))
    with TemporaryDirectory() as place:
        out = Path(place) / "fragility"
        run_fragility(plan, replay, out=out)
        return _read_repeated(out, FRAGILITY, (COUNTS, MEMBERS_TABLE), replay)


def _read_repeated(out: Path, kind: FolderKind, tables: Sequence[str], replay: Replay) -> Repeated:
    texts = {name: (out / name).read_text(encoding="utf-8") for name in tables}
    return Repeated(texts, _read_answer(out, kind), replay.tasks, replay.look)


def _entries(folder: Path) -> Iterator[Entry]:
    for path in sorted(folder.glob(PATTERN)):
        yield from (entry for _, entry in read_entries(path))


def _read_answer(folder: Path, kind: FolderKind) -> Answer:
    path = folder / kind.origin
    try:
        return dict(json.loads(read_limited(path, MOST_BYTES)))
    except (ValueError, TypeError, RecursionError) as error:
        raise _no_answer(folder, kind, error) from error


def _bare(answer: Any) -> Any:
    """Return an answer without what says where it came from, and which runs were kept."""
    if isinstance(answer, dict):
        return {name: _bare(value) for name, value in answer.items() if name not in {*Origin.model_fields, CASE}}
    return [_bare(one) for one in answer] if isinstance(answer, list) else answer


def _lines(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


def _cells_apart(path: Path, now: list[list[str]]) -> Iterator[CellDifference]:
    """Yield the cells of a stored table that are not those of the table as it comes out again."""
    stored = lines_in(path)
    heads = stored[0] if stored else []
    if [len(stored), *stored[:1]] != [len(now), *now[:1]]:
        shown = [f"{len(lines)} lines, {len(lines[0]) if lines else 0} columns" for lines in (stored, now)]
        yield CellDifference(0, path.name, "", *shown)
        return
    for row, (then, again) in enumerate(zip(stored[1:], now[1:], strict=True), start=1):
        for column, one, other in zip(heads, then, again, strict=False):
            if one != other:
                yield CellDifference(row, f"{path.name} {then[0]}", column, one, other)


def _row_apart(number: int, entry: Entry, now: Row) -> Iterator[CellDifference]:
    """Yield the cells of a run in the manifest that do not come out again."""
    stored: Row = {CASE: entry.case, **entry.row}
    for name in dict.fromkeys((*stored, *now)):
        then, again = (str(as_cell(row.get(name))) for row in (stored, now))
        if then != again:
            yield CellDifference(number, entry.case, name, then, again)
