"""The folder of one run: where it lies, what state it is in, how its files are named."""

import contextlib
import json
from collections.abc import Iterable
from pathlib import Path

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario import Scenario
from blocksim.scenario.limited import MEGABYTE, read_limited
from blocksim.simulation.output_folder import make_folder
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.written import RUN_KINDS, is_leftover, is_written

RESULTS = Path("results")
SCENARIO = "scenario.toml"  # resolved; written first
EXPERIMENT = "experiment.csv"  # copy of the table that the scenario names
MOTION = "motion.csv"  # copy of the table of the support's motion
FINAL = "final.csv"
FRAMES = "run.h5"
SUMMARY = "run.json"
DONE = "done.json"  # written last: a folder without it is not finished
CHECKPOINTS = ("checkpoint.0", "checkpoint.1")  # written by turns while a run continues, removed when it has finished
OURS = (SCENARIO, EXPERIMENT, MOTION, FINAL, FRAMES, SUMMARY, DONE, *CHECKPOINTS)

MOST_BYTES = MEGABYTE  # of done.json


def default_folder(scenario: Scenario) -> Path:
    """Return results/<name>/<hash of the resolved scenario and the code>."""
    return RESULTS / scenario.name / run_hash(scenario)


def is_finished(folder: Path) -> bool:
    """Return True if the folder holds a finished run."""
    return (folder / DONE).is_file()


def holds_run(folder: Path, scenario: Scenario) -> bool:
    """Return True if the folder holds a finished run of exactly this scenario and code."""
    with contextlib.suppress(BlocksimError, ValueError, KeyError, TypeError, RecursionError):
        done = json.loads(read_limited(folder / DONE, MOST_BYTES))
        return bool(done["run"] == run_hash(scenario))
    return False


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
                f"{folder}: a run that did not finish (stopped or failed) is there; --resume continues it, "
                "--overwrite replaces it, --out DIR writes elsewhere"
            )
            raise OutputExistsError(message)
        for name in sorted(present, key=DONE.__ne__):  # the mark of a finished run goes first
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
    present = list(folder.iterdir())
    if all(is_written(path, RUN_KINDS) for path in present):
        for path in present:
            path.unlink(missing_ok=True)
        folder.rmdir()


def _refuse_finished(folder: Path) -> None:
    if is_finished(folder):
        message = f"{folder}: another run is there; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)


def _refuse_foreign(folder: Path, present: set[str]) -> None:
    """Raise OutputExistsError unless everything here was written by a run."""
    foreign = sorted(name for name in present if not is_written(folder / name, RUN_KINDS))
    if foreign:
        raise OutputExistsError(
            f"{folder}: holds files that are not a blocksim run ({foreign[0]}); "
            "move them away, or choose another folder with --out"
        )


def newest_finished(folder: Path) -> Path | None:
    """Return the newest finished run right below a folder, or None."""
    finished = [path.parent for path in folder.glob(f"*/{DONE}")]
    return max(finished, key=lambda path: (path / DONE).stat().st_mtime_ns, default=None)


def unfinished_beside(folder: Path) -> list[Path]:
    """Return the folders beside one in which checkpoints of runs that did not finish wait."""
    checkpoints = (path for name in CHECKPOINTS for path in folder.parent.glob(f"*/{name}"))
    return sorted({path.parent for path in checkpoints if path.parent != folder and not is_finished(path.parent)})
