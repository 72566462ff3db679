"""Where a run lies, as a person names it; reads nothing but names of files."""

from collections.abc import Sequence
from pathlib import Path

from blocksim.errors import InputMissingError
from blocksim.scenario import load_scenario
from blocksim.simulation import folder as files

FINISHED = "finished"
"""Status of a run that has come to its end."""


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
        message = f"{place}: no finished run of exactly this scenario in {folder}; first: blocksim run {place}"
        raise InputMissingError(message)
    return folder


def _run_in(place: Path, needed: Sequence[str]) -> Path:
    missing = [name for name in needed if not (place / name).is_file()]
    if not missing:
        return place
    if (place / files.SCENARIO).is_file():
        message = f"{place}: this run is not complete (there is no {missing[0]}); blocksim run --overwrite repeats it"
        raise InputMissingError(message)
    newest = files.newest_finished(place)
    if newest is None:
        message = f"{place}: no finished run in this folder; blocksim run SCENARIO makes one"
        raise InputMissingError(message)
    return newest
