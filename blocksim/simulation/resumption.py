"""Where a run that did not finish can continue: the newest whole checkpoint in its folder, and the frames before it.

What would continue to other bits is refused, with the keys, versions or folders of code that differ.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.resolved import deciding_values
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint import Origin, Stored, origin_of, read_checkpoint
from blocksim.simulation.recorder import Recorder, Rows, rows_of_frames
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.simulation.stores.hdf5_reader import read_systems

MOST_NAMED = 6  # differences in a message
NONE = "none"
REMEDY = "--overwrite starts again"
REMEDIES = f"{REMEDY}, --out DIR keeps both"
STARTS_ANEW = "the run starts again"


@dataclass(frozen=True)
class Resumption:
    """Where a run continues, and what its user should know about that."""

    checkpoint: Stored | None = None  # None: at the start
    remarks: tuple[str, ...] = ()


NEW = Resumption()


def find_resumption(folder: Path, scenario: Scenario) -> Resumption:
    """Return where the run of a scenario can continue in a folder.

    Raises InvalidInputError where another scenario or another version of the code has begun there, with what differs,
    or where no checkpoint is whole; OutputExistsError where the folder holds something else.
    """
    if not folder.exists() or not any(folder.iterdir()):
        return NEW
    files.check_folder(folder)
    paths = [folder / name for name in files.CHECKPOINTS if (folder / name).is_file()]
    if not paths:
        _refuse_other_start(folder, scenario)
        return Resumption(remarks=(f"{folder}: no checkpoint saved; {STARTS_ANEW}",))
    return _newest_good(paths, scenario)


def remarks_on(found: Resumption, folder: Path) -> Iterator[str]:
    """Yield what the user of a run that is to be resumed should know, a line each."""
    yield from found.remarks
    if found.checkpoint is not None:
        position = found.checkpoint.position
        yield f"resuming at step {position.step} ({position.frames} frames recorded): {folder}"
    if found is NEW:
        for other in files.unfinished_beside(folder):
            yield f"nothing to resume in {folder}; an unfinished run of another scenario or code version is in {other}"


def kept_rows(folder: Path, recorder: Recorder) -> Rows:
    """Return the frames at output times that an earlier part of a run has left. Raises what reading them raises.

    Frames after the checkpoint are among them, as the run would only repeat them; that of the moment at which it was
    stopped is not.
    """
    rows = rows_of_frames(read_systems(folder / files.FRAMES, recorder.systems))
    return rows.chosen(np.array([recorder.is_output_time(step) for step in rows.steps.tolist()]))


def check_frames(stored: Stored, recorder: Recorder) -> None:
    """Raise InvalidInputError where frames before a checkpoint are missing, or are not as they were recorded.

    `recorder` has taken over all frames that there are.
    """
    position = stored.position
    path, count = stored.path.parent / files.FRAMES, recorder.count_until(position.step)
    if count != position.frames:
        raise InvalidInputError(
            f"{path}: holds {count} of the {position.frames} frames before step {position.step}, at which "
            f"{stored.path.name} resumes; {REMEDY}"
        )
    if recorder.digest_until(position.step) != position.frames_sha256:
        raise InvalidInputError(
            f"{path}: changed after the interruption: the {count} frames before step {position.step} do not "
            f"match the SHA-256 in {stored.path.name}; {REMEDY}"
        )


def take_over_probes(stored: Stored, scenario: Scenario, recorder: Recorder) -> None:
    """Begin with the samples of probes before a checkpoint. Raises InvalidInputError where some are missing."""
    if recorder.probes.all:
        path = stored.path.parent / files.FRAMES
        missing = recorder.probes.take_over(read_probes(path, scenario), stored.position.step)
        if missing:
            where = f"before step {stored.position.step}, at which {stored.path.name} resumes"
            raise InvalidInputError(f"{path}: samples of probe {missing[0]} are missing {where}; {REMEDY}")


def _newest_good(paths: list[Path], scenario: Scenario) -> Resumption:
    """Return the checkpoint of the most steps among those that are whole."""
    remarks: list[str] = []
    whole: list[Stored] = []
    for path in paths:
        try:
            whole.append(read_checkpoint(path))
        except InvalidInputError as error:
            remarks.append(str(error))
    whole.sort(key=lambda stored: stored.position.step)
    if not whole:
        raise InvalidInputError("\n".join([*remarks, f"{paths[0].parent}: no checkpoint is complete; {REMEDY}"]))
    newest, origin = whole[-1], origin_of(scenario)
    refuse_other(newest.path, newest.head.origin, origin)
    if remarks:
        remarks.append(f"resuming from the other checkpoint, {newest.path.name}")
    if newest.head.origin.machine != origin.machine:
        was = newest.head.origin.machine
        remarks.append(f"this part runs on another machine than before ({was}): the last digits may differ")
    return Resumption(newest, tuple(remarks))


def _refuse_other_start(folder: Path, scenario: Scenario) -> None:
    """Raise InvalidInputError where the unfinished run in a folder is of another scenario."""
    path = folder / files.SCENARIO
    try:
        begun = load_stored(path)
    except BlocksimError:  # killed before it was written, or damaged: there is nothing in this folder to lose
        return
    refuse_other_scenario(path, deciding_values(begun), deciding_values(scenario))


def refuse_other(path: Path, old: Origin, new: Origin) -> None:
    """Raise InvalidInputError, which names what differs, where a run would continue to other bits."""
    refuse_other_scenario(path, old.scenario, new.scenario)
    changed = [*_changed(old.versions, new.versions)]
    if changed:
        raise InvalidInputError(f"{path}: of another version of the code: {_listed(changed)}; {REMEDIES}")
    rooms = [room for room in new.rooms if old.rooms.get(room) != new.rooms[room]]
    if rooms:
        where = _listed([f"blocksim/{room}" for room in rooms])
        raise InvalidInputError(f"{path}: of another version of the code: it differs in {where}; {REMEDIES}")


def refuse_other_scenario(path: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Raise InvalidInputError, which names the keys, where two scenarios differ in what decides the motion."""
    changed = [*_changed(dict(_flat(old)), dict(_flat(new)))]
    if changed:
        raise InvalidInputError(f"{path}: of another scenario: {_listed(changed)}; {REMEDIES}")


def _flat(data: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield all values with their keys, as --set names them."""
    entries: Sequence[tuple[object, object]] = ()
    if isinstance(data, Mapping):
        entries = [*data.items()]
    elif isinstance(data, list | tuple):
        entries = [*enumerate(data)]
    else:
        yield key, data
    for name, value in entries:
        yield from _flat(value, f"{key}.{name}" if key else str(name))


def _changed(old: Mapping[str, object], new: Mapping[str, object]) -> Iterator[str]:
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key), new.get(key)
        if before != after:
            yield f"{key} {_shown(before)} -> {_shown(after)}"


def _shown(value: object) -> str:
    return NONE if value is None else str(value)


def _listed(changed: Sequence[str]) -> str:
    more = len(changed) - MOST_NAMED
    return ", ".join(changed[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
