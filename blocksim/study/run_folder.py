"""Stored runs: found as a person names them, and read as pictures and tables need them.

Finished, failed, stopped, killed or still in progress.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError
from blocksim.scenario import Model, spelling
from blocksim.simulation import files, instruments, results, safety, trajectory
from blocksim.simulation.stores.hdf5 import read_frames, read_probes
from blocksim.study.rows import FINISHED, TABLE

MOST_FOLDERS = 5  # named in a message


class HasFolder(Protocol):
    """A result of a run, or of a study, that may lie in a folder."""

    @property
    def folder(self) -> Path | None:
        """Where it lies, None for one that is in memory only."""
        ...


Place = Path | str | HasFolder


def folder_of(place: Place) -> Path:
    """Return where a run or a study lies. Raises InvalidInputError for a scenario, and a result not kept."""
    if isinstance(place, Path | str):
        return Path(place)
    folder = getattr(place, "folder", None)  # a scenario has none
    if folder is None:
        name = getattr(place, "name", "run")
        how = "run it with out=FOLDER to store what pictures need, or use its own plot, animate and report"
        message = f"{name} is in memory only; {how}"
        raise InvalidInputError(message)
    return Path(folder)


def find_run(place: Path | str, needed: Sequence[str] = (files.SUMMARY,)) -> Path:
    """Return the run folder meant by a run folder, by `results/<name>` (newest finished run) or by a scenario file.

    A folder counts as a run when it has all `needed` files. Raises InputMissingError with the command that helps, and
    InvalidInputError for a table.
    """
    place = Path(place)
    if not place.exists():
        raise InputMissingError(f"{place}: no such run folder or scenario file")
    if place.is_dir():
        return _run_in(place, needed)
    if place.suffix.lower() == ".csv":
        message = f"{place}: this is a table, not a run; a run folder, results/NAME or a scenario file is needed"
        raise InvalidInputError(message)
    folder = files.default_folder(Model(place))
    if not (folder / files.DONE).is_file():
        message = f"{place}: no finished run of this scenario without changes; first: blocksim run {place}"
        newest = files.newest_run(folder.parent) if folder.parent.is_dir() else None
        if newest is not None:
            others = "runs with other values (--set, or an older file) are in"
            message += f"\n{others} {folder.parent}; the newest: {newest}"
        raise InputMissingError(message)
    return folder


def _run_in(place: Path, needed: Sequence[str]) -> Path:
    missing = [name for name in needed if not (place / name).is_file()]
    if not missing:
        return place
    if (place / files.SCENARIO).is_file():
        message = f"{place}: this run is not complete (no {missing[0]}); repeat it with blocksim run --overwrite"
        raise InputMissingError(message)
    newest = files.newest_run(place)
    if newest is not None:
        return newest
    if (place / TABLE).is_file():
        instead = "blocksim plot draws it, sweep --keep-cases keeps a run folder for every case"
        raise InputMissingError(f"{place}: this is a sweep, not a run; {instead}")
    begun = [path.parent for path in sorted(place.glob(f"*/{files.FRAMES}"))]
    sweeps = [path.parent for path in sorted(place.glob(f"*/{TABLE}"))]
    below = sorted({path.parents[1] for path in place.glob(f"*/*/{files.DONE}")})
    for found, what in ((begun, "but an unfinished run"), (sweeps, "but a sweep"), (below, "but runs of scenarios")):
        if found:
            message = f"{place}: no finished run in this folder, {what}: {spelling.list_names(found, MOST_FOLDERS)}"
            raise InputMissingError(message)
    raise InputMissingError(f"{place}: no finished run in this folder; blocksim run SCENARIO makes one")


class StoredRun(NamedTuple):
    """What a run has left so far."""

    folder: Path
    model: Model
    frames: trajectory.Frames
    events: tuple[results.EventRecord, ...]  # that have happened; none where run.json is missing or damaged
    remark: str  # for whoever examines the frames; empty for a finished run that was meant for certain
    probes: Callable[[], Mapping[str, instruments.ProbeSeries]]  # samples by name
    joints: Mapping[str, safety.Safety] = {}  # across structures, as settled and at the end


def read_run(place: Path | str) -> StoredRun:
    """Return the run meant by a run folder, by `results/<name>` or by a scenario file; only its frames are needed.

    Raises InputMissingError, ScenarioError, or InvalidInputError for frames that cannot be read.
    """
    folder = find_run(place, needed=(files.SCENARIO, files.FRAMES))
    model = Model.stored(folder / files.SCENARIO)
    frames = read_frames(folder / files.FRAMES, model)
    events: tuple[results.EventRecord, ...] = ()
    joints: Mapping[str, safety.Safety] = {}
    state = "this run was killed or is still running"
    if (folder / files.SUMMARY).is_file():
        state = f"{files.SUMMARY} of this run is damaged"
        with suppress(BlocksimError):
            summary = results.read_summary(folder / files.SUMMARY)
            joints = summary.joints
            events, was = summary.events, "was" if summary.status == "interrupted" else "has"
            state = f"this run {was} {summary.status} ({summary.reason})" if summary.status != FINISHED else ""
    end = f"{folder}: {state}; its {len(frames)} frames end at {float(frames.time[-1]):.4g} s"
    probes = partial(read_probes, folder / files.FRAMES, model)
    return StoredRun(folder, model, frames, events, end if state else choice(Path(place), folder), probes, joints)


def choice(place: Path, folder: Path) -> str:
    """Say which run was taken where a folder holds several; changed by --set, they have the same name."""
    count = sum(1 for _ in place.glob(f"*/{files.DONE}")) if place.is_dir() and place != folder else 0
    return f"{place}: the newest of {count} runs is taken: {folder}" if count > 1 else ""
