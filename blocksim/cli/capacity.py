"""blocksim capacity: what actuators push or pull until a structure softens."""

import math
from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.curves import STIFF
from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import ExitCode
from blocksim.options import Option
from blocksim.simulation import files
from blocksim.simulation.run import RunCallbacks
from blocksim.study import rows, run
from blocksim.study.capacity import CapacityAnswer, capacity

HEADS = ("actuator", "", "peak kN", "at mm", "0.8 of it at", "kN/mm", "work J", "statics kN")
DASH = "–"


def capacity_command(
    *,
    place: Annotated[
        Path,
        Option(
            "Scenario file, which is run unless it was, run folder, or results/NAME (its newest finished run).",
            metavar="RUN",
            is_argument=True,
        ),
    ],
    settings: command_line.Settings = None,
    screen: command_line.Screen,
) -> command_line.Report:
    """Find peak force, stiffness and softening under actuators.

    One line for each actuator and direction (push is along it): peak of its force, displacement of its point there and
    where the force has fallen to 0.8 of the peak, secant stiffness between 0.15 and 0.4 of the peak (with springs),
    work done on the structure by the end, and the force beyond which statics finds no equilibrium of the structure as
    it is at the start. A run that was not quasi-static gives a warning. The same command again continues a run that was
    stopped or killed.

    Picture: blocksim plot RUN --kind capacity. Curves: probe-NAME.csv in the run's folder.

    Example: blocksim capacity scenarios/walls/pushed_granite_wall.toml
    """
    if place.is_dir():
        if settings:
            raise typer.BadParameter("sets keys of a scenario file; this is a folder", param_hint="--set")
        answer = capacity(place)
    else:
        start = prepare.announce_compilation
        source = prepare.ScenarioInput(place, settings)
        with source.built() as ready, progress.run_progress(quiet=screen.silent) as on_progress:
            prepare.warn_of_values([ready], screen)
            note = RunCallbacks(screen.note, lambda kernels: start(kernels, quiet=screen.silent))
            out = files.default_folder(ready)
            result = run.run(ready, out=out, resume=True, on_progress=on_progress, listener=note)
        if result.status != rows.FINISHED:
            why = f"{result.name}: {result.status}: {result.reason}; partial results are in {result.folder}"
            code = ExitCode(result.summary.exit_code)
            why += "; rerun the command to finish" if code == ExitCode.STOPPED_EARLY else ""
            return command_line.Report([], {"run": str(result.folder)}, always=[why], code=code)
        answer = capacity(result)
    return _report(answer)


def _report(answer: CapacityAnswer) -> command_line.Report:
    cells = [
        (
            one.actuator,
            one.sense,
            f"{1e-3 * one.peak:.4g}",
            f"{1e3 * one.displacement:.4g}",
            _text(1e3 * one.fallen, " mm"),
            _text(1e-6 * one.stiffness),
            output.number(one.work),
            _text(1e-3 * one.bound),
        )
        for one in answer.all
    ]
    lines = output.table_lines(HEADS, cells, left=2)
    if any(math.isfinite(one.stiffness) for one in answer.all):
        lines += ["", f"kN/mm: secant between {STIFF[0]:g} and {STIFF[1]:g} of the peak"]
    notes = [
        *(f"warning: {text}" for text in answer.warnings),
        f"picture: blocksim plot {answer.folder} --kind capacity",
    ]
    return command_line.Report(["\n".join(lines)], answer.to_dict(), notes)


def _text(number: float, unit: str = "") -> str:
    return f"{number:.4g}{unit}" if math.isfinite(number) else DASH
