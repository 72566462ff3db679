"""Where a run lies, as a person names it; reads nothing but names of files."""

from collections.abc import Sequence
from pathlib import Path

from blocksim.errors import InputMissingError
from blocksim.scenario import load_scenario
from blocksim.simulation import folder as files

FINISHED = "finished"
"""Status of a run that has come to its end."""
SWEEP = "sweep.csv"
"""What makes a folder one of a sweep."""


def find_run(place: Path | str, needed: Sequence[str] = (files.SUMMARY,)) -> Path:
    """Return the run folder meant by a run folder, by `results/<name>` (newest finished run) or by a scenario file.

    A folder counts as a run when it has all `needed` files. Raises InputMissingError with the command that helps.
    """
    place = Path(place)
    if not place.exists():
        message = f"{place}: no such run folder or scenario file"
        raise InputMissingError(message)
    if place.is_dir():
        return _run_in(place, needed)
    folder = files.default_folder(load_scenario(place))
    if not files.is_finished(folder):
        raise InputMissingError(_not_run(place, folder))
    return folder


def _not_run(scenario: Path, folder: Path) -> str:
    """Say that a scenario has not been run as it is, and where runs of it with other values are."""
    newest = files.newest_finished(folder.parent) if folder.parent.is_dir() else None
    message = f"{scenario}: no finished run of this scenario as it is; first: blocksim run {scenario}"
    if newest is None:
        return message
    return f"{message}\nruns with other values (--set, or an older file) are in {folder.parent}; the newest: {newest}"


def _run_in(place: Path, needed: Sequence[str]) -> Path:
    missing = [name for name in needed if not (place / name).is_file()]
    if not missing:
        return place
    if (place / files.SCENARIO).is_file():
        message = f"{place}: this run is not complete (there is no {missing[0]}); blocksim run --overwrite repeats it"
        raise InputMissingError(message)
    newest = files.newest_finished(place)
    if newest is not None:
        return newest
    sweep = next((entry for entry in sorted(place.iterdir()) if (entry / SWEEP).is_file()), None)
    found = f"but a sweep: {sweep}" if sweep is not None else "blocksim run SCENARIO makes one"
    message = f"{place}: no finished run in this folder{', ' if sweep is not None else '; '}{found}"
    raise InputMissingError(message)
