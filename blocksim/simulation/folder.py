"""The folder of one run: where it lies, what state it is in, how its files are named."""

import contextlib
import json
from pathlib import Path

from blocksim.errors import OutputExistsError
from blocksim.scenario import Scenario
from blocksim.simulation.provenance import run_hash

RESULTS = Path("results")
SCENARIO = "scenario.toml"
FINAL = "final.csv"
FRAMES = "run.h5"
SUMMARY = "run.json"
DONE = "done.json"  # written last: a folder without it is not finished
OURS = (SCENARIO, FINAL, FRAMES, SUMMARY, DONE)


def default_folder(scenario: Scenario) -> Path:
    """Return results/<name>/<hash of the resolved scenario and the code>."""
    return RESULTS / scenario.name / run_hash(scenario)


def is_finished(folder: Path) -> bool:
    """Tell whether the folder holds a finished run."""
    return (folder / DONE).is_file()


def holds_run(folder: Path, scenario: Scenario) -> bool:
    """Tell whether the folder holds a finished run of exactly this scenario and code."""
    if not is_finished(folder):
        return False
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        done = json.loads((folder / DONE).read_text(encoding="utf-8"))
        return bool(done["run"] == run_hash(scenario))
    return False


def prepare_folder(folder: Path, *, overwrite: bool) -> None:
    """Create an empty folder for a run, removing our own files from it where `overwrite` is given.

    Raises OutputExistsError when something is there that may not go, or the folder cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        present = {path.name for path in folder.iterdir()}
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    _refuse_foreign(folder, present)
    if present and not overwrite:
        what = "another run is there" if DONE in present else "an unfinished run is there"
        message = f"{folder}: {what}; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)
    for name in (DONE, *OURS):  # the mark of a finished run goes first
        (folder / name).unlink(missing_ok=True)


def _refuse_foreign(folder: Path, present: set[str]) -> None:
    foreign = sorted(name for name in present if name not in OURS and not name.endswith(".csv"))
    if present and (SCENARIO not in present or foreign):
        example = foreign[0] if foreign else sorted(present)[0]
        message = f"{folder}: holds files that are not a blocksim run ({example}); choose another folder with --out"
        raise OutputExistsError(message)


def newest_finished(folder: Path) -> Path | None:
    """Return the newest finished run right below a folder, or None."""
    finished = [path.parent for path in folder.glob(f"*/{DONE}")]
    return max(finished, key=lambda path: (path / DONE).stat().st_mtime, default=None)
