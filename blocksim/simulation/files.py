"""Result folders and files: written whole or not at all, their names, which of them blocksim wrote, who may write."""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import re
import secrets
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario import Model, Scenario, input_files, resolution, scenario_to_toml
from blocksim.scenario.models.motion import MOST_BODY_TABLES, TABLED
from blocksim.simulation.provenance import run_hash

DIGITS = 8  # in the names of files that are being written
PERMISSIONS = 0o666  # of new files, less what the umask takes away
NO_SUCH_SYNC = {errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM}  # file systems that cannot do it to folders


@contextlib.contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a name beside a file, with its suffix, to write to; in the end the new file takes the place of the old one.

    It has the permissions of the old one, else those that the user's umask leaves. What a writer of the same file left
    half written when it was killed goes. Raises OutputError when writing fails; whatever happens on the way, the old
    file stays and nothing else is left.
    """
    temporary: Path | None = None
    handle = -1
    try:
        _remove_leftovers(path)
        while temporary is None:  # not `tempfile`, which takes away what the umask would leave, and defaults of folders
            name = path.with_name(f".{path.name}.{secrets.token_hex(DIGITS // 2)}{path.suffix}")
            handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL, PERMISSIONS)
            with contextlib.suppress(OSError):  # file systems without locks
                fcntl.flock(handle, fcntl.LOCK_EX)  # so that others see that the writer lives
            if name.exists():
                temporary = name
            else:
                os.close(handle)  # taken for a leftover before it was locked
        old = permissions_of(path)
        mode = stat.S_IMODE(os.fstat(handle).st_mode) if old is None else old
        if old is not None:
            with contextlib.suppress(OSError):  # a group that one is not in
                os.fchown(handle, -1, path.stat().st_gid)
            os.fchmod(handle, old | stat.S_IWUSR)  # before it holds anything
        yield temporary
        temporary.chmod(mode)
        temporary.replace(path)
        try:  # a file whose name is not on the disk is lost when the power fails
            sync_file(path.parent)
        except OSError as error:
            if error.errno not in NO_SUCH_SYNC:
                raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            os.close(handle)  # only now: with it goes the lock


def permissions_of(path: Path) -> int | None:
    """Return the permissions of a file, None where there is none, or a link."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return None
    return stat.S_IMODE(mode) if stat.S_ISREG(mode) else None


def _remove_leftovers(path: Path) -> None:
    """Remove what was half written of a file by those that do not live any more; where files have no locks, nothing."""
    form = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{{DIGITS}}}{re.escape(path.suffix)}")
    with os.scandir(path.parent) as entries:
        leftovers = [entry.path for entry in entries if form.fullmatch(entry.name)]
    for leftover in leftovers:
        with contextlib.suppress(OSError):  # its writer lives, or it has gone
            handle = os.open(leftover, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.unlink(leftover)  # noqa: PTH108 - a name from scandir
            finally:
                os.close(handle)


def sync_file(path: Path) -> None:
    """Wait until what was written to a file is on the disk, where it outlives a power failure. Raises OSError."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Give a file that takes the place of `path` at the end, when it is on the disk. Raises as `atomic_path`."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file through a temporary one beside it; raises OutputError and leaves nothing behind when that fails."""
    with atomic_file(path) as file:
        file.write(content)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `write_bytes` does."""
    write_bytes(path, text.encode())


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


SCENARIO = "scenario.toml"  # resolved; written first
EXPERIMENT = "experiment.csv"  # copy of the table that the scenario names
MOTION = "motion.csv"  # copy of the table of the support's motion
BODY_MOTIONS = tuple(f"motion-{k}.csv" for k in range(1, 1 + MOST_BODY_TABLES))  # of those of the motions of bodies
FINAL = "final.csv"
JOINTS = "joints.csv"  # what joints across structures carry
SOILS = "soils.csv"  # where soils ended, in scenarios that have any
FRAMES = "run.h5"
PROBE = "probe-"  # and its name: CSV of a probe
PROBE_TABLE = re.compile(r"probe-[A-Za-z0-9._-]+\.csv|\.probe-[A-Za-z0-9._-]+\.csv\.[a-z0-9_]{8}(?:\.csv)?")
SUMMARY = "run.json"
DONE = "done.json"  # written last: the folder of a run without it is not finished
CHECKPOINTS = ("checkpoint.0", "checkpoint.1")  # written by turns while a run continues, removed when it has finished
OURS = (SCENARIO, EXPERIMENT, MOTION, *BODY_MOTIONS, FINAL, JOINTS, SOILS, FRAMES, SUMMARY, DONE, *CHECKPOINTS)
HEAD_BYTES = 1 << 16  # the heads of tables of many varied keys, too
MOST_BYTES = 10 * input_files.MEGABYTE  # of a scenario or a summary
TABLE_BYTES = input_files.MEGABYTE  # of a table of an experiment, which is not read if larger
RESOLVED = resolution.MARK.encode()
CHANGED = "changed since blocksim wrote it; move it away, or write elsewhere with --out DIR"
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


def _is_of_kind(path: Path, is_kind: Kind) -> bool:
    """Return True for a file of a kind, or one that holds nothing: zeros are what a power failure leaves."""
    try:
        head = input_files.read_head(path, HEAD_BYTES)
    except BlocksimError:
        return False
    return not head.strip(b"\0") or is_kind(head)


def is_resolved(plan: Path) -> bool:
    """Return True for a scenario (or the plan of a sweep) that blocksim wrote, False for that of a person."""
    # a sweep has a line of its own before
    return _is_of_kind(plan, lambda head: any(line.startswith(RESOLVED) for line in head.split(b"\n")[:2]))


COPIES = (EXPERIMENT, MOTION, *BODY_MOTIONS)


def is_of_run(path: Path) -> bool:
    """Return True for a file that a run has written, or left half written when it was killed, by its name.

    Only in the folder of a run: see `is_resolved`.
    """
    name = path.name
    if path.is_symlink() or not path.is_file():
        return False
    if name in COPIES:
        return name in copies(path.parent)
    return name in OURS or PROBE_TABLE.fullmatch(name) is not None or is_leftover(name, OURS)


def is_written(path: Path, kinds: Mapping[str, Kind], plan: str) -> bool:
    """Return True if a study wrote a file: one of these kinds, a copy that the plan beside it names, or a leftover."""
    if path.is_symlink() or not path.is_file():
        return False
    if path.name in COPIES:
        return path.name in copies(path.parent, plan)
    if path.name in kinds:
        return _is_of_kind(path, kinds[path.name])
    return is_leftover(path.name, (*kinds, *COPIES))


def is_leftover(name: str, names: Iterable[str]) -> bool:
    """Return True for what is left of one of these files when its writer was killed: `.final.csv.k2j3h4_x.csv`."""
    return any(
        re.fullmatch(rf"\.{re.escape(of)}\.(?:new|\w{{8}}(?:{re.escape(Path(of).suffix)})?)", name) for of in names
    )


def copies(folder: Path, plan: str = SCENARIO) -> frozenset[str]:
    """Return the names of the copies of tables that belong to a folder: those that the resolved scenario names."""
    if not is_resolved(folder / plan):
        return frozenset()
    lines = input_files.read_limited(folder / plan, MOST_BYTES).splitlines()
    present = [name for name in COPIES if (folder / name).is_file() and not (folder / name).is_symlink()]
    return frozenset(name for name in present if f'table = "{name}"'.encode() in lines)


def read_tables(scenario: Scenario) -> dict[str, bytes]:
    """Return the tables that a scenario names, by the name of their copies.

    To be called before a folder is emptied: they may lie in there, where a run is repeated. Raises as `read_limited`.
    """
    tables = {}
    if scenario.experiment is not None:
        tables[EXPERIMENT] = input_files.read_limited(scenario.experiment.table, TABLE_BYTES, links=True)
    contents = {table.digest: table.content for table in resolution.tables_of_bodies(scenario).values()}
    tables |= dict(zip(BODY_MOTIONS, contents.values(), strict=False))
    if isinstance(scenario.motion, TABLED):
        tables[MOTION] = scenario.motion.table.content
    return tables


def keep_scenario(
    scenario: Scenario, tables: Mapping[str, bytes], folder: Path, plan: str = SCENARIO, head: str = ""
) -> str:
    """Write the resolved scenario with a head, and copies of its tables beside it; return the text (TOML).

    Copies that are not needed any more go. Raises OutputExistsError, before anything is written, where a file of
    somebody else is in the place of one of them, and OutputError.
    """
    before = copies(folder, plan)
    refuse_foreign_copies(tables, folder, plan)
    if os.path.lexists(folder / plan) and not is_resolved(folder / plan):
        raise OutputExistsError(f"{folder / plan}: {CHANGED}")
    names = {name: name if name in tables else None for name in (EXPERIMENT, MOTION)}
    digests = dict.fromkeys(table.digest for table in resolution.tables_of_bodies(scenario).values())
    of_bodies = dict(zip(digests, BODY_MOTIONS, strict=False))
    is_varied = plan != SCENARIO  # the base of others
    text = head + scenario_to_toml(scenario, names[EXPERIMENT], names[MOTION], of_bodies, is_varied=is_varied)
    write_text(folder / plan, text)
    for name, content in tables.items():
        write_bytes(folder / name, content)
    for name in before - tables.keys():
        (folder / name).unlink(missing_ok=True)
    return text


def refuse_foreign_copies(tables: Mapping[str, bytes], folder: Path, plan: str = SCENARIO) -> None:
    """Raise OutputExistsError where a table of somebody else has the name of a copy, and another content."""
    ours = copies(folder, plan)
    for path, content in ((folder / name, content) for name, content in tables.items() if name not in ours):
        is_same = False
        with contextlib.suppress(BlocksimError):
            is_same = input_files.read_limited(path, len(content)) == content
        if os.path.lexists(path) and not is_same:
            raise OutputExistsError(f"{path}: {CHANGED}")


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
    if not os.path.lexists(path):
        if not path.parent.exists():
            raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")
        return
    try:
        with input_files.open_regular(path, links=True) as file:
            text = file.read(END_BYTES)
            if (size := file.seek(0, os.SEEK_END)) > END_BYTES:
                file.seek(max(END_BYTES, size - END_BYTES))
                text += file.read()
    except BlocksimError as error:
        raise OutputExistsError(f"{error}; write elsewhere with --out") from None
    is_pdf = text.startswith(b"%PDF-")
    is_marked = set(PDF_CREATOR.findall(text)) == {NAME} if is_pdf else MARKS.search(text) is not None
    if not (overwrite or is_marked):
        raise OutputExistsError(f"{path}: already exists; rerun with --overwrite")


RESULTS = Path("results")
DONE_BYTES = input_files.MEGABYTE  # of done.json
PATIENCE = 30.0  # s that files of a study may take to change together; jobs of an array begin at the same time
POLL = 0.01  # s
FINISHED = "contains another run; --overwrite replaces it, --out DIR writes elsewhere"
UNFINISHED = (
    "contains an unfinished run (stopped or failed); --resume continues it, --overwrite replaces it, "
    "--out DIR writes elsewhere"
)


def default_folder(model: Model) -> Path:
    """Return results/<name>/<hash of the resolved scenario and the code>."""
    return RESULTS / model.scenario.name / run_hash(model)


def holds_run(folder: Path, model: Model) -> bool:
    """Return True if the folder holds a finished run of exactly this scenario and code."""
    with contextlib.suppress(BlocksimError, ValueError, KeyError, TypeError, RecursionError):
        done = json.loads(input_files.read_limited(folder / DONE, DONE_BYTES))
        return bool(done["run"] == run_hash(model))
    return False


@contextlib.contextmanager
def _locate_errors(place: Path, what: str, kind: type[BlocksimError] = OutputExistsError) -> Iterator[None]:
    """Raise an error that names a folder, and what cannot be done to it, for what the system raises."""
    try:
        yield
    except OSError as error:
        raise kind(f"{place}: cannot be {what}: {error.strerror or error}") from error


def make_folder(folder: Path) -> None:
    """Create a folder and those around it, where they are missing; links to folders are followed.

    Raises OutputExistsError where something that is no folder is in the way, or none can be created there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        with contextlib.suppress(OSError):  # a name that is too long, which the system reports
            for place in reversed((folder, *folder.parents)):
                if place.is_symlink() and not place.exists():
                    reason = f"{place} is a broken link"
                elif place.exists() and not place.is_dir():
                    reason = f"{place} is a file, not a folder"
        raise OutputExistsError(f"{folder}: cannot be created: {reason}") from error


def prepare_folder(folder: Path, *, overwrite: bool) -> None:
    """Create an empty folder for a run, removing a run from it where `overwrite` is given.

    Raises OutputExistsError when something is there that may not go, or the folder cannot be created.
    """
    make_folder(folder)
    with _locate_errors(folder, "created"):
        present = _run_files(folder)
        if present and not overwrite:
            raise OutputExistsError(f"{folder}: {FINISHED if (folder / DONE).is_file() else UNFINISHED}")
        # the mark of a finished run goes first, and last what shows that this is the folder of a run
        for name in sorted(present, key=lambda name: (name != DONE, name == SCENARIO)):
            (folder / name).unlink(missing_ok=True)


def check_folder(folder: Path) -> None:
    """Raise OutputExistsError unless a run in this folder may continue: nothing but an unfinished run is there."""
    with _locate_errors(folder, "read"):
        _run_files(folder)
        if (folder / DONE).is_file():
            raise OutputExistsError(f"{folder}: {FINISHED}")


def _run_files(folder: Path) -> set[str]:
    """Return the names of what a run has written here. Raises OutputExistsError where there is anything else."""
    present = {path.name for path in folder.iterdir()}
    if foreign := _foreign_names(folder, present):
        raise OutputExistsError(
            f"{folder}: holds files that are not a blocksim run ({foreign[0]}); "
            "move them away, or choose another folder with --out"
        )
    return present


def _foreign_names(folder: Path, present: set[str]) -> list[str]:
    """Return the names of files that no run has written; all, where there is no scenario that a run has resolved."""
    is_resolved_here = is_resolved(folder / SCENARIO)
    if SCENARIO in present and not is_resolved_here:
        return [SCENARIO]
    foreign = sorted(name for name in present if not is_of_run(folder / name))
    if foreign or is_resolved_here:
        return foreign
    return sorted(name for name in present if not is_leftover(name, OURS))


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
def brief_lock(
    folder: Path, patience: float = PATIENCE, reason: str = "another process is writing here"
) -> Iterator[None]:
    """Keep other processes out of a folder while files in it change together; waits (s) for them to be ready.

    Raises OutputExistsError with the reason where one has the folder longer, or where it cannot be opened.
    """
    with _locate_errors(folder, "opened"):
        handle = os.open(folder, os.O_RDONLY)
    latest = time.monotonic() + patience
    try:
        while not takes_lock(handle):
            if time.monotonic() > latest:
                raise OutputExistsError(f"{folder}: {reason}; wait for it, or write elsewhere with --out DIR")
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
    with brief_lock(folder, 0.0, "a run is in progress here"):
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # not empty
                for place in missing:
                    place.rmdir()


def clear_remains(folder: Path, names: Iterable[str]) -> None:
    """Remove files of these names, and what was half written when a run was killed. Raises OutputError."""
    chosen = set(names)
    with _locate_errors(folder, "written", OutputError):
        for path in folder.iterdir():
            if path.name in chosen or is_leftover(path.name, OURS):
                path.unlink(missing_ok=True)


def remove_run(folder: Path) -> None:
    """Remove a folder with the run in it; a link, or a folder that holds anything else, stays. Raises OSError."""
    if folder.is_symlink() or not folder.is_dir():
        return
    present = {path.name for path in folder.iterdir()}
    if not _foreign_names(folder, present):
        for name in sorted(present, key=SCENARIO.__eq__):
            (folder / name).unlink(missing_ok=True)
        folder.rmdir()


def newest_run(folder: Path) -> Path | None:
    """Return the newest finished run right below a folder, or None."""
    finished = [path.parent for path in folder.glob(f"*/{DONE}")]
    return max(finished, key=lambda path: (path / DONE).stat().st_mtime_ns, default=None)
