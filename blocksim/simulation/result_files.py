"""The files of a result folder: their names, which of them blocksim wrote, and copies of the tables of a scenario.

A folder is one of a run if its resolved scenario bears blocksim's mark and it holds nothing but files that a run names;
`--overwrite` replaces these. The resolved scenario is written first and removed last, so no other file of a run is ever
alone. A scenario or a table that a person has put in the place of one is never touched.

Copies of the files that a scenario names are kept beside its resolved form, so that the folder can move.
"""

import csv
import json
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Self

from pydantic import BaseModel

from blocksim.errors import BlocksimError, OutputExistsError
from blocksim.scenario import Scenario, body_table_contents, motion_table_content, scenario_to_toml
from blocksim.scenario.bounded_read import MEGABYTE, read_head, read_limited
from blocksim.scenario.models.drive import MOST_BODY_TABLES
from blocksim.scenario.probes import probe_names
from blocksim.scenario.resolved import MARK
from blocksim.simulation.atomic import sha256_of, write_bytes, write_text

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


def grows_from(start: bytes) -> Kind:
    """Return the kind of content that is appended to, and may have been torn in its first line by a kill."""

    def is_kind(head: bytes) -> bool:
        first = head.split(b"\n", 1)[0].rstrip(b"\0")
        return first.startswith(start.rstrip()) or (first != b"" and start.startswith(first))

    return is_kind


def heads(form: bytes) -> Kind:
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
    text = head + resolved_beside(scenario, tables, is_varied=plan != SCENARIO)
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


def resolved_beside(scenario: Scenario, tables: Mapping[str, bytes], *, is_varied: bool = False) -> str:
    """Return the resolved scenario (TOML) that refers to the copies beside it; the base of others is `is_varied`."""
    names = {name: name if name in tables else None for name in (EXPERIMENT, MOTION)}
    of_bodies = dict(zip(body_table_contents(scenario), BODY_MOTIONS, strict=False))
    return scenario_to_toml(scenario, names[EXPERIMENT], names[MOTION], of_bodies, is_varied=is_varied)
