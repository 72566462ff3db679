"""The folder of one run: where it lies, how its files are named, what state it is in, and who may write into it.

No more than one run at a time writes into a folder, and nothing that a run has not written is removed from it.
"""

import contextlib
import fcntl
import json
import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario import Scenario
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.result_files import (
    BODY_MOTIONS,
    CHECKPOINTS,
    DONE,
    EXPERIMENT,
    FINAL,
    FRAMES,
    MOTION,
    OURS,
    SCENARIO,
    SOILS,
    SUMMARY,
    is_leftover,
    is_of_run,
    is_resolved,
)

RESULTS = Path("results")
DONE_BYTES = MEGABYTE  # of done.json
PATIENCE = 30.0  # s that files of a study may take to change together; jobs of an array begin at the same time
POLL = 0.01  # s

__all__ = [
    "BODY_MOTIONS",
    "CHECKPOINTS",
    "DONE",
    "EXPERIMENT",
    "FINAL",
    "FRAMES",
    "MOTION",
    "OURS",
    "RESULTS",
    "SCENARIO",
    "SOILS",
    "SUMMARY",
    "brief_lock",
    "check_folder",
    "clear_remains",
    "default_folder",
    "folder_lock",
    "holds_run",
    "is_finished",
    "make_folder",
    "newest_finished",
    "prepare_folder",
    "remove_run",
    "takes_lock",
    "unfinished_beside",
]


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
    if not _foreign(folder, present):
        for name in sorted(present, key=SCENARIO.__eq__):
            (folder / name).unlink(missing_ok=True)
        folder.rmdir()


def _refuse_finished(folder: Path) -> None:
    if is_finished(folder):
        message = f"{folder}: contains another run; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)


def _refuse_foreign(folder: Path, present: set[str]) -> None:
    """Raise OutputExistsError unless everything here was written by a run."""
    if foreign := _foreign(folder, present):
        raise OutputExistsError(
            f"{folder}: holds files that are not a blocksim run ({foreign[0]}); "
            "move them away, or choose another folder with --out"
        )


def _foreign(folder: Path, present: set[str]) -> list[str]:
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


def unfinished_beside(folder: Path) -> list[Path]:
    """Return the folders beside one in which checkpoints of runs that did not finish wait."""
    checkpoints = (path for name in CHECKPOINTS for path in folder.parent.glob(f"*/{name}"))
    return sorted({path.parent for path in checkpoints if path.parent != folder and not is_finished(path.parent)})
