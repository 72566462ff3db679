"""A finished, failed or interrupted run as an object, and back from its folder."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, load_scenario, place_bodies
from blocksim.simulation import folder as files
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.hdf5_reader import read_frames
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import Columns, as_frame, read_table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Result:
    """One run: columns of the final table (mm, degrees), frames (SI), and the summary that run.json holds."""

    name: str
    columns: Columns
    summary: Summary
    scenario: Scenario
    folder: Path | None = None
    held: Frames | None = field(default=None, repr=False)  # frames in memory, where they are

    @cached_property
    def frames(self) -> Frames:
        """The frames, read from the folder when first asked for. Raises what reading them raises."""
        if self.held is not None:
            return self.held
        assert self.folder is not None  # noqa: S101 - one of the two is there
        return read_frames(self.folder / files.FRAMES, self.scenario)

    @cached_property
    def final(self) -> "pd.DataFrame":
        """The final table, a row a block."""
        return as_frame(self.columns)

    @property
    def status(self) -> str:
        """`finished`, `failed` or `interrupted`."""
        return self.summary.status

    @property
    def reason(self) -> str:
        """Why the run ended."""
        return self.summary.reason

    @property
    def experiment(self) -> Path | None:
        """The table of the experiment that the scenario names."""
        return None if self.scenario.experiment is None else self.scenario.experiment.table


def read_result(folder: Path) -> Result:
    """Return the run that a folder holds. Raises InputMissingError or InvalidInputError."""
    summary = read_summary(folder / files.SUMMARY)
    scenario = load_scenario(folder / files.SCENARIO)
    frames = read_frames(folder / files.FRAMES, scenario)
    return Result(scenario.name, read_final(folder, scenario), summary, scenario, folder, frames)


def read_final(folder: Path, scenario: Scenario) -> Columns:
    """Return the final table in the folder of a run of a scenario. Raises InputMissingError or InvalidInputError."""
    path = folder / files.FINAL
    columns = read_table(path)
    if columns["block"] != [body.name for body in place_bodies(scenario)]:
        message = f"{path}: holds other blocks than {files.SCENARIO} beside it"
        raise InvalidInputError(message)
    return columns
