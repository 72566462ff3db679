"""Readable parts of a run's folder, and problems: runs that were killed or damaged are shown as well."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.bounded_read import read_limited
from blocksim.scenario.document import MAX_BYTES
from blocksim.simulation import folder as files
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.hdf5_reader import read_frames
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import Columns, read_table

Found = TypeVar("Found")


@dataclass(frozen=True)
class StoredRun:
    """The parts of a run that could be read, None for the others.

    `problems` give the reasons, a line each; `damage` are those that are not missing files.
    """

    folder: Path
    scenario: Scenario | None
    scenario_text: str | None
    summary: Summary | None
    frames: Frames | None
    final: Columns | None
    problems: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The scenario's name; that of the folder where it is not known."""
        if self.scenario is not None:
            return self.scenario.name
        return self.folder.name if self.summary is None else self.summary.name

    @property
    def status(self) -> str:
        """`finished`, `failed` or `interrupted`; `unfinished` where the run left no summary."""
        return "unfinished" if self.summary is None else self.summary.status


class _Attempts:
    """Reads one part after the other and records errors."""

    def __init__(self) -> None:
        self.problems: list[str] = []
        self.damage: list[str] = []

    def at(self, read: Callable[[], Found]) -> Found | None:
        """Return what `read` returns, None where it raises an error of the input."""
        try:
            return read()
        except BlocksimError as error:
            self.problems.append(str(error))
            if not isinstance(error, InputMissingError):
                self.damage.append(str(error))
            return None


def read_stored(folder: Path) -> StoredRun:
    """Return what a run's folder holds. Raises InvalidInputError where nothing of it can be read."""
    attempts = _Attempts()
    scenario = attempts.at(lambda: load_stored(folder / files.SCENARIO))
    summary = attempts.at(lambda: read_summary(folder / files.SUMMARY))
    frames = None if scenario is None else attempts.at(lambda: read_frames(folder / files.FRAMES, scenario))
    final = attempts.at(lambda: read_table(folder / files.FINAL))
    text = _text(folder)
    if scenario is None and summary is None and final is None:
        message = "\n".join([f"{folder}: nothing of this run can be read", *attempts.problems])
        raise InvalidInputError(message)
    return StoredRun(folder, scenario, text, summary, frames, final, tuple(attempts.problems), tuple(attempts.damage))


def _text(folder: Path) -> str | None:
    """Return the resolved scenario as it lies in the folder."""
    try:
        return read_limited(folder / files.SCENARIO, MAX_BYTES).decode(errors="replace")
    except BlocksimError:
        return None
