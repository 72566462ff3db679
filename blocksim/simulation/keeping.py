"""What a run leaves in its folder when it ends: tables, summary with checksums, and the mark of a finished run."""

import json
from pathlib import Path

from blocksim.scenario import Scenario
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import sha256_of, write_text
from blocksim.simulation.result import Result
from blocksim.simulation.result_files import PROBE, keep_scenario, probe_tables, read_tables
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import csv_text

COPIES = (files.SCENARIO, files.EXPERIMENT, files.MOTION, *files.BODY_MOTIONS)


def _with_checksums(summary: Summary, folder: Path) -> Summary:
    tables = [name for name in summary.sha256 if name.startswith(PROBE)]
    kept = [name for name in (*COPIES, files.FINAL, files.SOILS, files.FRAMES, *tables) if (folder / name).is_file()]
    return summary.model_copy(update={"sha256": {name: sha256_of(folder / name) for name in kept}})


def keep_result(result: Result, summary: Summary, folder: Path) -> Result:
    """Keep the tables and the summary of a run that has ended in its folder, beside its frames. Raises OutputError."""
    write_text(folder / files.FINAL, csv_text(result.columns))
    for name, table in result.endings.items():
        write_text(folder / f"{name}.csv", csv_text(table))
    tables = _keep_probes(result.scenario, folder)
    summary = _with_checksums(summary.model_copy(update={"sha256": dict.fromkeys(tables, "")}), folder)
    write_text(folder / files.SUMMARY, summary.to_json())
    if result.status == "finished":
        write_text(folder / files.DONE, json.dumps({"run": summary.run, "status": summary.status}) + "\n")
        files.clear_remains(folder, files.CHECKPOINTS)
    return Result(result.name, result.columns, summary, result.scenario, folder)


def _keep_probes(scenario: Scenario, folder: Path) -> list[str]:
    """Write a CSV for each probe, from what the run file has of it; return their names. Raises OutputError."""
    tables = probe_tables(scenario)
    for name, series in zip(tables, read_probes(folder / files.FRAMES, scenario).values(), strict=True):
        write_text(folder / name, "".join(series.csv_lines()))
    return tables


def renew_copies(scenario: Scenario, folder: Path) -> None:
    """Bring the resolved scenario and the experiment table in a finished run's folder up to date.

    Neither decides the motion, so both may have changed since the run: another table, or another description.
    """
    tables = read_tables(scenario)
    old = tuple(_bytes_of(folder / name) for name in COPIES)
    keep_scenario(scenario, tables, folder)
    if old != tuple(_bytes_of(folder / name) for name in COPIES):
        summary = _with_checksums(read_summary(folder / files.SUMMARY), folder)
        write_text(folder / files.SUMMARY, summary.to_json())


def _bytes_of(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
