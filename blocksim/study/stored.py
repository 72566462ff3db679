"""A run as it lies on the disk, for pictures and tables: finished, failed, stopped, killed or still in progress."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from blocksim.errors import BlocksimError
from blocksim.scenario import Scenario, load_stored
from blocksim.simulation import folder as files
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.hdf5_reader import read_frames
from blocksim.simulation.summary import read_summary
from blocksim.study.places import FINISHED, find_run


@dataclass(frozen=True)
class StoredRun:
    """What a run has left so far."""

    folder: Path
    scenario: Scenario
    frames: Frames

    @cached_property
    def remark(self) -> str:
        """What somebody who examines the frames has to know; empty for a finished run."""
        state = _state(self.folder)
        if not state:
            return ""
        return f"{self.folder}: {state}; its {len(self.frames)} frames go to {float(self.frames.time[-1]):.4g} s"


def stored_run(place: Path | str) -> StoredRun:
    """Return the run meant by a run folder, by `results/<name>` or by a scenario file; only its frames are needed.

    Raises InputMissingError, ScenarioError, or InvalidInputError for frames that cannot be read.
    """
    folder = find_run(place, needed=(files.SCENARIO, files.FRAMES))
    scenario = load_stored(folder / files.SCENARIO)
    return StoredRun(folder, scenario, read_frames(folder / files.FRAMES, scenario))


def _state(folder: Path) -> str:
    """Return what is wrong with a run, in words; nothing for a finished one."""
    if not (folder / files.SUMMARY).is_file():
        return "this run was killed or is still running"
    try:
        summary = read_summary(folder / files.SUMMARY)
    except BlocksimError:
        return f"{files.SUMMARY} of this run is damaged"
    return "" if summary.status == FINISHED else f"this run {_verb(summary.status)} ({summary.reason})"


def _verb(status: str) -> str:
    return f"was {status}" if status == "interrupted" else f"has {status}"
