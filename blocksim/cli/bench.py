"""blocksim bench: measure speed and memory."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from blocksim.bench import harness, registry
from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import OutputError
from blocksim.options import Option, Replace
from blocksim.simulation import files
from blocksim.verification.case import number

COLUMNS = ("quantity", "unit", "median", "smallest", "largest")
DIGITS = 3
LARGE = 100.0  # from here on a number has all digits before the point, and else three significant ones


def bench_command(
    *,
    names: Annotated[
        list[str] | None,
        Option(
            "three-blocks, ensemble, walls, threads, nonsmooth-blocks, nonsmooth-walls, nonsmooth-threads, "
            "soils, start-up.",
            metavar="[NAME]...",
            is_argument=True,
        ),
    ] = None,
    quick: Annotated[bool, Option("Run reduced cases; the last lines list what was reduced.")] = False,
    repeats: Annotated[int, Option("Samples of each number.", metavar="N", least=1)] = harness.REPEATS,
    out: Annotated[Path | None, Option("Write everything as JSON.", metavar="FILE")] = None,
    overwrite: Replace = False,
    screen: command_line.Screen,
) -> None:
    """Measure speed and memory, and show the table.

    Times of the solver are CPU seconds of its steps, medians over repeats with the smallest and largest sample. All
    measurements take some minutes on one core; nothing else should run.

    Example: blocksim bench walls --out bench.json
    """
    wanted = registry.choose(names or [])
    if out is not None:  # checked before minutes of measuring
        if out.is_dir() or not out.absolute().parent.is_dir():
            raise OutputError(f"{out}: cannot be written: {'it is a folder' if out.is_dir() else 'no such folder'}")
        files.refuse_foreign(out, overwrite=overwrite)
    machine = harness.this_machine()
    prepare.announce_compilation("surface", quiet=screen.silent)
    outcomes: list[harness.BenchmarkRun] = []
    try:
        under_way = progress.one_by_one(wanted, lambda one: f"{one.name}: {one.title}", quiet=screen.silent)
        outcomes.extend(one.run(harness.Effort(quick, repeats)) for one in under_way)
    finally:  # also when stopped: minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            data = harness.report(machine, outcomes)
            if out is not None:
                files.write_text(out, json.dumps(data, indent=2) + "\n")
            written = [] if out is None else [f"written: {out}"]
            notes = [
                *_notes(outcomes),
                *harness.machine_lines(machine),
                f"{sum(one.seconds for one in outcomes):.0f} s",
                *written,
            ]
            screen.print(command_line.Report(output.grouped_lines(COLUMNS, _groups(outcomes), left=2), data, notes))


def _groups(outcomes: list[harness.BenchmarkRun]) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield the name and the rows of each measurement."""

    def shown(value: float) -> str:
        return f"{value:.0f}" if LARGE <= abs(value) < math.inf else number(value, DIGITS)

    for one in outcomes:
        rows = []
        for found in one.findings.numbers:
            spread = (min(found.samples), max(found.samples)) if len(found.samples) > 1 else (math.nan, math.nan)
            rows.append((f"  {found.quantity}", found.unit, *map(shown, (found.median, *spread))))
        yield f"{one.measurement.name}: {one.measurement.title}", rows


def _notes(outcomes: list[harness.BenchmarkRun]) -> Iterator[str]:
    for outcome in outcomes:
        yield from (f"{outcome.measurement.name}: {text}" for text in outcome.findings.notes)
        if outcome.shortened:
            yield f"{outcome.measurement.name} shortened: {outcome.shortened}"
