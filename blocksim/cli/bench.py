"""blocksim bench: measure speed and memory."""

import json
import math
from pathlib import Path
from typing import Annotated

import typer

from blocksim.bench.measurement import REPEATS, Number, Outcome, Setting, machine_lines, report, this_machine
from blocksim.bench.measurements import choose
from blocksim.cli import command_line
from blocksim.cli.output import grouped_lines, note, show
from blocksim.cli.prepare import announce_compilation
from blocksim.cli.progress import one_by_one
from blocksim.errors import OutputError
from blocksim.simulation.atomic import write_text
from blocksim.simulation.folder import refuse_foreign
from blocksim.verification.case import number

COLUMNS = ("quantity", "unit", "median", "smallest", "largest")
DIGITS = 3
LARGE = 100.0


def bench_command(
    *,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="three-blocks, ensemble, walls, threads, nonsmooth-blocks, nonsmooth-walls, nonsmooth-threads, "
            "soils, start-up.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Run reduced cases; the last lines list what was reduced.")
    ] = False,
    repeats: Annotated[int, typer.Option(min=1, metavar="N", help="Samples of each number.")] = REPEATS,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Write everything as JSON."),
    ] = None,
    overwrite: command_line.Replace = False,
    as_json: command_line.Json = False,
    quiet: command_line.Quiet = False,
) -> None:
    """Measure speed and memory, and show the table.

    Times of the solver are CPU seconds of its steps, medians over repeats with the smallest and largest sample. All
    measurements take some minutes on one core; nothing else should run.

    Example: blocksim bench walls --out bench.json
    """
    silent = quiet or as_json
    wanted = choose(names or [])
    if out is not None:  # checked before minutes of measuring
        if out.is_dir() or not out.absolute().parent.is_dir():
            message = f"{out}: cannot be written: {'it is a folder' if out.is_dir() else 'no such folder'}"
            raise OutputError(message)
        refuse_foreign(out, overwrite=overwrite)
    machine = this_machine()
    announce_compilation("surface", quiet=silent)
    outcomes: list[Outcome] = []
    try:
        told = one_by_one(wanted, lambda one: f"{one.name}: {one.title}", quiet=silent)
        outcomes.extend(one.run(Setting(quick, repeats)) for one in told)
    finally:  # also when stopped: minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            _show(machine, outcomes, out, as_json=as_json, quiet=silent)


def _show(machine: dict[str, object], outcomes: list[Outcome], out: Path | None, *, as_json: bool, quiet: bool) -> None:
    data = report(machine, outcomes)
    if out is not None:
        write_text(out, json.dumps(data, indent=2) + "\n")
    groups = (
        (f"{one.measurement.name}: {one.measurement.title}", [_cells(number) for number in one.findings.numbers])
        for one in outcomes
    )
    show(grouped_lines(COLUMNS, groups, left=2), data, as_json=as_json)
    if not quiet:
        _tell_end(machine, outcomes)
        if out is not None:
            note(f"written: {out}")


def _cells(one: Number) -> tuple[str, ...]:
    spread = (min(one.samples), max(one.samples)) if len(one.samples) > 1 else (float("nan"),) * 2
    return (f"  {one.quantity}", one.unit, *(_shown(value) for value in (one.median, *spread)))


def _shown(value: float) -> str:
    """Return a number with three significant digits, a large one with all digits before the point."""
    return f"{value:.0f}" if LARGE <= abs(value) < math.inf else number(value, DIGITS)


def _tell_end(machine: dict[str, object], outcomes: list[Outcome]) -> None:
    for outcome in outcomes:
        for text in outcome.findings.notes:
            note(f"{outcome.measurement.name}: {text}")
        if outcome.shortened:
            note(f"{outcome.measurement.name} shortened: {outcome.shortened}")
    for text in machine_lines(machine):
        note(text)
    note(f"{sum(outcome.seconds for outcome in outcomes):.0f} s")
