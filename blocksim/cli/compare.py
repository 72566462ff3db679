"""blocksim compare: judge runs and sweeps against measured repeats."""

import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.judgement import THRESHOLD, U_NUM, Settings
from blocksim.cli import options
from blocksim.cli.output import show
from blocksim.cli.verdicts import comparison_table, judgement_lines, meanings, verdict_lines
from blocksim.errors import ExitCode
from blocksim.scenario.path_policy import near
from blocksim.study.compare import compare_run, compare_sweep
from blocksim.study.stored_run import find_run
from blocksim.study.sweep_table import is_sweep


@dataclass(frozen=True)
class Judged:
    """Result for one place: for people, for programs, and whether it is inside."""

    head: str
    lines: tuple[str, ...]
    data: dict[str, object]
    inside: bool


def compare_command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN", help="Run folder, results/NAME (its newest finished run), scenario file, or sweep folder."
        ),
    ],
    experiment: options.ExperimentPath = None,
    threshold: Annotated[
        float,
        typer.Option(min=0.0, max=1.0, help="For sweeps: share of samples that must be within all measured ranges."),
    ] = THRESHOLD,
    u_num: Annotated[
        float,
        typer.Option(
            min=0.0, max=1e6, metavar="MM", help="For sweeps: standard uncertainty of the numerical solution, in mm."
        ),
    ] = U_NUM,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare runs with measured repeats.

    Exit code 1: anything is out of range. A position is inside between the smallest and the largest repeat (0.5 mm
    either side where all repeats are equal), a rotation within 5 degrees of the mean. Of a sweep, at least the share
    --threshold of the samples must be within all measured ranges; this needs the extra blocksim[study]. Its numbers:

    {meanings}

    Example: blocksim compare scenarios/three_blocks.toml
    """
    settings = Settings(threshold, u_num)
    judged = [_judge(run, experiment, settings) for run in runs]
    texts = ("\n".join(one.lines if quiet and len(judged) == 1 else (one.head, *one.lines)) for one in judged)
    show(["\n\n".join(texts)], [one.data for one in judged], as_json=as_json)
    raise typer.Exit(ExitCode.SUCCESS if all(one.inside for one in judged) else ExitCode.OUTSIDE)


compare_command.__doc__ = inspect.cleandoc(compare_command.__doc__ or "").replace("{meanings}", meanings())


def _judge(place: Path, experiment: Path | None, settings: Settings) -> Judged:
    if is_sweep(place):
        return _judge_sweep(place, experiment, settings)
    return _judge_run(place, experiment)


def _judge_sweep(place: Path, experiment: Path | None, settings: Settings) -> Judged:
    judgement = compare_sweep(place, experiment, settings)
    head = f"{place} against {near(judgement.source)}:"
    return Judged(head, tuple(judgement_lines(judgement)), judgement.to_dict(), judgement.inside)


def _judge_run(place: Path, experiment: Path | None) -> Judged:
    folder = find_run(place)
    comparison = compare_run(folder, experiment)
    head = f"{folder} against {near(comparison.source)}:"
    lines = (*comparison_table(comparison), *verdict_lines(comparison))
    return Judged(head, lines, {"run": str(folder), **comparison.to_dict()}, comparison.inside)
