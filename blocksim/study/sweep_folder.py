"""The folder of a sweep, or of a search: whose it is, what it came from, and that nothing in it is lost by mistake."""

import csv
import json
import logging
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ValidationError

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError
from blocksim.scenario import Document, Scenario, input_files, overrides
from blocksim.scenario.models.motion import content_of
from blocksim.simulation import files, provenance
from blocksim.study.plan import with_tables

MOST_SHOWN, LONGEST_NAME = 5, 40  # columns in a message, and characters of each
log = logging.getLogger(__name__)
PLAN = "sweep.toml"
CASES = "cases"
SHARD = r"(?:-\d+-of-\d+)?"


class FolderKind:
    """What distinguishes the folders of one kind of study: its plan NAME.toml, its summary NAME.json and its tables."""

    def __init__(self, name: str, what: str, command: str, tables: Mapping[str, str]) -> None:
        """Take what a study is called ("a sweep"), and the names of its tables with the forms of their first lines."""
        self.what, self.command = what, f"blocksim {command} FILE"
        self.plan, self.origin = f"{name}.toml", f"{name}.json"
        self.head = f"# {name.capitalize()} ".encode()  # of the plan, a resolved scenario that is written first
        names = "|".join(tables)
        self.tables = re.compile(names)
        self.leftover = re.compile(rf"\.({names}|{name}\.json|{name}\.toml)\..*")  # of a writer that was killed
        self.results = {
            **{table: files.prefix_kind(form.encode()) for table, form in tables.items()},
            rf"manifest{SHARD}\.jsonl": files.append_only_kind(b'{"number":'),
            rf"timings{SHARD}\.csv": files.append_only_kind(b"case,executor,seconds,host\n"),
            rf"{name}\.json": lambda head: head.startswith(b"{") and b'"began_at":' in head,
        }

    def is_ours(self, path: Path) -> bool:
        """Return True for a file that a study has written, or left half written when it was killed."""
        for pattern, kind in self.results.items():
            if re.fullmatch(pattern, path.name):
                return files.is_written(path, {path.name: kind}, self.plan)
        named = self.leftover.fullmatch(path.name)
        return named is not None and files.is_leftover(path.name, (named[1],)) and path.is_file()


SWEEP = FolderKind(  # shards have tables of their own
    "sweep", "a sweep", "sweep", {rf"sweep{SHARD}\.csv": "case,(?:.*,)?status,reason,seconds(?:,.*)?"}
)
VARIED = "tables"  # folder of the copies of tables that a sweep varies


class StudyOrigin(BaseModel, frozen=True):
    """What sweep.json begins with: versions and machine of whoever began the study, and how cases were drawn."""

    began_at: str
    mode: str | None = None
    seed: int | None = None
    environment: dict[str, str]


def prepare(folder: Path, base: Scenario, name: str, *, overwrite: bool, kind: FolderKind = SWEEP) -> None:
    """Make the folder and write the plan into it. Raises OutputExistsError when something else is there."""
    head = f"{kind.head.decode()}{name}. To run it again: {kind.command}\n"
    tables, plan = files.read_tables(base), base.sweep
    files.make_folder(folder)
    with files.brief_lock(folder):
        try:
            _make_free(folder, head.encode(), tables, kind, overwrite=overwrite)
        except OSError as error:
            raise OutputExistsError(f"{folder}: cannot be created: {error.strerror}") from error
        files.keep_scenario(base, tables, folder, kind.plan, head)
        if read_origin(folder, kind) is None:  # whoever continues with a study did not begin it
            origin = StudyOrigin(
                began_at=datetime.now(UTC).isoformat(timespec="seconds"),
                mode=None if plan is None else plan.mode,
                seed=plan.seed if plan is not None and plan.is_sampled else None,
                environment=provenance.environment(),
            )
            files.write_text(folder / kind.origin, origin.model_dump_json(indent=2) + "\n")


def read_origin(folder: Path, kind: FolderKind = SWEEP) -> StudyOrigin | None:
    """Return what a study came from, None where nobody has begun it. Raises InvalidInputError."""
    path = folder / kind.origin
    try:
        return StudyOrigin.model_validate_json(input_files.read_limited(path, input_files.MEGABYTE))
    except InputMissingError:
        return None
    except ValidationError as error:
        raise InvalidInputError(f"{path}: not the plan of {kind.what}: {str(error).splitlines()[0]}") from None


def _make_free(folder: Path, head: bytes, tables: Mapping[str, bytes], kind: FolderKind, *, overwrite: bool) -> None:
    """Raise OutputExistsError where the folder is not free; with `overwrite` remove what an older study has written."""
    present = [path for path in sorted(folder.iterdir()) if not files.is_leftover(path.name, (kind.plan,))]
    if not present:
        return
    plan = folder / kind.plan
    start = input_files.read_head(plan, len(head)) if files.is_resolved(plan) else b""
    if not start.startswith(kind.head):
        raise OutputExistsError(f"{folder}: holds files that are not {kind.what}; choose another folder with --out")
    if not (overwrite or start == head):
        which = kind.what.replace("a ", "another ", 1)
        raise OutputExistsError(f"{folder}: contains {which}; --overwrite replaces it, --out DIR writes elsewhere")
    for path in present if overwrite else ():
        if path.suffix == ".jsonl" and kind.is_ours(path):
            with input_files.open_regular(path) as file:
                if not files.takes_lock(file.fileno()):
                    how = "wait for it, or write elsewhere with --out DIR"
                    raise OutputExistsError(f"{folder}: {kind.what} is running here; {how}")
    files.refuse_foreign_copies(tables, folder, kind.plan)
    results = (path for path in present if any(re.fullmatch(pattern, path.name) for pattern in kind.results))
    if (foreign := next((path for path in results if not kind.is_ours(path)), None)) is not None:
        raise OutputExistsError(f"{foreign}: not a result of {kind.what}; move it away, or choose another --out DIR")
    if overwrite:  # whatever else lies there stays
        for path in folder.iterdir():
            if path.name != kind.plan and kind.is_ours(path):
                path.unlink()
        cases = folder / CASES
        if cases.is_dir() and not cases.is_symlink():
            for case in cases.iterdir():
                files.remove_run(case)
            with suppress(OSError):  # not empty
                cases.rmdir()


def write_table(path: Path, rows: Iterable[Sequence[object]]) -> None:
    """Write a table of a study, heads first, one row after the other. Raises OutputError."""
    with files.atomic_path(path) as temporary:
        with temporary.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
        files.sync_file(temporary)


def write_answer(path: Path, kind: FolderKind, rows: Iterable[Sequence[object]], answer: Mapping[str, object]) -> None:
    """Write the table of a study (heads first), and its answer into the summary. Raises OutputError."""
    write_table(path, rows)
    origin = read_origin(path.parent, kind)
    begun = {} if origin is None else origin.model_dump(mode="json", exclude_none=True)
    files.write_text(path.parent / kind.origin, json.dumps({**begun, **answer}, indent=2) + "\n")


def case_folder(sweep: Path, case: str) -> Path | None:
    """Return the folder that was kept for a case, None where there is none; links are not followed."""
    folder = sweep / CASES / Path(case).name
    is_real = not (folder.is_symlink() or folder.parent.is_symlink())
    return folder if case and is_real and folder.is_dir() else None


def read_plan(folder: Path) -> Document:
    """Return the plan of a sweep. Raises InputMissingError where the folder holds none."""
    if not (folder / PLAN).exists():
        raise InputMissingError(f"{folder}: not a sweep folder (no {PLAN})")
    document = Document.read(folder / PLAN, is_stored=True)
    if not (folder / VARIED).is_dir():
        return document
    data = with_tables(document.data, document.without_sweep().build())  # what the plan itself names lies beside it
    return replace(document, data=data, folder=folder / VARIED)


def copy_tables(folder: Path, document: Document, vary: Mapping[str, object], *, overwrite: bool) -> None:
    """Copy the tables that varied keys name, so that the sweep can be repeated without them; see `read_plan`.

    They keep their names, in a folder of their own; those outside the folder of the scenario stay where they are.
    Raises OutputExistsError where another file is in the way, and OutputError.
    """
    tables = [values for key, values in vary.items() if overrides.parse_key(key)[-1] == "table"]
    for path in (Path(str(value)) for values in tables if isinstance(values, tuple) for value in values):
        if path.is_absolute() or ".." in path.parts or not (document.folder / path).is_file():
            continue
        copy, content = folder / VARIED / path, content_of(document.folder / path)
        if copy.exists() and not overwrite and copy.read_bytes() != content:
            raise OutputExistsError(f"{copy}: is not the table of this sweep; --overwrite replaces it")
        files.make_folder(copy.parent)
        files.write_bytes(copy, content)
