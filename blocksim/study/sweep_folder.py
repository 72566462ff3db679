"""The folder of a sweep, or of a search: whose it is, what it came from, and that nothing in it is lost by mistake."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ValidationError

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError
from blocksim.scenario import Document, Scenario
from blocksim.scenario.bounded_read import MEGABYTE, read_head, read_limited
from blocksim.simulation.atomic import write_text
from blocksim.simulation.folder import make_folder, remove_run
from blocksim.simulation.provenance import environment
from blocksim.simulation.result_files import (
    Kind,
    begins,
    grows_from,
    is_leftover,
    is_resolved,
    is_written,
    keep_scenario,
    origin_of,
    read_tables,
    refuse_foreign_copies,
)
from blocksim.study.progress import is_in_use

PLAN = "sweep.toml"
CASES = "cases"
SHARD = r"(?:-\d+-of-\d+)?"


@dataclass(frozen=True, eq=False)
class FolderKind:
    """What distinguishes the folders of one kind of study."""

    what: str  # a sweep
    command: str
    plan: str  # resolved scenario with what is varied, written first
    head: bytes  # of the plan
    results: Mapping[str, Kind]  # kinds of content by the patterns of their names
    leftover: re.Pattern[str]  # names of what is left of them when their writer was killed

    @property
    def origin(self) -> str:
        """Name of the file that says what the study came from."""
        return origin_of(self.plan)

    def kind_of(self, name: str) -> Kind | None:
        """Return the kind of content that a file of this name has, None for a file that is no result."""
        return next((kind for pattern, kind in self.results.items() if re.fullmatch(pattern, name)), None)

    def is_ours(self, path: Path) -> bool:
        """Return True for a file that a study has written, or left half written when it was killed."""
        kind = self.kind_of(path.name)
        if kind is not None:
            return is_written(path, {path.name: kind}, self.plan)
        named = self.leftover.fullmatch(path.name)
        return named is not None and is_leftover(path.name, (named[1],)) and path.is_file()


MANIFESTS: Mapping[str, Kind] = {rf"manifest{SHARD}\.jsonl": grows_from(b'{"number":')}
ORIGINS = begins(b'{\n  "began_at": "')
SWEEP = FolderKind(
    what="a sweep",
    command="blocksim sweep FILE",
    plan=PLAN,
    head=b"# Sweep ",
    results={  # shards have files of their own
        rf"sweep{SHARD}\.csv": begins(b"case,"),
        **MANIFESTS,
        rf"timings{SHARD}\.csv": grows_from(b"case,executor,seconds,host\n"),
        r"sweep\.json": ORIGINS,
    },
    leftover=re.compile(r"\.(sweep[-\w]*\.csv|sweep\.json|sweep\.toml)\..*"),
)
LIMIT = FolderKind(
    what="a limit",
    command="blocksim limit FILE",
    plan="limit.toml",
    head=b"# Limit ",
    results={r"limit\.csv": begins(b"value"), r"limit\.json": ORIGINS, **MANIFESTS},
    leftover=re.compile(r"\.(limit\.csv|limit\.json|limit\.toml)\..*"),
)
OVER = "over"
LIMIT_CURVE = FolderKind(
    what="a curve of limits",
    command="blocksim limit FILE",
    plan="limits.toml",
    head=b"# Limits ",
    results={r"limits\.csv": begins(OVER.encode()), r"limits\.json": ORIGINS},
    leftover=re.compile(r"\.(limits\.csv|limits\.json|limits\.toml)\..*"),
)
INTENSITY = "intensity"
FRAGILITY = FolderKind(
    what="a fragility study",
    command="blocksim fragility FILE",
    plan="fragility.toml",
    head=b"# Fragility ",
    results={
        rf"members{SHARD}\.csv": begins(b"case,"),
        r"fragility\.csv": begins(INTENSITY.encode()),
        r"fragility\.json": ORIGINS,
        rf"timings{SHARD}\.csv": grows_from(b"case,executor,seconds,host\n"),
        **MANIFESTS,
    },
    leftover=re.compile(r"\.(members[-\w]*\.csv|fragility\.csv|fragility\.json|fragility\.toml)\..*"),
)


class Origin(BaseModel, frozen=True):
    """What sweep.json begins with: versions and machine of whoever began the study, and how cases were drawn."""

    began_at: str
    mode: str | None = None
    seed: int | None = None
    environment: dict[str, str]
    sha256: dict[str, str] = {}  # of the copies of tables, as they were written


def prepare(folder: Path, base: Scenario, name: str, *, overwrite: bool, kind: FolderKind = SWEEP) -> None:
    """Make the folder and write the plan into it. Raises OutputExistsError when something else is there."""
    head = f"{kind.head.decode()}{name}. To run it again: {kind.command}\n"
    tables = read_tables(base)
    try:
        make_folder(folder)
        _make_free(folder, head.encode(), tables, kind, overwrite=overwrite)
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    keep_scenario(base, tables, folder, kind.plan, head)
    _keep_origin(folder, base, tables, kind)


def _keep_origin(folder: Path, base: Scenario, tables: Mapping[str, bytes], kind: FolderKind) -> None:
    """Write it where there is none: whoever continues with a study did not begin it; renew its checksums."""
    known = read_origin(folder, kind)
    sums = {name: hashlib.sha256(content).hexdigest() for name, content in tables.items()}
    if known is None or known.sha256 != sums:
        origin = (known or _origin_of(base)).model_copy(update={"sha256": sums})
        write_text(folder / kind.origin, origin.model_dump_json(indent=2) + "\n")


def _origin_of(base: Scenario) -> Origin:
    plan = base.sweep
    seed = plan.seed if plan is not None and plan.is_sampled else None
    return Origin(
        began_at=datetime.now(UTC).isoformat(timespec="seconds"),
        mode=None if plan is None else plan.mode,
        seed=seed,
        environment=environment(),
    )


def read_origin(folder: Path, kind: FolderKind = SWEEP) -> Origin | None:
    """Return what a study came from, None where it is older than this file. Raises InvalidInputError."""
    path = folder / kind.origin
    try:
        return Origin.model_validate_json(read_limited(path, MEGABYTE))
    except InputMissingError:
        return None
    except ValidationError as error:
        message = f"{path}: not the plan of {kind.what}: {str(error).splitlines()[0]}"
        raise InvalidInputError(message) from None


def _make_free(folder: Path, head: bytes, tables: Mapping[str, bytes], kind: FolderKind, *, overwrite: bool) -> None:
    """Raise OutputExistsError where the folder is not free; with `overwrite` remove what an older study has written."""
    present = [path for path in sorted(folder.iterdir()) if not is_leftover(path.name, (kind.plan,))]
    if not present:
        return
    if not is_resolved(folder / kind.plan) or read_head(folder / kind.plan, len(kind.head)) != kind.head:
        message = f"{folder}: holds files that are not {kind.what}; choose another folder with --out"
        raise OutputExistsError(message)
    is_same = read_head(folder / kind.plan, len(head)) == head
    if not (overwrite or is_same):
        which = kind.what.replace("a ", "another ", 1)
        message = f"{folder}: contains {which}; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)
    _refuse_foreign(present, kind)
    refuse_foreign_copies(tables, folder, kind.plan)
    if overwrite:
        _empty(folder, kind)


def _refuse_foreign(present: Sequence[Path], kind: FolderKind) -> None:
    """Raise OutputExistsError where a file of somebody else has the name of a result."""
    foreign = next((path for path in present if kind.kind_of(path.name) and not kind.is_ours(path)), None)
    if foreign is not None:
        whose = kind.what.replace("a ", "the ", 1)
        message = f"{foreign}: changed since {whose} wrote it; move it away, or write elsewhere with --out DIR"
        raise OutputExistsError(message)


def _empty(folder: Path, kind: FolderKind) -> None:
    """Remove the results of a study, unless somebody is writing them; whatever else lies there stays."""
    results = [path for path in folder.iterdir() if path.name != kind.plan and kind.is_ours(path)]
    if any(is_in_use(path) for path in results if path.suffix == ".jsonl"):
        message = f"{folder}: {kind.what} is running here; wait for it, or write elsewhere with --out DIR"
        raise OutputExistsError(message)
    for path in results:
        path.unlink()
    cases = folder / CASES
    if cases.is_dir() and not cases.is_symlink():
        for case in cases.iterdir():
            remove_run(case)
        with suppress(OSError):  # not empty
            cases.rmdir()


def case_folder(sweep: Path, case: str) -> Path | None:
    """Return the folder that was kept for a case, None where there is none; links are not followed."""
    folder = sweep / CASES / Path(case).name
    is_real = not (folder.is_symlink() or folder.parent.is_symlink())
    return folder if case and is_real and folder.is_dir() else None


def read_plan(folder: Path) -> Document:
    """Return the plan of a sweep. Raises InputMissingError where the folder holds none."""
    if not (folder / PLAN).exists():
        message = f"{folder}: not a sweep folder (no {PLAN})"
        raise InputMissingError(message)
    return Document.read(folder / PLAN, is_stored=True)
