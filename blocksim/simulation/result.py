"""A finished, failed or interrupted run as an object, and back from its folder."""

from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, load_stored, place_bodies
from blocksim.simulation import folder as files
from blocksim.simulation.frames import Frames, data_set, tidy_table
from blocksim.simulation.probe_series import ProbeSeries
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.simulation.stores.hdf5_reader import read_frames
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import Columns, as_frame, read_table

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

MOST_ROWS = 20  # of the table that a notebook shows


@dataclass(frozen=True, repr=False)
class Result:
    """One run: columns of the final table (mm, degrees), frames (SI), and the summary that run.json holds."""

    name: str
    columns: Columns
    summary: Summary
    scenario: Scenario
    folder: Path | None = None
    held: Frames | None = field(default=None, repr=False)  # frames in memory, where they are
    held_probes: dict[str, ProbeSeries] | None = field(default=None, repr=False)  # samples in memory, where they are

    @cached_property
    def frames(self) -> Frames:
        """The frames, read from the folder when first asked for. Raises what reading them raises."""
        if self.held is not None:
            return self.held
        assert self.folder is not None  # noqa: S101 - one of the two is there
        return read_frames(self.folder / files.FRAMES, self.scenario)

    @cached_property
    def probes(self) -> dict[str, ProbeSeries]:
        """The samples of probes by name, read from the folder when first asked for. Raises what reading them raises."""
        if self.held_probes is not None:
            return self.held_probes
        assert self.folder is not None  # noqa: S101 - one of the two is there
        return read_probes(self.folder / files.FRAMES, self.scenario)

    @cached_property
    def endings(self) -> dict[str, Columns]:
        """Where the systems beside the blocks ended, by their names: tables as in NAME.csv of a run folder."""
        return {
            track.system.name: track.system.ending(self.scenario, track)
            for track in self.frames.others
            if track.system.ending is not None
        }

    @cached_property
    def final(self) -> "pd.DataFrame":
        """The final table, one row per block."""
        return as_frame(self.columns)

    def to_frame(self) -> "pd.DataFrame":
        """Return the trajectories, one row per frame and block: time_s, block, x_mm, y_mm, rotation_deg, velocities."""
        return tidy_table(self.frames)

    def to_xarray(self) -> "xr.Dataset":
        """Return the trajectories as an xarray.Dataset (time, block) in SI. Raises UnavailableError without xarray."""
        return data_set(self.frames, self.name)

    def __repr__(self) -> str:
        """Return a line: name, status and reason, blocks, simulated time, folder."""
        where = "in memory" if self.folder is None else str(self.folder)
        count = len(self.columns["block"])
        blocks = f"{count} block{'s' if count != 1 else ''}"
        return f"<Result {self.name}: {self.status} ({self.reason}), {blocks}, {self._seconds}, {where}>"

    def _repr_html_(self) -> str:
        """Return the same line above the final table, for notebooks."""
        line = f"{self.name}: {self.status} ({self.reason}), {self._seconds}"
        table: str = self.final.to_html(index=False, max_rows=MOST_ROWS, float_format="{:.2f}".format)
        return f"<p>{escape(line)}</p>{table}"

    @property
    def _seconds(self) -> str:
        return f"{self.summary.simulated_time_s:.4g} s simulated"

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
    scenario = load_stored(folder / files.SCENARIO)
    frames = read_frames(folder / files.FRAMES, scenario)
    return Result(scenario.name, read_final(folder, scenario), summary, scenario, folder, frames)


def read_final(folder: Path, scenario: Scenario) -> Columns:
    """Return the final table in the folder of a run of a scenario. Raises InputMissingError or InvalidInputError."""
    path = folder / files.FINAL
    columns = read_table(path)
    if columns["block"] != [body.name for body in place_bodies(scenario)]:
        message = f"{path}: its blocks are not those of {files.SCENARIO}"
        raise InvalidInputError(message)
    return columns
