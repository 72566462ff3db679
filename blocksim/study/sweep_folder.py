"""The folder of a sweep: whose it is, what it came from, and that nothing in it is lost by mistake."""

import shutil
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ValidationError

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError
from blocksim.scenario import Document, Scenario
from blocksim.simulation.atomic import write_text
from blocksim.simulation.copies import keep_tables, read_tables, resolved_beside
from blocksim.simulation.output_folder import make_folder
from blocksim.simulation.provenance import environment
from blocksim.study.manifest import PATTERN, is_in_use

PLAN = "sweep.toml"
ORIGIN = "sweep.json"
CASES = "cases"
HEAD = "# Sweep "
RESULTS = (PATTERN, "timings*.csv", "sweep*.csv", ORIGIN)


class Origin(BaseModel, frozen=True):
    """The entries of sweep.json: versions, machine and command of whoever began the sweep, and how cases were drawn."""

    began_at: str
    mode: str | None = None
    seed: int | None = None
    environment: dict[str, str]


def prepare(folder: Path, base: Scenario, name: str, *, overwrite: bool) -> None:
    """Make the folder and write the plan into it. Raises OutputExistsError when something else is there."""
    head = f"{HEAD}{name}. To run it again: blocksim sweep FILE\n"
    tables = read_tables(base)
    try:
        make_folder(folder)
        _make_free(folder, head, overwrite=overwrite)
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    write_text(folder / PLAN, head + resolved_beside(base, tables))
    keep_tables(tables, folder)
    if not (folder / ORIGIN).is_file():  # whoever goes on with a sweep did not begin it
        write_text(folder / ORIGIN, _origin_of(base).model_dump_json(indent=2) + "\n")


def _origin_of(base: Scenario) -> Origin:
    plan = base.sweep
    seed = plan.seed if plan is not None and plan.is_sampled else None
    return Origin(
        began_at=datetime.now(UTC).isoformat(timespec="seconds"),
        mode=None if plan is None else plan.mode,
        seed=seed,
        environment=environment(),
    )


def read_origin(folder: Path) -> Origin | None:
    """Return what a sweep came from, None where it is older than this file. Raises InvalidInputError."""
    path = folder / ORIGIN
    try:
        return Origin.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValidationError) as error:
        message = f"{path}: not what a sweep came from: {str(error).splitlines()[0]}"
        raise InvalidInputError(message) from None


def _make_free(folder: Path, head: str, *, overwrite: bool) -> None:
    present = {path.name for path in folder.iterdir() if not path.name.startswith(f".{PLAN}.")}
    if not present:
        return
    plan = (folder / PLAN).read_text(encoding="utf-8", errors="replace") if PLAN in present else ""
    if not plan.startswith(HEAD):
        message = f"{folder}: holds files that are not a sweep; choose another folder with --out"
        raise OutputExistsError(message)
    if overwrite:
        _empty(folder)
    elif not plan.startswith(head):
        message = f"{folder}: another sweep is there; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)


def _empty(folder: Path) -> None:
    """Remove all results, unless somebody is writing them."""
    if any(is_in_use(path) for path in folder.glob(PATTERN)):
        message = f"{folder}: a sweep is running here; wait for it, or write elsewhere with --out DIR"
        raise OutputExistsError(message)
    for pattern in RESULTS:
        for path in folder.glob(pattern):
            path.unlink()
    shutil.rmtree(folder / CASES, ignore_errors=True)


def read_plan(folder: Path) -> Document:
    """Return the plan of a sweep. Raises InputMissingError where the folder holds none."""
    if not (folder / PLAN).is_file():
        message = f"{folder}: no sweep is there (no {PLAN})"
        raise InputMissingError(message)
    return Document.read(folder / PLAN)
