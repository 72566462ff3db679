"""Where a run that did not finish can continue: the newest whole checkpoint in its folder, and the frames before it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.resolved import deciding_values
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint import Stored, read_checkpoint
from blocksim.simulation.checkpoint_origin import origin_of, refuse_other, refuse_other_scenario
from blocksim.simulation.recorder import Recorder, Rows, rows_of_frames
from blocksim.simulation.stores.hdf5_reader import read_frames

ANEW = "--overwrite starts again"
STARTS_ANEW = "the run starts again"


@dataclass(frozen=True)
class Resumption:
    """Where a run continues, and what its user ought to know about that."""

    checkpoint: Stored | None = None  # None: at the start
    remarks: tuple[str, ...] = ()


NEW = Resumption()


def find_resumption(folder: Path, scenario: Scenario) -> Resumption:
    """Look into a folder for where the run of a scenario can continue.

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


def kept_rows(folder: Path, scenario: Scenario, recorder: Recorder) -> Rows:
    """Return the frames at output times that an earlier part of a run has left. Raises what reading them raises.

    Frames after the checkpoint are among them, as the run would only repeat them; that of the moment at which it was
    stopped is not.
    """
    rows = rows_of_frames(read_frames(folder / files.FRAMES, scenario))
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
            f"{stored.path.name} goes on; {ANEW}"
        )
    if recorder.digest_until(position.step) != position.frames_sha256:
        raise InvalidInputError(
            f"{path}: changed since the run was interrupted: the {count} frames before step {position.step} do not "
            f"have the SHA-256 that {stored.path.name} has of them; {ANEW}"
        )


def _newest_good(paths: list[Path], scenario: Scenario) -> Resumption:
    """Return the checkpoint of the most steps among those that are whole."""
    remarks: list[str] = []
    whole = sorted(_whole(paths, remarks), key=lambda stored: stored.position.step)
    if not whole:
        raise InvalidInputError("\n".join([*remarks, f"{paths[0].parent}: no checkpoint is whole; {ANEW}"]))
    newest, origin = whole[-1], origin_of(scenario)
    refuse_other(newest.path, newest.head.origin, origin)
    if remarks:
        remarks.append(f"the run goes on from the other checkpoint, {newest.path.name}")
    if newest.head.origin.machine != origin.machine:
        was = newest.head.origin.machine
        remarks.append(f"this part runs on another machine than before ({was}): the last digits may differ")
    return Resumption(newest, tuple(remarks))


def _whole(paths: list[Path], remarks: list[str]) -> Iterator[Stored]:
    for path in paths:
        try:
            yield read_checkpoint(path)
        except InvalidInputError as error:
            remarks.append(str(error))


def _refuse_other_start(folder: Path, scenario: Scenario) -> None:
    """Raise InvalidInputError where the unfinished run in a folder is of another scenario."""
    path = folder / files.SCENARIO
    try:
        begun = load_stored(path)
    except BlocksimError:  # killed before it was written, or damaged: there is nothing in this folder to lose
        return
    refuse_other_scenario(path, deciding_values(begun), deciding_values(scenario))
