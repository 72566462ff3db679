"""Copies of the files that a scenario names, kept beside its resolved form so that the folder can move."""

from collections.abc import Mapping
from pathlib import Path

from blocksim.errors import InputMissingError
from blocksim.scenario import Scenario, motion_table_content, scenario_to_toml
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_bytes


def read_tables(scenario: Scenario) -> dict[str, bytes]:
    """Return the tables that a scenario names, by the name of their copies.

    To be called before a folder is emptied: they may lie in there, where a run is repeated. Raises InputMissingError.
    """
    tables = {}
    if scenario.experiment is not None:
        try:
            tables[files.EXPERIMENT] = scenario.experiment.table.read_bytes()
        except OSError as error:
            message = f"{scenario.experiment.table}: cannot be read: {error.strerror}"
            raise InputMissingError(message) from error
    motion = motion_table_content(scenario)
    return tables if motion is None else {**tables, files.MOTION: motion}


def keep_tables(tables: Mapping[str, bytes], folder: Path) -> None:
    """Write the copies into a folder; those that are not needed any more go."""
    for name in (files.EXPERIMENT, files.MOTION):
        if name in tables:
            write_bytes(folder / name, tables[name])
        else:
            (folder / name).unlink(missing_ok=True)


def resolved_beside(scenario: Scenario, tables: Mapping[str, bytes]) -> str:
    """Return the resolved scenario (TOML) that refers to the copies beside it."""
    names = {name: name if name in tables else None for name in (files.EXPERIMENT, files.MOTION)}
    return scenario_to_toml(scenario, experiment_table=names[files.EXPERIMENT], motion_table=names[files.MOTION])
