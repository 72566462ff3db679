"""A finished, failed or interrupted run as an object, and back from its folder."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import folder as files
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.hdf5 import read_frames
from blocksim.simulation.table import COLUMNS


@dataclass(frozen=True)
class Result:
    """One run: final table (mm, degrees), frames (SI), and the summary that run.json holds."""

    name: str
    final: pd.DataFrame
    frames: Frames
    summary: dict[str, Any]
    scenario: Scenario
    folder: Path | None = None

    @property
    def status(self) -> str:
        """`finished`, `failed` or `interrupted`."""
        return str(self.summary["status"])

    @property
    def reason(self) -> str:
        """Why the run ended."""
        return str(self.summary["reason"])

    @property
    def experiment(self) -> Path | None:
        """The table of the experiment that the scenario names."""
        return None if self.scenario.experiment is None else self.scenario.experiment.table


def read_summary(folder: Path) -> dict[str, Any]:
    """Return run.json of a run folder. Raises InputMissingError or InvalidInputError."""
    path = folder / files.SUMMARY
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        message = f"{folder}: not a finished run ({files.SUMMARY} is missing)"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:
        message = f"{path}: cannot be read: {error}"
        raise InvalidInputError(message) from error
    if not isinstance(summary, dict) or "status" not in summary:
        message = f"{path}: not the summary of a run"
        raise InvalidInputError(message)
    return summary


def read_final(folder: Path) -> pd.DataFrame:
    """Return final.csv of a run folder. Raises InputMissingError or InvalidInputError."""
    path = folder / files.FINAL
    try:
        final = pd.read_csv(path, dtype={"block": str})
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:
        message = f"{path}: not a final table: {error}"
        raise InvalidInputError(message) from error
    if tuple(final.columns) != COLUMNS:
        message = f"{path}: not a final table: columns are {', '.join(map(str, final.columns))}"
        raise InvalidInputError(message)
    return final


def read_result(folder: Path) -> Result:
    """Return the run that a folder holds. Raises InputMissingError or InvalidInputError."""
    summary = read_summary(folder)
    scenario = load_scenario(folder / files.SCENARIO)
    frames = read_frames(folder / files.FRAMES, folder / files.SCENARIO)
    return Result(scenario.name, read_final(folder), frames, summary, scenario, folder)
