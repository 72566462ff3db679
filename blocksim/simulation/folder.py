"""Result folders and files: their names, which of them blocksim wrote, what state a run is in, who may write."""

import contextlib
import csv
import fcntl
import json
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, Self

from pydantic import BaseModel

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario import Scenario, body_table_contents, motion_table_content, scenario_to_toml
from blocksim.scenario.events import probe_names
from blocksim.scenario.input_files import MEGABYTE, open_regular, read_head, read_limited
from blocksim.scenario.models.motion import MOST_BODY_TABLES
from blocksim.scenario.resolved import MARK
from blocksim.simulation.atomic import sha256_of, write_bytes, write_text
from blocksim.simulation.provenance import run_hash

SCENARIO = "scenario.toml"  # resolved; written first
EXPERIMENT = "experiment.csv"  # copy of the table that the scenario names
MOTION = "motion.csv"  # copy of the table of the support's motion
BODY_MOTIONS = tuple(f"motion-{k}.csv" for k in range(1, 1 + MOST_BODY_TABLES))  # of those of the motions of bodies
FINAL = "final.csv"
SOILS = "soils.csv"  # where soils ended, in scenarios that have any
FRAMES = "run.h5"
PROBE = "probe-"  # and its name: CSV of a probe
PROBE_TABLE = re.compile(r"probe-[A-Za-z0-9._-]+\.csv|\.probe-[A-Za-z0-9._-]+\.csv\.[a-z0-9_]{8}(?:\.csv)?")
SUMMARY = "run.json"
DONE = "done.json"  # written last: a folder without it is not finished
CHECKPOINTS = ("checkpoint.0", "checkpoint.1")  # written by turns while a run continues, removed when it has finished
OURS = (SCENARIO, EXPERIMENT, MOTION, *BODY_MOTIONS, FINAL, SOILS, FRAMES, SUMMARY, DONE, *CHECKPOINTS)
HEAD_BYTES = 4096
LONGEST_HEADER = 100_000  # bytes
MOST_BYTES = 10 * MEGABYTE  # of a scenario or a summary
TABLE_BYTES = MEGABYTE  # of a table of an experiment, which is not read if larger
RESOLVED = MARK.encode()
Kind = Callable[[bytes], bool]  # whether the first HEAD_BYTES of a file are of a kind


def append_only_kind(start: bytes) -> Kind:
    """Return the kind of content that is appended to, and may have been torn in its first line by a kill."""

    def is_kind(head: bytes) -> bool:
        first = head.split(b"\n", 1)[0].rstrip(b"\0")
        return first.startswith(start.rstrip()) or (first != b"" and start.startswith(first))

    return is_kind


def prefix_kind(form: bytes) -> Kind:
    """Return the kind of a CSV file whose first line has this form (a regular expression)."""
    return lambda head: re.fullmatch(form, head.split(b"\n", 1)[0].rstrip(b"\r")) is not None


class TableRecord(BaseModel, frozen=True):
    """What the summary of a study says of a table that was written."""

    header: str  # empty where it is longer than a summary can hold
    sha256: str

    @classmethod
    def of(cls, path: Path) -> Self:
        """Return that of a table, which may still have another name. Raises OSError."""
        return cls(header=header_of(path), sha256=sha256_of(path))


def header_of(path: Path) -> str:
    """Return the first line of a table, nothing where it is long. Raises OSError."""
    with path.open("rb") as file:
        line = file.readline(LONGEST_HEADER).rstrip(b"\r\n")
    return "" if len(line) >= LONGEST_HEADER else line.decode(errors="replace")


def is_own(path: Path, records: Iterable[TableRecord]) -> bool:
    """Return True for a table as it was written, by its whole header and its checksum, or one that holds nothing.

    `records` are of what was written last, and before: they are noted first, and a kill may come between.
    """
    try:
        head = read_head(path, HEAD_BYTES)
    except BlocksimError:
        return False
    return not head.strip(b"\0") or TableRecord.of(path) in records


def columns_added(path: Path, records: Iterable[TableRecord]) -> list[str] | None:
    """Return the columns that a table has beyond those that were written, where these are known.

    None where some of those are not there: it is another table.
    """
    present = _columns(header_of(path))
    written = [columns for record in records if set(columns := _columns(record.header)) <= set(present)]
    if not written:
        return None
    return [name for name in present if name not in written[-1]] if written[-1] else []


def _columns(header: str) -> list[str]:
    return next(csv.reader([header]), [])


def has_keys(*names: str) -> Kind:
    """Return the kind of content that is a JSON object with these keys near its start, however it is laid out."""
    keys = [re.compile(rb'"' + name.encode() + rb'"\s*:') for name in names]
    return lambda head: head.lstrip().startswith(b"{") and all(key.search(head) for key in keys)


COPIES = (EXPERIMENT, MOTION, *BODY_MOTIONS)


def probe_tables(scenario: Scenario) -> list[str]:
    """Return the names of the CSV files of the probes of a scenario."""
    return [f"{PROBE}{name}.csv" for name in probe_names(scenario)]


def is_of_run(path: Path) -> bool:
    """Return True for a file that a run has written, or left half written when it was killed, by its name.

    Only in the folder of a run: see `is_resolved`.
    """
    name = path.name
    if not _is_plain_file(path):
        return False
    if name in COPIES:
        return name in copies(path.parent)
    return name in OURS or PROBE_TABLE.fullmatch(name) is not None or is_leftover(name, OURS)


def is_written(path: Path, kinds: Mapping[str, Kind], plan: str) -> bool:
    """Return True if a study wrote a file: one of these kinds, a copy that the plan beside it names, or a leftover."""
    if not _is_plain_file(path):
        return False
    if path.name in COPIES:
        return path.name in copies(path.parent, plan)
    if path.name in kinds:
        return _is_of_kind(path, kinds[path.name])
    return is_leftover(path.name, (*kinds, *COPIES))


def _is_of_kind(path: Path, kind: Kind) -> bool:
    try:
        head = read_head(path, HEAD_BYTES)
    except BlocksimError:
        return False
    return not head.strip(b"\0") or kind(head)


def is_leftover(name: str, names: Iterable[str]) -> bool:
    """Return True for what is left of one of these files when its writer was killed: `.final.csv.k2j3h4_x.csv`."""
    return any(
        re.fullmatch(rf"\.{re.escape(of)}\.(?:new|\w{{8}}(?:{re.escape(Path(of).suffix)})?)", name) for of in names
    )


def origin_of(plan: str) -> str:
    """Return the name of the summary beside a resolved scenario, of a run or of a study."""
    return SUMMARY if plan == SCENARIO else Path(plan).with_suffix(".json").name


def copies(folder: Path, plan: str = SCENARIO) -> frozenset[str]:
    """Return the names of the copies of tables that belong to a folder.

    Those are what run.json (of a sweep sweep.json, and so on) has listed, as long as nobody has changed them; where it
    lists none (of a run that was killed), those that the resolved scenario names.
    """
    if not is_resolved(folder / plan):
        return frozenset()
    listed = _listed(folder / origin_of(plan))
    lines = read_limited(folder / plan, MOST_BYTES).splitlines()
    present = {name: listed.get(name) for name in COPIES if _is_plain_file(folder / name)}
    return frozenset(
        name
        for name, digest in present.items()
        if (f'table = "{name}"'.encode() in lines if digest is None else digest == sha256_of(folder / name))
    )


def _listed(path: Path) -> dict[str, object]:
    """Return the checksums (hexadecimal) of files that a summary lists by name."""
    try:
        return dict(json.loads(read_limited(path, MOST_BYTES))["sha256"])
    except (BlocksimError, ValueError, KeyError, TypeError, RecursionError):
        return {}


def is_resolved(plan: Path) -> bool:
    """Return True for a scenario (or the plan of a sweep) that blocksim wrote, False for that of a person."""
    try:
        lines = read_head(plan, HEAD_BYTES).splitlines(keepends=True)
    except BlocksimError:
        return False
    is_marked = any(line.startswith(RESOLVED) for line in lines[:2])  # a sweep has a line of its own before
    return is_marked or not b"".join(lines).strip(b"\0")  # zeros or nothing are what a power failure leaves


def _is_plain_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


def read_tables(scenario: Scenario) -> dict[str, bytes]:
    """Return the tables that a scenario names, by the name of their copies.

    To be called before a folder is emptied: they may lie in there, where a run is repeated. Raises as `read_limited`.
    """
    tables = {}
    if scenario.experiment is not None:
        tables[EXPERIMENT] = read_limited(scenario.experiment.table, TABLE_BYTES, links=True)
    tables |= dict(zip(BODY_MOTIONS, body_table_contents(scenario).values(), strict=False))
    motion = motion_table_content(scenario)
    return tables if motion is None else {**tables, MOTION: motion}


def keep_scenario(
    scenario: Scenario, tables: Mapping[str, bytes], folder: Path, plan: str = SCENARIO, head: str = ""
) -> str:
    """Write the resolved scenario with a head, and copies of its tables beside it; return the text (TOML).

    Copies that are not needed any more go. Raises OutputExistsError, before anything is written, where a file of
    somebody else is in the place of one of them, and OutputError.
    """
    before = copies(folder, plan)
    refuse_foreign_copies(tables, folder, plan)
    if _is_there(folder / plan) and not is_resolved(folder / plan):
        raise _foreign(folder / plan)
    text = head + resolved_text(scenario, tables, is_varied=plan != SCENARIO)
    write_text(folder / plan, text)
    for name, content in tables.items():
        write_bytes(folder / name, content)
    for name in before - tables.keys():
        (folder / name).unlink(missing_ok=True)
    return text


def refuse_foreign_copies(tables: Mapping[str, bytes], folder: Path, plan: str = SCENARIO) -> None:
    """Raise OutputExistsError where a table of somebody else has the name of a copy, and another content."""
    ours = copies(folder, plan)
    for name, content in tables.items():
        path = folder / name
        if _is_there(path) and not (name in ours or _holds(path, content)):
            raise _foreign(path)


def _is_there(path: Path) -> bool:
    return path.exists() or path.is_symlink()


def _holds(path: Path, content: bytes) -> bool:
    try:
        return read_limited(path, len(content)) == content
    except BlocksimError:
        return False


def _foreign(path: Path) -> OutputExistsError:
    return OutputExistsError(
        f"{path}: changed since blocksim wrote it; move it away, or write elsewhere with --out DIR"
    )


def resolved_text(scenario: Scenario, tables: Mapping[str, bytes], *, is_varied: bool = False) -> str:
    """Return the resolved scenario (TOML) that refers to the copies beside it; the base of others is `is_varied`."""
    names = {name: name if name in tables else None for name in (EXPERIMENT, MOTION)}
    of_bodies = dict(zip(body_table_contents(scenario), BODY_MOTIONS, strict=False))
    return scenario_to_toml(scenario, names[EXPERIMENT], names[MOTION], of_bodies, is_varied=is_varied)


NAME = b"blocksim"
END_BYTES = 1 << 16  # that are looked at, at the start and at the end of a file
GEOJSON_MARK = '"generator": "blocksim"'
DXF_PROPERTY = "generator", "blocksim"
MARKS = re.compile(
    rb"""
    \A\x89PNG.*tEXtSoftware\0blocksim
    |<dc:creator>\s*<cc:Agent>\s*<dc:title>blocksim</dc:title>
    |\AGIF.*!\xfe\x08blocksim\0
    |\A.{4}ftyp.*\xa9cmt.{4}data.{8}blocksim
    |\A.{0,2000}<meta[ ]name="generator"[ ]content="blocksim[ ]report">
    |\A\{"generator":[ ]"blocksim"
    |\$CUSTOMPROPERTYTAG\s+1\s+generator\s+9\s+\$CUSTOMPROPERTY\s+1\s+blocksim\s
    |\A\x89HDF.*VTKHDF\0.*block_names\0
    |\Atime_s,(?:block,x_mm,y_mm,rotation_deg|body_a,body_b,x_mm),
    |\A\s*\{\s*"machine":\s*\{.*"measurements":\s*\[
    """,
    re.DOTALL | re.VERBOSE,
)
PDF_CREATOR = re.compile(rb"/Creator \((.*?)\)")  # a text with a picture of blocksim in it names another one too


def refuse_foreign(path: Path, *, overwrite: bool = False) -> None:
    """Raise OutputExistsError where something is in the way of a file: one of others, unless `overwrite`, or no file.

    To be called before the work begins. Raises OutputError where the folder for the file is missing.
    """
    if not (path.exists() or path.is_symlink()):
        if not path.parent.exists():
            message = f"{path}: cannot be written: there is no folder {path.parent}"
            raise OutputError(message)
        return
    try:
        with open_regular(path, links=True) as file:
            if overwrite or _is_marked(file):
                return
    except BlocksimError as error:
        message = f"{error}; write elsewhere with --out"
        raise OutputExistsError(message) from None
    message = f"{path}: already exists; rerun with --overwrite"
    raise OutputExistsError(message)


def _is_marked(file: BinaryIO) -> bool:
    """Return True for a file that bears the mark of blocksim at its start or its end."""
    text = file.read(END_BYTES)
    if (size := file.seek(0, os.SEEK_END)) > END_BYTES:
        file.seek(max(END_BYTES, size - END_BYTES))
        text += file.read()
    if text.startswith(b"%PDF-"):
        return set(PDF_CREATOR.findall(text)) == {NAME}
    return MARKS.search(text) is not None


RESULTS = Path("results")
DONE_BYTES = MEGABYTE  # of done.json
PATIENCE = 30.0  # s that files of a study may take to change together; jobs of an array begin at the same time
POLL = 0.01  # s


def default_folder(scenario: Scenario) -> Path:
    """Return results/<name>/<hash of the resolved scenario and the code>."""
    return RESULTS / scenario.name / run_hash(scenario)


def is_finished(folder: Path) -> bool:
    """Return True if the folder holds a finished run."""
    return (folder / DONE).is_file()


def holds_run(folder: Path, scenario: Scenario) -> bool:
    """Return True if the folder holds a finished run of exactly this scenario and code."""
    with contextlib.suppress(BlocksimError, ValueError, KeyError, TypeError, RecursionError):
        done = json.loads(read_limited(folder / DONE, DONE_BYTES))
        return bool(done["run"] == run_hash(scenario))
    return False


def make_folder(folder: Path) -> None:
    """Create a folder and those around it, where they are missing; links to folders are followed.

    Raises OutputExistsError where something that is no folder is in the way, or none can be created there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"{folder}: cannot be created: {_what_is_in_the_way(folder) or error.strerror or error}"
        raise OutputExistsError(message) from error


def _what_is_in_the_way(folder: Path) -> str:
    """Return which part of a path is no folder and what it is instead, or nothing."""
    try:
        for place in (folder, *folder.parents):
            if place.is_symlink() and not place.exists():
                return f"{place} is a broken link"
            if place.exists() and not place.is_dir():
                return f"{place} is a file, not a folder"
    except OSError:  # a name that is too long, which the system reports
        pass
    return ""


def prepare_folder(folder: Path, *, overwrite: bool) -> None:
    """Create an empty folder for a run, removing a run from it where `overwrite` is given.

    Raises OutputExistsError when something is there that may not go, or the folder cannot be created.
    """
    try:
        make_folder(folder)
        present = {path.name for path in folder.iterdir()}
        _refuse_foreign(folder, present)
        if present and not overwrite:
            _refuse_finished(folder)
            message = (
                f"{folder}: contains an unfinished run (stopped or failed); --resume continues it, "
                "--overwrite replaces it, --out DIR writes elsewhere"
            )
            raise OutputExistsError(message)
        # the mark of a finished run goes first, and last what shows that this is the folder of a run
        for name in sorted(present, key=lambda name: (name != DONE, name == SCENARIO)):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error


def check_folder(folder: Path) -> None:
    """Raise OutputExistsError unless a run in this folder may continue: nothing but an unfinished run is there."""
    try:
        present = {path.name for path in folder.iterdir()}
        _refuse_foreign(folder, present)
        _refuse_finished(folder)
    except OSError as error:
        message = f"{folder}: cannot be read: {error.strerror}"
        raise OutputExistsError(message) from error


def takes_lock(handle: int) -> bool:
    """Take the lock of an open file or folder; False where another process has it.

    The lock goes with the process, however that ends. File systems that know no locks let everybody have it.
    """
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


@contextlib.contextmanager
def brief_lock(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder while files in it change together; waits for them to be ready.

    Raises OutputExistsError where one has the folder for long, as a run in it, or where it cannot be opened.
    """
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        message = f"{folder}: cannot be opened: {error.strerror}"
        raise OutputExistsError(message) from error
    latest = time.monotonic() + PATIENCE
    try:
        while not takes_lock(handle):
            if time.monotonic() > latest:
                message = f"{folder}: another process is writing here; wait for it, or write elsewhere with --out DIR"
                raise OutputExistsError(message)
            time.sleep(POLL)
        yield
    finally:
        os.close(handle)


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Make a folder, where it is missing, and keep other runs out of it. Raises OutputExistsError where one has it.

    What was made goes again where nothing was written: Ctrl-C while the solver is compiled leaves no trace.
    """
    missing = [place for place in (folder, *folder.parents) if not place.exists()]  # the innermost first
    make_folder(folder)
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        message = f"{folder}: cannot be opened: {error.strerror}"
        raise OutputExistsError(message) from error
    try:
        if not takes_lock(handle):
            message = f"{folder}: a run is in progress here; wait for it, or write elsewhere with --out DIR"
            raise OutputExistsError(message)
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # not empty
                for place in missing:
                    place.rmdir()
    finally:
        os.close(handle)


def clear_remains(folder: Path, names: Iterable[str]) -> None:
    """Remove files of these names, and what was half written when a run was killed. Raises OutputError."""
    chosen = set(names)
    try:
        for path in folder.iterdir():
            if path.name in chosen or is_leftover(path.name, OURS):
                path.unlink(missing_ok=True)
    except OSError as error:
        message = f"{folder}: cannot be written: {error.strerror}"
        raise OutputError(message) from error


def remove_run(folder: Path) -> None:
    """Remove a folder with the run in it; a link, or a folder that holds anything else, stays. Raises OSError."""
    if folder.is_symlink() or not folder.is_dir():
        return
    present = {path.name for path in folder.iterdir()}
    if not _foreign_folder(folder, present):
        for name in sorted(present, key=SCENARIO.__eq__):
            (folder / name).unlink(missing_ok=True)
        folder.rmdir()


def _refuse_finished(folder: Path) -> None:
    if is_finished(folder):
        message = f"{folder}: contains another run; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)


def _refuse_foreign(folder: Path, present: set[str]) -> None:
    """Raise OutputExistsError unless everything here was written by a run."""
    if foreign := _foreign_folder(folder, present):
        raise OutputExistsError(
            f"{folder}: holds files that are not a blocksim run ({foreign[0]}); "
            "move them away, or choose another folder with --out"
        )


def _foreign_folder(folder: Path, present: set[str]) -> list[str]:
    """Return the names of files that no run has written; all, where there is no scenario that a run has resolved."""
    is_resolved_here = is_resolved(folder / SCENARIO)
    if SCENARIO in present and not is_resolved_here:
        return [SCENARIO]
    foreign = sorted(name for name in present if not is_of_run(folder / name))
    if foreign or is_resolved_here:
        return foreign
    return sorted(name for name in present if not is_leftover(name, OURS))


def newest_finished(folder: Path) -> Path | None:
    """Return the newest finished run right below a folder, or None."""
    finished = [path.parent for path in folder.glob(f"*/{DONE}")]
    return max(finished, key=lambda path: (path / DONE).stat().st_mtime_ns, default=None)


def unfinished_siblings(folder: Path) -> list[Path]:
    """Return the folders beside one in which checkpoints of runs that did not finish wait."""
    checkpoints = (path for name in CHECKPOINTS for path in folder.parent.glob(f"*/{name}"))
    return sorted({path.parent for path in checkpoints if path.parent != folder and not is_finished(path.parent)})
