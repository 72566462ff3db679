"""A finished, failed or interrupted run: run.json with rest state and events, the object, and how a folder keeps it."""

import json
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, ValidationError

from blocksim.errors import InvalidInputError
from blocksim.notebook import Shown
from blocksim.scenario import Model, Scenario, input_files
from blocksim.simulation import balance, files, instruments, observables, safety, trajectory
from blocksim.simulation.stores.hdf5 import read_frames, read_probes
from blocksim.world.systems import systems_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


NOT_AT_REST = "does not come to rest before time zero"


class RestState(BaseModel, frozen=True):
    """How a scene came to rest, or how far it got."""

    steps: int
    largest_displacement_mm: float
    displaced_block: str
    held: tuple[str, ...] = ()
    at_rest: bool = True  # False where it was released all the same (`start.release`, soil without an equilibrium)
    damping_J: float | None = None  # noqa: N815 - beside soil: energy that damping took away meanwhile
    energy_error: float | None = None  # the same: residual of the ledger meanwhile, over that energy


class EventRecord(BaseModel, frozen=True):
    """One event that has happened."""

    event: int  # its number in the scenario, from 0
    step: int
    time_s: float  # of that step
    what: str  # in words
    energy_J: float  # noqa: N815 - taken from what the scene holds; negative where the event has brought some in


class ImpulseConvergence(BaseModel, frozen=True):
    """How well the impulses of rigid contacts were found, in a whole run."""

    passes: int  # over all contacts, as many iterations each as it took; those of rounds of impacts too
    unsolved: int  # of these, ended by `time.velocity_sweeps`
    last_change_m_s: float  # largest change of a velocity in the last iteration of the last pass
    largest_change_m_s: float  # the same of any that was ended
    cut_rounds: int  # substeps whose impacts went on after MOST_ROUNDS rounds: what still approached was stopped
    cut_searches: int  # rounds whose energy was made up after MOST_TRIES tries; it is exact all the same


MOST_BYTES = input_files.MEGABYTE
"""Of run.json; a run writes two thousand."""


class Summary(BaseModel, frozen=True):
    """The entries of run.json; seconds are of wall time, unless they say that they are simulated."""

    name: str
    status: Literal["finished", "failed", "interrupted"]
    reason: str
    exit_code: int
    run: str
    scenario_hash: str
    final_state_sha256: str
    steps: int
    time_step_s: float
    simulated_time_s: float
    ended_at: str
    compile_seconds: float
    solver_seconds: float
    total_seconds: float
    threads: int = 1
    resumed_from: tuple[int, ...] = ()  # steps at which parts of the run after the first one began
    last_checkpoint: int | None = None  # step of the last good one, where the run did not finish
    energy_J: balance.EnergyLedger  # noqa: N815 - the unit of energy is a capital letter
    blocks: int | None = None  # defaults of time.step and of rigid contacts follow from these numbers
    free_blocks: int | None = None  # at the start
    impacts: str | None = None  # contact.impacts, of rigid contacts
    convergence: ImpulseConvergence | None = None  # of rigid contacts
    settled: RestState | None = None  # how it came to rest before time zero, where it did
    events: tuple[EventRecord, ...] = ()  # in the order in which they have happened
    movement: observables.Movement | None = None  # None without blocks
    joints: dict[str, safety.Safety] = {}  # "settled" before time zero, where it did, and "end"; without blocks none
    warnings: tuple[str, ...]
    environment: dict[str, str]
    sha256: dict[str, str] = {}  # none before files are written

    def to_json(self) -> str:
        """Return the text of run.json; numbers that are not finite become null."""
        return self.model_dump_json(indent=2) + "\n"


def read_summary(path: Path) -> Summary:
    """Return what a run.json holds. Raises InputMissingError or InvalidInputError."""
    content = input_files.read_limited(path, MOST_BYTES)
    try:
        return Summary.model_validate_json(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InvalidInputError(
            f"{path}: not the summary of a run: {place + ': ' if place else ''}{first['msg']}"
        ) from None


RESULT_FILES = frozenset({files.FRAMES, files.FINAL})
"""Those that stay as the run has written them; the other files may be renewed."""


def changed_files(folder: Path, summary: Summary, names: Collection[str] | None = None) -> tuple[str, ...]:
    """Return which files of a run, or of some names, do not have the checksums that run.json has for them."""
    wanted = {name: digest for name, digest in summary.sha256.items() if names is None or name in names}
    places = {name: folder / Path(name).name for name in wanted}
    return tuple(one for one, at in places.items() if not at.is_file() or files.sha256_of(at) != wanted[one])


MOST_ROWS = 20  # of the table that a notebook shows


@dataclass(frozen=True, repr=False)
class Result(Shown):
    """One run: columns of the final table (mm, degrees), frames (SI), and the summary that run.json holds."""

    name: str
    columns: trajectory.Columns
    summary: Summary
    scenario: Scenario
    folder: Path | None = None
    held: trajectory.Frames | None = field(default=None, repr=False)  # frames in memory, where they are
    held_probes: dict[str, instruments.ProbeSeries] | None = field(
        default=None, repr=False
    )  # samples in memory, where they are

    @cached_property
    def model(self) -> Model:
        """What follows from the scenario."""
        return Model(self.scenario)

    @cached_property
    def frames(self) -> trajectory.Frames:
        """The frames, read from the folder when first asked for. Raises what reading them raises."""
        return read_frames(self._run_file, self.model) if self.held is None else self.held

    @cached_property
    def probes(self) -> dict[str, instruments.ProbeSeries]:
        """The samples of probes by name, read from the folder when first asked for. Raises what reading them raises."""
        return read_probes(self._run_file, self.model) if self.held_probes is None else self.held_probes

    @property
    def _run_file(self) -> Path:
        assert self.folder is not None  # noqa: S101 - where frames are not held, they are in a folder
        return self.folder / files.FRAMES

    @cached_property
    def endings(self) -> dict[str, trajectory.Columns]:
        """Where the systems beside the blocks ended, by their names: tables as in NAME.csv of a run folder."""
        if all(system.ending is None for system in systems_of(self.model)):
            return {}  # frames are many, and nothing of them is asked for
        return {
            track.system.name: track.system.ending(self.model, track)
            for track in self.frames.others
            if track.system.ending is not None
        }

    @cached_property
    def final(self) -> "pd.DataFrame":
        """The final table, one row per block."""
        return trajectory.as_frame(self.columns)

    def to_frame(self) -> "pd.DataFrame":
        """Return the trajectories, one row per frame and block: time_s, block, x_mm, y_mm, rotation_deg, velocities."""
        return trajectory.tidy_table(self.frames)

    def to_xarray(self) -> "xr.Dataset":
        """Return the trajectories as an xarray.Dataset (time, block) in SI. Raises UnavailableError without xarray."""
        return trajectory.data_set(self.frames, self.name)

    def __repr__(self) -> str:
        """Return a line: name, status and reason, blocks, simulated time, folder."""
        where = "in memory" if self.folder is None else str(self.folder)
        count, seconds = len(self.columns["block"]), self.summary.simulated_time_s
        blocks = f"{count} block{'s' if count != 1 else ''}"
        return f"<Result {self.name}: {self.status} ({self.reason}), {blocks}, {seconds:.4g} s simulated, {where}>"

    def _repr_html_(self) -> str:
        """Return the same line above the final table and picture, for notebooks."""
        line = f"{self.name}: {self.status} ({self.reason}), {self.summary.simulated_time_s:.4g} s simulated"
        table: str = self.final.to_html(index=False, max_rows=MOST_ROWS, float_format="{:.2f}".format)
        return f"<p>{escape(line)}</p>{table}{super()._repr_html_()}"

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
    model = Model.stored(folder / files.SCENARIO)
    frames = read_frames(folder / files.FRAMES, model)
    return Result(model.scenario.name, read_final(folder, model), summary, model.scenario, folder, frames)


def read_final(folder: Path, model: Model) -> trajectory.Columns:
    """Return the final table in the folder of a run of a scenario. Raises InputMissingError or InvalidInputError."""
    path = folder / files.FINAL
    columns = trajectory.read_table(path)
    if columns["block"] != [body.name for body in model.bodies]:
        raise InvalidInputError(f"{path}: its blocks are not those of {files.SCENARIO}")
    return columns


def _with_checksums(summary: Summary, folder: Path, tables: Iterable[str]) -> Summary:
    names = (files.SCENARIO, *files.COPIES, files.FINAL, files.JOINTS, files.SOILS, files.FRAMES, *tables)
    sums = {name: files.sha256_of(folder / name) for name in names if (folder / name).is_file()}
    return summary.model_copy(update={"sha256": sums})


def keep_result(result: Result, summary: Summary, folder: Path) -> Result:
    """Keep the tables and the summary of a run that has ended in its folder, beside its frames. Raises OutputError."""
    files.write_text(folder / files.FINAL, trajectory.csv_text(result.columns))
    if any(one.joints for one in summary.joints.values()):
        files.write_text(folder / files.JOINTS, trajectory.csv_text(safety.columns_of(summary.joints)))
    for name, table in result.endings.items():
        files.write_text(folder / f"{name}.csv", trajectory.csv_text(table))
    probes = read_probes(folder / files.FRAMES, result.model)
    tables = {f"{files.PROBE}{name}.csv": series for name, series in probes.items()}
    for name, series in tables.items():
        files.write_text(folder / name, "".join(series.csv_lines()))
    summary = _with_checksums(summary, folder, tables)
    files.write_text(folder / files.SUMMARY, summary.to_json())
    if result.status == "finished":
        files.write_text(folder / files.DONE, json.dumps({"run": summary.run, "status": summary.status}) + "\n")
        files.clear_remains(folder, files.CHECKPOINTS)
    return Result(result.name, result.columns, summary, result.scenario, folder)


def renew_copies(scenario: Scenario, folder: Path) -> None:
    """Bring the resolved scenario and the experiment table in a finished run's folder up to date.

    Neither decides the motion, so both may have changed since the run: another table, or another description.
    """

    def contents() -> list[bytes | None]:
        paths = [folder / name for name in (files.SCENARIO, *files.COPIES)]
        return [path.read_bytes() if path.is_file() else None for path in paths]

    tables, old = files.read_tables(scenario), contents()
    files.keep_scenario(scenario, tables, folder)
    if old != contents():
        summary = read_summary(folder / files.SUMMARY)
        names = [name for name in summary.sha256 if name.startswith(files.PROBE)]
        files.write_text(folder / files.SUMMARY, _with_checksums(summary, folder, names).to_json())
