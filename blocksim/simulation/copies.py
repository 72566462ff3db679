"""Copies of the files that a scenario names, kept beside its resolved form so that the folder can move."""

from collections.abc import Mapping
from pathlib import Path

from blocksim.errors import BlocksimError, OutputExistsError
from blocksim.scenario import Scenario, motion_table_content, scenario_to_toml
from blocksim.scenario.limited import MEGABYTE, read_limited
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_bytes, write_text
from blocksim.simulation.written import copies, is_resolved

MOST_BYTES = MEGABYTE  # of a table of an experiment, which is not read if larger


def read_tables(scenario: Scenario) -> dict[str, bytes]:
    """Return the tables that a scenario names, by the name of their copies.

    To be called before a folder is emptied: they may lie in there, where a run is repeated. Raises as `read_limited`.
    """
    tables = {}
    if scenario.experiment is not None:
        tables[files.EXPERIMENT] = read_limited(scenario.experiment.table, MOST_BYTES, links=True)
    motion = motion_table_content(scenario)
    return tables if motion is None else {**tables, files.MOTION: motion}


def keep_scenario(
    scenario: Scenario, tables: Mapping[str, bytes], folder: Path, plan: str = files.SCENARIO, head: str = ""
) -> str:
    """Write the resolved scenario with a head, and copies of its tables beside it; return the text (TOML).

    Copies that are not needed any more go. Raises OutputExistsError, before anything is written, where a file of
    somebody else is in the place of one of them, and OutputError.
    """
    before = copies(folder, plan)
    refuse_foreign_copies(tables, folder, plan)
    if _is_there(folder / plan) and not is_resolved(folder / plan):
        raise _foreign(folder / plan)
    text = head + resolved_beside(scenario, tables)
    write_text(folder / plan, text)
    for name, content in tables.items():
        write_bytes(folder / name, content)
    for name in before - tables.keys():
        (folder / name).unlink(missing_ok=True)
    return text


def refuse_foreign_copies(tables: Mapping[str, bytes], folder: Path, plan: str = files.SCENARIO) -> None:
    """Raise OutputExistsError where a table of somebody else has the name of a copy, and another content."""
    ours = copies(folder, plan)
    for name, content in tables.items():
        path = folder / name
        if _is_there(path) and not (name in ours or _holds(path, content)):
            raise _foreign(path)


def _is_there(path: Path) -> bool:
    return path.exists() or path.is_symlink()


def _holds(path: Path, content: bytes) -> bool:
    try:
        return read_limited(path, len(content)) == content
    except BlocksimError:
        return False


def _foreign(path: Path) -> OutputExistsError:
    return OutputExistsError(f"{path}: not as blocksim wrote it; move it away, or write elsewhere with --out DIR")


def resolved_beside(scenario: Scenario, tables: Mapping[str, bytes]) -> str:
    """Return the resolved scenario (TOML) that refers to the copies beside it."""
    names = {name: name if name in tables else None for name in (files.EXPERIMENT, files.MOTION)}
    return scenario_to_toml(scenario, experiment_table=names[files.EXPERIMENT], motion_table=names[files.MOTION])
