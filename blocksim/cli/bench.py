"""blocksim bench: measure speed and memory, of other engines too on request."""

import json
import math
from pathlib import Path
from typing import Annotated

import typer

from blocksim.bench.machine import Machine, this_machine
from blocksim.bench.measurement import REPEATS, Number, Outcome, Setting, report
from blocksim.bench.measurements import chosen
from blocksim.cli import options
from blocksim.cli.output import grouped_lines, note, show
from blocksim.cli.prepare import tell_compilation
from blocksim.cli.progress import one_by_one
from blocksim.errors import OutputError
from blocksim.simulation.atomic import write_text
from blocksim.simulation.own_files import is_bench, is_picture, refuse_foreign
from blocksim.verification.verify import number
from blocksim.view.layout import OWN, Paper
from blocksim.view.work_precision import draw_work_precision, refuse_small_page

COLUMNS = ("quantity", "unit", "median", "smallest", "largest")
PICTURE = Path("work_precision.png")
DIGITS = 3
LARGE = 100.0


def bench_command(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="three-blocks, ensemble, walls, threads, nonsmooth-blocks, nonsmooth-walls, nonsmooth-threads, "
            "soils, start-up; with --peers three-blocks, three-blocks-e0, wall.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Run reduced cases; the last lines list what was reduced.")
    ] = False,
    repeats: Annotated[int, typer.Option(min=1, metavar="N", help="Samples of each number.")] = REPEATS,
    peers: Annotated[
        bool, typer.Option("--peers", help="Compare with pymunk and Box2D, and draw the comparison.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Write everything as JSON; the picture goes into the same folder."),
    ] = None,
    size: options.Size = None,
    dots: options.Dots = None,
    overwrite: options.Replace = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Measure speed and memory, and show the table.

    Times of the solver are CPU seconds of its steps, medians over repeats with the smallest and largest sample. All
    measurements take some minutes on one core; nothing else should run. --peers needs the extra blocksim[bench].

    Example: blocksim bench walls --out bench.json
    """
    silent = quiet or as_json
    paper = options.paper_of(size, dots)
    if not peers and paper != OWN:
        raise typer.BadParameter("--size and --dpi are for the picture that --peers draws")
    wanted = chosen(names or [], peers=peers)
    if peers:
        refuse_small_page(len(wanted), paper)
    _refuse_present(out, peers=peers, overwrite=overwrite)
    machine = this_machine()
    tell_compilation("surface", quiet=silent)
    outcomes: list[Outcome] = []
    try:
        told = one_by_one(wanted, lambda one: f"{one.name}: {one.title}", quiet=silent)
        outcomes.extend(one.run(Setting(quick, repeats)) for one in told)
    finally:  # also when stopped: minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            _show(machine, outcomes, out, paper, as_json=as_json, quiet=silent)


def _refuse_present(out: Path | None, *, peers: bool, overwrite: bool) -> None:
    """Check before minutes of measuring that the report, and the picture that --peers draws, can be written."""
    if out is not None and (out.is_dir() or not out.absolute().parent.is_dir()):
        message = f"{out}: cannot be written: {'it is a folder' if out.is_dir() else 'no such folder'}"
        raise OutputError(message)
    if out is not None:
        refuse_foreign(out, is_bench, overwrite=overwrite)
    if peers:
        refuse_foreign(_picture(out), is_picture, overwrite=overwrite)


def _picture(out: Path | None) -> Path:
    return PICTURE if out is None else out.with_suffix(".png")


def _show(
    machine: Machine, outcomes: list[Outcome], out: Path | None, paper: Paper, *, as_json: bool, quiet: bool
) -> None:
    data = report(machine, outcomes)
    if out is not None:
        write_text(out, json.dumps(data, indent=2) + "\n")
    picture = _draw(outcomes, _picture(out), paper)
    groups = (
        (f"{one.measurement.name}: {one.measurement.title}", [_cells(number) for number in one.findings.numbers])
        for one in outcomes
    )
    show(grouped_lines(COLUMNS, groups, left=2), data, as_json=as_json)
    if not quiet:
        _tell_end(machine, outcomes)
        for path in (out, picture):
            if path is not None:
                note(f"written: {path}")


def _draw(outcomes: list[Outcome], path: Path, paper: Paper) -> Path | None:
    panels = [outcome.findings.panel for outcome in outcomes if outcome.findings.panel is not None]
    if not panels:
        return None
    draw_work_precision(panels, path, title="Accuracy for computing time, each engine against itself", paper=paper)
    return path


def _cells(one: Number) -> tuple[str, ...]:
    spread = (one.smallest, one.largest) if one.is_repeated else (float("nan"),) * 2
    return (f"  {one.quantity}", one.unit, *(_shown(value) for value in (one.median, *spread)))


def _shown(value: float) -> str:
    """Return a number with three significant digits, a large one with all digits before the point."""
    return f"{value:.0f}" if LARGE <= abs(value) < math.inf else number(value, DIGITS)


def _tell_end(machine: Machine, outcomes: list[Outcome]) -> None:
    for outcome in outcomes:
        for text in outcome.findings.notes:
            note(f"{outcome.measurement.name}: {text}")
        if outcome.shortened:
            note(f"{outcome.measurement.name} shortened: {outcome.shortened}")
    for text in machine.lines():
        note(text)
    note(f"{sum(outcome.seconds for outcome in outcomes):.0f} s")
